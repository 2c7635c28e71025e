"""`close-loop`: the residual of the declared model, traced to a missing effect, added, error before and after."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrpipe.errors import MrpipeError
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.dampers.model import DamperModel
    from mrpipe.effects.contract import Effect
    from mrpipe.fitting.known import Known
    from mrpipe.signals.prepared import PreparedTest
    from mrpipe.tracing.bench.verdict.summary import Tracing

CORRECTIONS = "corrections.yaml"
NEXT_TESTS = "next-tests.yaml"
TRACED = "damper-traced.h5"
_LACKING = {
    "identify-frame": "identified frame",
    "calibrate": "calibrated law",
    "train-inverse": "inverse network",
}


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.effects.declared import declared_effects
    from mrpipe.effects.library import damper_effects, effects_named
    from mrpipe.reporting import close_loop as section
    from mrpipe.signals.prepared import read_prepared
    from mrpipe.tracing.bench.trace import trace_campaign
    from mrpipe.tracing.bench.verdict.identified import comparison_with_identified
    from mrpipe.tracing.bench.verdict.not_fitted import own_effects_not_fitted
    from mrpipe.tracing.options import tracing_options

    settings = context.settings.close_loop
    campaign = load_campaign(context.inputs["campaign:bench"])
    library = effects_named(settings.candidates, settings.effect_files)
    declared = declared_effects(campaign.declared_effects, {**damper_effects(), **library}, campaign.file)
    tests = read_prepared(context.artifact("prepare"))
    chosen, fitted = _identified(context)
    options = tracing_options(
        settings,
        context.settings.identify_damper.form_files,
        _declared(context) if chosen is None else chosen.form,
    )
    traced = trace_campaign(
        tests, library, declared, options, known=fitted, rng=context.rng, jobs=context.jobs, progress=context.progress
    )
    summary = {"campaign": campaign.name, **traced.summary}
    identified = None if chosen is None else comparison_with_identified(chosen, fitted, traced)
    summary["base_form"] = {**summary["base_form"], "identified": identified}
    summary["closed_loop"] = _closed_loop(context, traced, tests)
    summary["corrections"] = _corrections(context, traced, tests)
    summary["next_tests"] = _next_tests(context, traced, library)
    summary["not_tried"] = own_effects_not_fitted(traced, library)
    for name, reason in summary["not_tried"].items():
        context.warn(f"{name!r} of close_loop.effect_files was not fitted: {reason}")
    _write(context, traced, summary)
    section.describe(context.report, section.Traced(traced, summary, settings.named_share, settings.least_share))
    return summary


def _identified(context: StageContext) -> tuple[DamperModel | None, Known]:
    """Return the damper that `identify-damper` chose and all base forms that it fitted; both empty without a result."""
    from mrpipe.dampers.model import read_damper
    from mrpipe.fitting.known import read_known

    if "identify-damper" not in context.inputs:
        return None, {}
    artifact = context.artifact("identify-damper")
    return read_damper(artifact), read_known(artifact)


def _declared(context: StageContext) -> str:
    """Return the form that the settings name for `identify-damper`, or the default where it is to choose."""
    from mrpipe.dampers.forms import DEFAULT_FORM
    from mrpipe.fitting.settings import BEST

    form: str = context.settings.identify_damper.form
    return DEFAULT_FORM if form == BEST else form


def _closed_loop(context: StageContext, traced: Tracing, tests: list[PreparedTest]) -> dict[str, Any]:
    """Return the part on the closed loop; if it fails, the tracing remains valid and the reason is stored."""
    try:
        return closed_loop(context, traced, tests)
    except Exception as error:
        if not isinstance(error, MrpipeError):
            context.log.error("close-loop", exc_info=error, extra={"file_only": True})
        context.fail("the closed loop", error)
        return {"status": f"failed: {error}"}


def closed_loop(context: StageContext, traced: Tracing, tests: list[PreparedTest]) -> dict[str, Any]:
    """Return the part `closed_loop` of the JSON: each law measured, before, after and recalibrated."""
    from dataclasses import replace

    from mrpipe.campaigns import load_campaign
    from mrpipe.control.assembly import ControllerFactory, inverse_network
    from mrpipe.control.storage import read_calibrated
    from mrpipe.fitting.damper import damper_model
    from mrpipe.reporting.closed_loop_words import in_words
    from mrpipe.simulation.resonance import default_band
    from mrpipe.simulation.rig import Rig, loop_options
    from mrpipe.structures import read_frame
    from mrpipe.tracing.loop import study
    from mrpipe.tracing.loop.comparison import measured_runs
    from mrpipe.words import listed

    settings = context.settings.simulate
    needed = ["identify-frame", "calibrate", *(["train-inverse"] if settings.controller.inverse == "network" else [])]
    lacking = [_LACKING[name] for name in needed if name not in context.inputs]
    if lacking:
        return {"status": f"skipped: there is {listed([f'no {item}' for item in lacking])}"}
    context.progress(0.92, "closed loop")
    frame = read_frame(context.artifact("identify-frame"))
    damper = damper_model(traced.selection.base, traced.drive_unit)
    inverse = inverse_network(settings.controller, lambda: context.artifact("train-inverse"))
    calibrated = read_calibrated(context.artifact("calibrate"))
    controllers = ControllerFactory(frame, damper, calibrated, settings.controller, inverse)
    recorded = []
    if "campaign:closed-loop" in context.inputs:
        recorded = measured_runs(load_campaign(context.inputs["campaign:closed-loop"]), frame)
        if not recorded:
            context.warn("no closed-loop recording names its law and has ground motion and floor displacements")
    found = study.closed_loop(
        study.LoopStudy(
            Rig(frame, damper, controllers, replace(loop_options(settings), tracking="damper")),
            traced,
            tests,
            settings,
            recorded,
            _laws(context, controllers.available()),
            context.settings.resonance.band_rad_s or default_band(context.artifact("calibrate")),
            context.rng,
            context.seed,
            context.jobs,
            lambda fraction, text="": context.progress(0.92 + 0.06 * fraction, text),
            context.settings.close_loop.rules.loop,
        )
    )
    return {**found, "statement": in_words(found)}


def _laws(context: StageContext, available: list[str]) -> list[str]:
    """Return the laws to compare in addition to the recorded ones; warn of those that cannot run."""
    from mrpipe.tracing.loop.study import laws_to_compare

    asked = context.settings.close_loop.laws
    for law in asked:
        if law not in available:
            context.warn(f"law {law} is not compared, because it is not calibrated")
    return laws_to_compare(asked, context.settings.stages, available)


def _corrections(context: StageContext, traced: Tracing, tests: list[PreparedTest]) -> dict[str, Any]:
    """Write the corrections that `prepare` should apply to the channels, as settings for the configuration."""
    from mrpipe.tracing.bench.verdict.corrections import Corrections, corrections_of

    prepare = context.settings.prepare
    present = Corrections(**prepare.corrections.model_dump(), displacement_late_s=prepare.displacement_late_s)
    found = corrections_of(traced, tests)
    # what was known before stays in the file, so that it can be given again and again
    settings = {"prepare": found.settings(present)} if (present + found).any else {}
    path = context.run_directory / CORRECTIONS
    _write_settings(
        path,
        settings,
        "Faults of sensors that close-loop found, for prepare to take out: mrpipe prepare --settings FILE"
        if settings
        else "close-loop found no fault of sensors for prepare to take out.",
    )
    return {"file": path.name, "found": found.any, "settings": settings}


def _next_tests(context: StageContext, traced: Tracing, library: Mapping[str, Effect]) -> dict[str, Any]:
    """Write the tests that would decide open questions, as settings for `record`; earlier tests stay in the list."""
    from mrpipe.tracing.bench.campaign_tests.extra_tests import wanted_tests, with_drive_unit

    extra = wanted_tests(traced.summary, library, traced.training)
    listed = context.settings.laboratory.bench.tests
    names = {item.name for item in listed}
    new = [item for item in extra.tests if item["name"] not in names]
    tests = [*(item.model_dump(exclude_defaults=True) for item in listed), *new]
    settings: dict[str, Any] = {"laboratory": {"bench": {"tests": tests}}} if tests else {}
    if any("middle_m" in item for item in tests):
        # the mean of a test about another mean position is not an offset of its sensor
        settings["prepare"] = {"offset": "campaign"}
    path = context.run_directory / NEXT_TESTS
    made = bool(extra.tests) and not new
    if new:
        about = (
            "Tests that would decide what close-loop left open. On a real rig, record them and add them to the "
            "campaign. The virtual rig records them with: mrpipe record --settings FILE"
        )
    elif made:
        about = "All tests that would decide what close-loop left open have been made: longer ones, or repeats, remain."
    else:
        about = "close-loop left nothing open that another test would decide."
    if tests and traced.drive_unit != "A":
        about += f" The values of current_a are drives in {traced.drive_unit}."
    _write_settings(path, settings, about)
    new = with_drive_unit(new, traced.drive_unit)
    return {"file": path.name, "tests": new, "decides": list(extra.reasons), "made_already": made}


def _write_settings(path: Path, settings: Mapping[str, Any], about: str) -> None:
    import yaml

    from mrpipe.artifacts import atomic_write_text

    text = yaml.safe_dump(dict(settings), sort_keys=False, allow_unicode=True, width=120)
    atomic_write_text(path, f"# {about}\n{text}")


def _write(context: StageContext, traced: Tracing, summary: Mapping[str, Any]) -> None:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.artifacts.plain import to_json
    from mrpipe.dampers.model import write_damper, write_tested
    from mrpipe.effects.library import load_effect_file
    from mrpipe.tracing.loop.augmented import tested_range, traced_damper

    files = {load_effect_file(path).name: str(path) for path in context.settings.close_loop.effect_files}
    damper = traced_damper(traced.selection.chosen, traced.drive_unit, effect_files=files)
    tested = tested_range(traced.training)
    with context.write(TRACED) as artifact:
        write_damper(artifact, damper)
        write_tested(artifact, tested)
    validation = traced.validation
    with context.write("close-loop.h5") as artifact:
        # the same damper once more, so that what reads it depends on it
        write_damper(artifact, damper)
        write_tested(artifact, tested)
        artifact.put_json("summary", dict(summary))
        for name, values, unit in (
            ("measured", traced.measured, "N"),
            ("before", traced.before, "N"),
            ("after", traced.after, "N"),
            ("displacement", validation.displacement, "m"),
            ("velocity", validation.velocity, "m/s"),
            ("drive", validation.drive, traced.drive_unit),
            ("time", validation.time, "s"),
        ):
            artifact.put(f"validation/{name}", values, unit=unit, dims=("sample",))
        artifact.put("validation/starts", validation.starts, unit="1", dims=("test",))
        artifact.put_json("validation/names", list(validation.names))
    atomic_write_text(context.run_directory / "close-loop.json", to_json(summary) + "\n")


def _check(settings: Any) -> None:
    """Check that effects and base forms are known, and that files of the user can be read."""
    from mrpipe.dampers.library import forms_named
    from mrpipe.effects.library import effects_named
    from mrpipe.tracing.bench.noise.baseline import form_name
    from mrpipe.tracing.options import IDENTIFIED

    section = settings.close_loop
    if section.candidates or section.effect_files:
        effects_named(section.candidates, section.effect_files)
    if section.form_files:
        if section.model != IDENTIFIED:
            forms_named([form_name(section.model)], section.form_files, "close_loop.model")
        forms_named(section.base_forms, section.form_files, "close_loop.base_forms")


STAGE = Stage(
    name="close-loop",
    summary="Trace the residual to the effect that the model lacks, add it, and report the error before and after.",
    run=_run,
    inputs=("prepare", "campaign:bench"),
    preferred_inputs=("identify-damper",),
    optional_inputs=("identify-frame", "calibrate", "train-inverse", "campaign:closed-loop"),
    settings=(
        "stages",
        "close_loop",
        "identify_damper.form",
        "identify_damper.form_files",
        # all of simulate but the damper: a loop with the traced damper needs what this stage finds
        "simulate.controller",
        "simulate.driver_time_constant_s",
        "simulate.excitation",
        "simulate.plant_rate_hz",
        "simulate.record_rate_hz",
        "simulate.sensors",
        "simulate.tracking",
        "resonance.band_rad_s",
        "prepare.displacement_late_s",
        "prepare.corrections",
        "laboratory.bench.tests",
    ),
    outputs=("close-loop.h5", "close-loop.json", TRACED, CORRECTIONS, NEXT_TESTS),
    check=_check,
)
