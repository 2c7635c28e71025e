"""`design` for a structure with several dampers: the gains of all dampers are searched together.

This stage replaces the stage for one damper if the configuration has `structure.dampers`.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.loop_inputs import variant_for_dampers
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings


def _run(context: StageContext) -> Mapping[str, Any]:
    import time

    from mrpipe.law_design.run import load_of
    from mrpipe.law_design.several_dampers import design_as_json, design_dampers
    from mrpipe.reporting import several_dampers as report
    from mrpipe.reporting.design_words import exceeded_limits
    from mrpipe.simulation.inputs import ground_amplitude
    from mrpipe.simulation.several_dampers_rig import dampers_band, dampers_excitation, read_dampers_rig

    began = time.perf_counter()
    settings, simulate = context.settings.design, context.settings.simulate
    rig = read_dampers_rig(simulate, context.settings.structure, context.settings.calibrate.damper, context.artifact)
    details = dampers_excitation(rig, simulate.excitation).details
    amplitude = ground_amplitude(details, "a design")
    band = settings.band_rad_s or context.settings.resonance.band_rad_s or dampers_band(rig)
    load = load_of(settings, amplitude, band, rig.frame)
    found = design_dampers(
        rig, settings, load, absolute=simulate.accelerations == "absolute", seed=int(context.rng.integers(2**32))
    )
    if found.starts.sentence:
        context.warn(found.starts.sentence)
    summary = design_as_json(rig, found)
    for line in exceeded_limits(summary["exceeds_limits"]):
        context.warn(line)
    with context.write("design.h5") as artifact:
        artifact.put_json("design", summary)
    report.describe_design(context.report, summary)
    return {**summary, "seconds": time.perf_counter() - began}


def _check(settings: Any) -> None:
    """Check that laws, gains and quantities of the design are known, and its band."""
    from mrpipe.law_design.problem import require_known

    require_known(settings.design)


VARIANTS = (
    Stage(
        name="design",
        summary="Find the gains of several dampers whose largest response over frequency and amplitude is smallest.",
        run=_run,
        inputs=("identify-frame", "calibrate"),
        after=("simulate",),
        settings=("design", "simulate", "resonance", "structure", "calibrate.damper"),
        outputs=("design.h5",),
        check=_check,
    ),
)


def variant(configuration: RunSettings, _: str = "") -> Stage | None:
    """Return the stage if the configuration has several dampers, else None."""
    return variant_for_dampers(VARIANTS[0], configuration)
