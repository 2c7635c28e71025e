"""`simulate` for a structure with several dampers: one loop, in which each damper has its own law."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.loop_inputs import variant_for_dampers
from mrpipe.pipeline.stage import Stage, StageContext
from mrpipe.words import in_percent

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.errors import StageSkipped
    from mrpipe.reporting import several_dampers as report
    from mrpipe.simulation.rig import amplitude_warning, drive_warning, record_warning
    from mrpipe.simulation.several_dampers_rig import dampers_excitation, dampers_release, read_dampers_rig
    from mrpipe.simulation.several_dampers_storage import response_summary, write_dampers_response

    settings, structure = context.settings.simulate, context.settings.structure
    if not structure.dampers:
        raise StageSkipped("the configuration has no structure.dampers")
    rig = read_dampers_rig(settings, structure, context.settings.calibrate.damper, context.artifact)
    excitation = dampers_excitation(rig, settings.excitation)
    if settings.excitation.base_amplitude_m_s2 is None:
        level = float(excitation.details.get("base_amplitude_m_s2", 0.0))
        if implausible := amplitude_warning(level):
            context.warn(implausible)
    for damper in rig.dampers:
        if beyond := drive_warning(damper.model, settings.controller.drive_limit):
            context.warn(f"{damper.known.name}: {beyond}")
    if impossible := record_warning(excitation.details):
        context.warn(impossible)
    context.progress(0.2, "loop")
    response = rig.run(excitation, rng=context.rng, initial_state=dampers_release(rig, settings.excitation))
    summary = response_summary(rig, response, excitation)
    if summary["energy_balance_error"] > 5e-3:
        context.warn(
            f"energy balance is off by {in_percent(summary['energy_balance_error'], 2)}: raise simulate.plant_rate_hz"
        )
    with context.write("response-dampers.h5") as artifact:
        write_dampers_response(artifact, rig, response)
        artifact.put_json("indices", {key: value for key, value in summary.items() if key != "real_time_factor"})
    report.describe_simulation(context.report, rig, response, summary)
    return summary


STAGE = Stage(
    name="simulate-dampers",
    summary="Run the closed loop of a structure with several dampers, each under its own law.",
    run=_run,
    inputs=("identify-frame", "calibrate"),
    settings=("simulate", "structure", "calibrate.damper"),
    family="simulate",
    outputs=("response-dampers.h5",),
)


def variant(configuration: RunSettings, _: str = "") -> Stage | None:
    """Return the stage if the configuration has several dampers, else None."""
    return variant_for_dampers(STAGE, configuration)
