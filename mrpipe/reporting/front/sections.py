"""The six sections before the appendix, made from the summaries and artifacts of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.artifacts import Artifact
from mrpipe.effects.damper import read_damper
from mrpipe.errors import UserError
from mrpipe.reporting import modal
from mrpipe.reporting.closed_loop_words import in_points
from mrpipe.reporting.facts import RunFacts
from mrpipe.reporting.front import figures, several_dampers, statements, tables
from mrpipe.reporting.front import laws as law_facts
from mrpipe.reporting.front.figures import TestRun
from mrpipe.reporting.places import is_chain, names_of
from mrpipe.reporting.traced_words import (
    not_alone_in_words,
    notes_on_model,
    proper_effects,
    shares_in_words,
    shown_candidates,
)
from mrpipe.reporting.words import percent, quantity
from mrpipe.reporting.writer import Section
from mrpipe.words import listed, number, shell_word, shortest

_POINTS_OF_A_LOOP = 700
_POINTS_OF_A_CURVE = 1500


def sections(facts: RunFacts) -> list[Section]:
    """Return the sections that have something to say."""
    made = [make(facts) for make in (result, trust, damper, structure, control, next_steps)]
    return [section for section in made if section.items]


def result(facts: RunFacts) -> Section:
    """Return the first screen: answers in sentences, and two or three figures."""
    section = Section("result", "Result")
    section.points([f"**{item.topic}.** {item.text}" for item in statements.statements(facts)], kind="answers")
    rows = statements.model_errors(facts)
    if len(rows) > 1:
        section.figure("errors", figures.model_errors(rows), "Error of the models on tests that no fit has seen.")
    shown = _shown_tests(facts)
    if shown:
        section.figure(
            "loop", figures.loop(shown[0]), f"Validation test {shown[0].name}: measured, model before and after."
        )
    runs = law_facts.comparison(facts)
    if runs:
        section.figure(
            "laws",
            figures.law_bars(runs),
            "Response of the structure by control law, to the base motion of the simulation; grey: constant drive.",
        )
    return section


def trust(facts: RunFacts) -> Section:
    """Return what speaks for and against the models."""
    section = Section("trust", "Trust")
    section.points(statements.doubts(facts), kind="warnings")
    rows = [
        {"model": name, "error on unseen tests [%]": number(100.0 * value)}
        for name, value, _ in statements.model_errors(facts)
    ]
    section.table("errors", pd.DataFrame(rows), "RMS error over RMS force on the validation tests.")
    loop = facts.summary("close-loop")
    if "before" in loop:
        recovered = (loop.get("ceiling") or {}).get("recovered")
        text = f"Noise alone causes an error of {percent(loop['noise_floor_nrmse'])} "
        text += f"(estimated from {loop.get('noise_from', 'the sensors')})."
        if proper_effects(loop) and recovered is not None:
            text += f" The named effects recover {percent(recovered)} of what a flexible model recovers of it."
        section.text(text)
        section.table(
            "rivals",
            tables.rivals(loop),
            "Effects that a screening of all effects chose: each was fitted alone, and all parameters again.",
        )
        section.table("forms", tables.forms(loop), "Base forms that were tried, error on the validation tests.")
    inverse = facts.summary("train-inverse")
    if inverse.get("round_trip_nrmse") is not None:
        section.text(
            f"Inverse and forward network in series (desired force to drive, and back to force) miss the desired force "
            f"by {percent(inverse['round_trip_nrmse'])} of its RMS value{_by_regime(inverse)}."
        )
    if loop.get("tests"):
        section.figure(
            "tests",
            _errors_per_test(loop),
            "Error of the validation tests before and after; the largest errors where there are many tests.",
        )
    return section


def _by_regime(inverse: Mapping[str, Any]) -> str:
    """Return the error of inverse and forward network in series by the part of the cycle, if it is known."""
    errors = inverse.get("round_trip_regime_nrmse") or {}
    parts = [f"{percent(errors[key])} {words}" for key, words in statements.PARTS.items() if key in errors]
    return f" ({listed(parts)})" if parts else ""


def _errors_per_test(loop: Mapping[str, Any]) -> Any:
    from mrpipe.reporting.bench_tracing import errors_per_test

    return errors_per_test(loop["tests"], loop["noise_floor_nrmse"])


def damper(facts: RunFacts) -> Section:
    """Return the damper model: parameters, effects, loops, and the residual over what explains it."""
    section = Section("damper", "Damper")
    summary, loop = facts.summary("identify-damper"), facts.summary("close-loop")
    if "parameters" in summary:
        section.text(
            f"Model {summary['form']}: error {percent(summary['validation_nrmse'])} on the validation tests, "
            f"{percent(summary['training_nrmse'])} on the training tests; {_largest_drive(summary)}."
        )
        section.table("parameters", tables.parameters(summary["parameters"]), "Parameters with standard errors (SI).")
    if _of_structure(loop):
        return section
    _traced_effects(section, loop)
    _traced_model(section, facts, loop)
    shown = _shown_tests(facts)
    if shown:
        section.figure(
            "loops",
            figures.loops(shown),
            "Validation tests: the largest improvement, a medium error, the largest error after; a test may be two of "
            "these. The models run freely, without the measured force.",
        )
    artifact = facts.artifact("close-loop.h5")
    if artifact is not None and "validation" in artifact.members("/"):
        variables, before, after = _residual(artifact)
        section.figure(
            "residual",
            figures.residual_over(variables, before, after),
            "Residual of the validation tests over the variables that may explain it: mean and middle 80 %.",
        )
    return section


def _largest_drive(summary: Mapping[str, Any]) -> str:
    """Return the largest drive of the identified damper in words; without a drive, its limit is a placeholder."""
    if summary.get("without_drive"):
        return "all tests without drive"
    return f"drive up to {quantity(summary['drive_limit'], summary['drive_unit'])}"


def _of_structure(loop: Mapping[str, Any]) -> bool:
    """Return whether `close-loop` traced a structure; its result names the parts that it judged."""
    return bool(loop.get("parts"))


def _traced_effects(section: Section, loop: Mapping[str, Any]) -> None:
    """Add the effects that the model lacks, and how much each candidate recovers."""
    effects = proper_effects(loop)
    for effect in effects:
        section.text(f"**{effect['name']}** (form {effect.get('form', '')}). {effect.get('physics', '')}")
        first = next((item.get("form") for item in loop.get("candidates", []) if item["name"] == effect["name"]), None)
        if first and effect.get("form") and first != effect["form"]:
            section.text(
                f"Among the candidates {effect['name']} stands with its best single form, {first}. Once it was named, "
                f"all its forms were fitted again, and {effect['form']} did better."
            )
    section.table("effects", tables.effects(effects), "Effects that the model lacks, with 95 % intervals.")
    if loop.get("candidates"):
        section.figure(
            "candidates",
            figures.candidate_shares(shown_candidates(loop), [item["name"] for item in effects], shares_in_words(loop)),
            f"Share {shares_in_words(loop)} that each effect recovers alone; named effects in blue."
            + not_alone_in_words(loop),
        )


def _traced_model(section: Section, facts: RunFacts, loop: Mapping[str, Any]) -> None:
    """Add the parameters of the damper with the traced effects, whose base form may be another than the declared."""
    artifact = facts.artifact("close-loop.h5")
    if artifact is None or "damper" not in artifact.members("/"):
        return
    try:
        model = read_damper(artifact)
    except UserError as error:
        # the file of an own effect was moved or changed: the other results do not depend on it
        section.text(f"The parameters of the final model cannot be shown: {error}")
        return
    for text in notes_on_model(loop, named=bool(proper_effects(loop))):
        section.text(text)
    section.table(
        "traced",
        tables.traced_parameters(model),
        f"Parameters of the final model of close-loop, base form {model.form} (damper-traced.h5; SI).",
    )


def _residual(artifact: Artifact) -> tuple[list[tuple[str, Any]], Any, Any]:
    """Return the variables, and the residual before and after, of the validation tests."""
    measured = artifact.array("validation/measured")
    drive = artifact.array("validation/drive")
    variables = [
        ("displacement [mm]", 1e3 * artifact.array("validation/displacement")),
        ("velocity [mm/s]", 1e3 * artifact.array("validation/velocity")),
    ]
    if float(np.ptp(drive)) > 0.0:
        variables.append((f"drive [{artifact.unit('validation/drive')}]", drive))
    variables.append(("time in test [s]", artifact.array("validation/time")))
    return variables, measured - artifact.array("validation/before"), measured - artifact.array("validation/after")


def _shown_tests(facts: RunFacts) -> list[TestRun]:
    """Return the validation tests to draw: largest improvement, medium error, largest error after; two cycles each."""
    artifact, loop = facts.artifact("close-loop.h5"), facts.summary("close-loop")
    if artifact is None or not loop.get("tests") or "names" not in artifact.members("validation"):
        return []
    names, starts = artifact.json("validation/names"), artifact.array("validation/starts").astype(int)
    rows = {row["name"]: row for row in loop["tests"] if row["name"] in names}
    if not rows:
        return []
    gains = sorted(rows, key=lambda name: rows[name]["nrmse_after"] - rows[name]["nrmse_before"])
    left = sorted(rows, key=lambda name: rows[name]["nrmse_after"])
    chosen = list(dict.fromkeys([gains[0], left[len(left) // 2], left[-1]]))
    return [_test_run(artifact, name, names.index(name), starts) for name in chosen]


def _test_run(artifact: Artifact, name: str, index: int, starts: Any) -> TestRun:
    piece = slice(int(starts[index]), int(starts[index + 1]))
    displacement = artifact.array("validation/displacement")[piece]
    centred = displacement - np.mean(displacement)
    ups = np.flatnonzero((centred[:-1] <= 0.0) & (centred[1:] > 0.0))
    middle = len(ups) // 2
    first, last = (int(ups[middle - 1]), int(ups[middle + 1])) if 0 < middle < len(ups) - 1 else (0, len(displacement))
    rows = np.arange(first, last)[:: max(1, (last - first) // _POINTS_OF_A_LOOP)]
    channels = {
        key: artifact.array(f"validation/{key}")[piece][rows]
        for key in ("displacement", "velocity", "drive", "time", "measured", "before", "after")
    }
    return TestRun(name, **channels)


def structure(facts: RunFacts) -> Section:
    """Return the structure: modes, mode shapes on the frame, frequency response, storey stiffnesses."""
    section = Section("structure", "Structure")
    summary = facts.summary("identify-frame")
    if "frequencies_hz" not in summary:
        return section
    section.text(statements.structure(facts))
    modes = pd.DataFrame(_mode_rows(summary))
    if any(high > low for low, high in summary["frequency_intervals_hz"]):
        section.table("modes", modes, "Modes with 95 % intervals.")
    else:
        section.table("modes", modes[["mode", "frequency [Hz]", "damping ratio [%]"]], "Modes of the given structure.")
    shapes = np.asarray(summary["mode_shapes"], dtype=np.float64)
    names = names_of(summary)
    frequencies = summary["frequencies_hz"]
    if is_chain(names):
        drawn = figures.shapes_on_frame(shapes, frequencies, summary["damping_ratios"])
        section.figure("shapes", drawn, "Mode shapes drawn on the frame.")
    else:
        section.figure("shapes", modal.mode_shapes(shapes, frequencies, names=names), modal.shapes_caption(names))
    stiffness, intervals = summary.get("storey_stiffnesses_n_m"), summary.get("storey_stiffness_intervals_n_m")
    if stiffness:
        storeys = [
            {
                "storey": storey + 1,
                "stiffness [kN/m]": number(1e-3 * value, 4),
                "± [kN/m]": number(0.5e-3 * (intervals[storey][1] - intervals[storey][0]), 2) if intervals else "-",
            }
            for storey, value in enumerate(stiffness)
        ]
        section.table("storeys", pd.DataFrame(storeys), "Stiffness of each storey with its 95 % interval.")
    artifact = facts.artifact("frame.h5")
    if artifact is not None and "responses" in artifact.members("/"):
        frequency = artifact.array("responses/frequency")
        step = slice(None, None, max(1, len(frequency) // _POINTS_OF_A_CURVE))
        curves = [
            artifact.array(f"responses/{kind}_real")[step, -1]
            + 1j * artifact.array(f"responses/{kind}_imaginary")[step, -1]
            for kind in ("measured", "synthesised")
        ]
        section.figure(
            "response",
            figures.frequency_response(frequency[step], curves[0], curves[1], shapes.shape[0]),
            "Frequency response of the top floor.",
        )
    if _of_structure(facts.summary("close-loop")):
        _traced_effects(section, facts.summary("close-loop"))
    return section


def _mode_rows(summary: Mapping[str, Any]) -> list[dict[str, Any]]:
    rows = []
    for mode, frequency in enumerate(summary["frequencies_hz"]):
        low, high = summary["frequency_intervals_hz"][mode]
        damped = summary["damping_ratio_intervals"][mode]
        row = {
            "mode": mode + 1,
            "frequency [Hz]": number(frequency, 4),
            "± [Hz]": number(0.5 * (high - low), 2),
            "damping ratio [%]": number(100.0 * summary["damping_ratios"][mode]),
            "from [%]": number(100.0 * damped[0]),
            "to [%]": number(100.0 * damped[1]),
        }
        # without matrices the shapes can only be compared with themselves
        if summary.get("stiffness") is not None:
            row["MAC of the model"] = number(summary["mac"][mode], 4)
        rows.append(row)
    return rows


def control(facts: RunFacts) -> Section:
    """Return one comparison of all laws, their last cycles, and prediction against measurement."""
    section = Section("control", "Control")
    together, each = several_dampers.answer(facts), several_dampers.rows(facts)
    if together:
        section.text(together)
    if each:
        section.table(
            "dampers",
            pd.DataFrame(each),
            "Each damper in the simulation: gains of its law, stroke, force, and RMS difference between force and "
            "command over the RMS command.",
        )
    runs = law_facts.comparison(facts)
    loop = facts.summary("close-loop").get("closed_loop") or {}
    if runs:
        section.text(law_facts.answer(facts))
        section.table(
            "laws",
            tables.laws(facts, runs),
            "All laws under the same base motion: RMS displacement relative to the ground (change: compared with no "
            "damper), RMS absolute acceleration, largest damper force, damping ratio in free decay, and share of the "
            "time in which the damper model is extrapolated.",
        )
        section.text("; ".join(f"`{law}`: {meaning}" for law, meaning in law_facts.meanings(facts.laws).items()) + ".")
        histories: dict[str, law_facts.History] = {}
        for run in runs:
            artifact = facts.artifact(f"response-{run.law}.h5")
            if artifact is not None and len(histories) < 6:
                histories[run.law] = law_facts.last_cycles(facts, artifact, facts.laws[run.law])
        section.figure("cycles", figures.last_cycles(histories), _caption_of_cycles(len(histories), len(facts.laws)))
    measured = [item for item in loop.get("laws", []) if item.get("measured")]
    if "over_band" in loop:
        section.text("What the traced damper changes in the closed loop:")
        section.points(in_points(loop))
    if measured:
        section.figure(
            "measured",
            figures.measured_and_predicted(loop),
            "Closed loop: recorded, and predicted before and after the effect is added.",
        )
    return section


def _caption_of_cycles(shown: int, laws: int) -> str:
    first = f" (the {shown} laws of smallest response)" if shown < laws else ""
    return f"The last three cycles under each law{first}: top floor, damper force over time and over stroke."


def next_steps(facts: RunFacts) -> Section:
    """Return what to test and to repair next, and which files to use."""
    section = Section("next", "Next steps")
    loop = facts.summary("close-loop")
    if text := statements.next_tests(facts):
        section.text(text)
    wanted = loop.get("next_tests") or {}
    if wanted.get("tests"):
        caption = f"Tests that would decide what is open ({wanted['file']})."
        section.table("tests", tables.wanted_tests(wanted["tests"]), caption)
    remedies = [f"{effect['name']}: {effect['remedy']}" for effect in proper_effects(loop) if effect.get("remedy")]
    if remedies:
        section.text("On the rig:")
        section.points(remedies)
    if (loop.get("corrections") or {}).get("found"):
        file = shell_word(shortest(facts.directory / loop["corrections"]["file"]))
        section.text(
            f"Faults of sensors were found. `mrpipe run --settings {file}`, with the same configuration or campaign, "
            "removes them from the recordings and repeats the analysis."
        )
    files = [f"`{file}`: {use}" for file, use in _FILES if (facts.directory / file).exists()]
    if files:
        section.text("Files of the run for further work:")
        section.points(files)
    return section


_FILES: tuple[tuple[str, str], ...] = (
    ("damper-traced.h5", "damper model with the traced effects"),
    ("damper.h5", "damper model, parameters with covariance"),
    ("forward.h5", "forward network: motion and drive to force"),
    ("inverse.h5", "inverse network: motion and force to drive"),
    ("frame.h5", "mass, damping, stiffness and modes"),
    ("control.h5", "gains of every law"),
    ("close-loop.json", "the verdict, for programs"),
    ("controller", "controller as C code"),
)
