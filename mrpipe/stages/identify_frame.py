"""`identify-frame`: mass, damping, stiffness and modes of a frame from sweep and decay tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.modal.identify import FrameIdentification, IdentificationOptions


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.modal.identify import identify_frame
    from mrpipe.modal.records import frame_tests
    from mrpipe.modal.storage import summary, write_identification

    campaign = load_campaign(context.inputs["campaign:frame"])
    for finding in campaign.findings:
        context.warn(finding)
    result = identify_frame(frame_tests(campaign), _options(context), context.progress)
    for finding in result.findings:
        context.warn(finding)
    with context.write("frame.h5") as artifact:
        write_identification(artifact, result)
    values = summary(result)
    _report(context, result, values)
    return {"campaign": campaign.name, **values}


def _options(context: StageContext) -> IdentificationOptions:
    from mrpipe.artifacts import load_parameter_set
    from mrpipe.errors import UserError
    from mrpipe.modal.identify import IdentificationOptions

    settings = context.settings.identify_frame
    shapes = None
    if settings.mode_matrix:
        values = load_parameter_set("frames", settings.mode_matrix).values
        if "mode_shapes" not in values:
            raise UserError(
                f"frame {settings.mode_matrix}", "parameters.mode_shapes", "is missing", "give value and unit"
            )
        shapes = values["mode_shapes"]
    return IdentificationOptions(
        band_low_hz=settings.band_low_hz,
        band_high_hz=settings.band_high_hz,
        damping_from=settings.damping_from,
        stiffness_form=settings.stiffness_form,
        orthogonal=settings.orthogonal_shapes,
        mode_matrix=shapes,
        mode_matrix_name=settings.mode_matrix,
    )


def _report(context: StageContext, result: FrameIdentification, values: Mapping[str, Any]) -> None:
    import pandas as pd

    from mrpipe.modal.spectra import averaged_responses
    from mrpipe.reporting import modal as figures

    floors = result.frame.floors
    context.report.text(
        f"{floors} floors, {floors} modes between {values['frequencies_hz'][0]:.3g} and "
        f"{values['frequencies_hz'][-1]:.3g} Hz. Poles come from a fit of all floors together in which what a record "
        "holds of its beginning and end is modelled; damping from free decays where there are any, and from the sweep "
        "as the second, independent method."
    )
    context.report.table("modes", pd.DataFrame(figures.mode_rows(values)), "Modes with 95 % intervals.")
    for name in ("mass", "stiffness", "damping"):
        frame = pd.DataFrame(getattr(result.frame, name), columns=[f"floor {i + 1}" for i in range(floors)])
        context.report.table(name, frame, {"mass": "M [kg].", "stiffness": "K [N/m].", "damping": "C [N s/m]."}[name])
    averaged = averaged_responses(result.tests[0], context.settings.identify_frame.segment_s)
    context.report.figure(
        "frequency-responses",
        figures.frequency_responses(result.in_frequency, averaged, result.band_hz),
        "Frequency responses: measured (leakage taken out), of M, C and K, and coherence of the averaged spectra.",
    )
    context.report.figure(
        "mode-shapes", figures.mode_shapes(result.mode_shapes, values["frequencies_hz"]), "Mode shapes."
    )
    if result.decays:
        decays = [result.decays[mode] for mode in sorted(result.decays)]
        context.report.figure(
            "decays", figures.decays(decays), "Free decays, exponential fit and peak-to-peak damping."
        )
    context.report.figure(
        "verification", figures.verification(result.in_time[0]), "Measured and simulated response of the sweep."
    )


STAGE = Stage(
    name="identify-frame",
    summary="Identify mass, damping, stiffness and modes of the frame.",
    run=_run,
    inputs=("campaign:frame",),
    after=("identify-damper",),
    settings=("identify_frame",),
    outputs=("frame.h5",),
)
