"""Exported models reproduce Python on the test vectors that are exported with them."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from mrpipe.dampers.model import Addition, DamperModel
from mrpipe.dampers.plant import FORCE, STEP_SIGNATURE, VELOCITY, Phase, Step
from mrpipe.effects.library import damper_effects, load_effect_file
from mrpipe.errors import UserError
from mrpipe.exports.contract import DOUBLE_LIMIT, Subject
from mrpipe.exports.damper import damper_subject
from mrpipe.exports.frame import frame_subject
from mrpipe.exports.library import formats_of, write_export
from mrpipe.exports.network import network_subject
from mrpipe.exports.translation.c import c_functions
from mrpipe.exports.translation.routines import routines_of
from mrpipe.structures import floor_position, frame_from_parameter_set
from tests.control.conftest import random_network
from tests.dampers.test_forms import NUMBERS, SCALES, model
from tests.exports.building import self_test


def with_effect(effect: str, form: str) -> DamperModel:
    found = damper_effects()[effect]
    shape = found.form(form)
    values = {p.name: p.start_values(SCALES)[0] or 0.3 * SCALES.of(p.scale) for p in shape.parameters}
    return replace(model("bouc-wen"), effects=(Addition(effect, form, values, {}, found.sensor, shape.steps),))


def dampers() -> dict[str, DamperModel]:
    """Every base form, one form of every effect (all of them take minutes of compilation), and an effect file."""
    found = {name: model(name) for name in NUMBERS}
    for effect in damper_effects().values():
        if not effect.sensor:
            found[effect.name] = with_effect(effect.name, effect.forms[-1].name)
    return {**found, "own-file": with_own_effect()}


def with_own_effect() -> DamperModel:
    """A damper with the effect file of the documentation."""
    file = Path(__file__).parents[2] / "docs" / "examples" / "seal_squeeze.py"
    effect = load_effect_file(file)
    form = effect.forms[0]
    values = {p.name: 0.3 * p.start_values(SCALES)[0] for p in form.parameters}
    own = Addition(effect.name, form.name, values, {}, effect.sensor, form.steps, str(file))
    return replace(model("bouc-wen"), effects=(own,))


def networks() -> dict[str, Subject]:
    return {
        "forward": network_subject(random_network(("displacement", "velocity"), "force", 5, False), "forward"),
        "inverse": network_subject(
            random_network(("velocity", "force"), "drive", 3, True), "inverse", "rig", drive_unit="V"
        ),
    }


def frame() -> Subject:
    thesis = frame_from_parameter_set("thesis")
    return frame_subject(thesis, floor_position(thesis.floors, 1))


@pytest.mark.oracle
def test_every_form_and_effect_in_c_equals_python(tmp_path: Path) -> None:
    # one program for all dampers, because each start of the compiler costs more than the code
    sources = []
    for number, (name, damper) in enumerate(dampers().items()):
        subject = damper_subject(damper, f"d{number}", "t")
        assert np.ptp(subject.vectors.outputs[0].values) > 0.0
        write_export(subject, tmp_path / name, ["c"])
        test = (tmp_path / name / "self_test.c").read_text().replace("int main(void)", f"int test_{number}(void)")
        (tmp_path / name / "self_test.c").write_text(test)
        sources += [f"{name}/d{number}.c", f"{name}/self_test.c"]
    names = list(dampers())
    calls = "".join(f'    if (test_{k}()) {{ printf("{name}\\n"); return 1; }}\n' for k, name in enumerate(names))
    declared = "".join(f"int test_{k}(void);\n" for k in range(len(names)))
    (tmp_path / "all.c").write_text(f"#include <stdio.h>\n{declared}int main(void)\n{{\n{calls}    return 0;\n}}\n")
    from tests.exports.building import STRICT, compiler

    flags = [flag for flag in STRICT if flag != "-O1"]
    subprocess.run([compiler(), *flags, "all.c", *sources, "-o", "all", "-lm"], cwd=tmp_path, check=True)
    done = subprocess.run([str(tmp_path / "all")], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("largest deviation") == len(names)


@pytest.mark.oracle
@pytest.mark.parametrize("subject", [*networks().values(), frame(), damper_subject(with_effect("remanence", "fading"))])
def test_c_in_both_precisions_equals_python(subject: Subject, tmp_path: Path) -> None:
    write_export(subject, tmp_path, ["c"])
    self_test(tmp_path, subject.name, subject.prefix.upper())


@pytest.mark.oracle
@pytest.mark.parametrize("subject", networks().values(), ids=networks())
def test_onnx_equals_python(subject: Subject, tmp_path: Path) -> None:
    runtime = pytest.importorskip("onnxruntime", reason="needs onnxruntime")
    write_export(subject, tmp_path, ["onnx"])
    session = runtime.InferenceSession(str(tmp_path / f"{subject.name}.onnx"), providers=["CPUExecutionProvider"])
    found = session.run(None, {"features": subject.vectors.input_table})[0]
    expected = subject.vectors.output_table
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=DOUBLE_LIMIT * np.max(np.abs(expected)))


@pytest.mark.oracle
def test_matlab_functions_equal_python(tmp_path: Path) -> None:
    octave = shutil.which("octave-cli")
    if octave is None:
        pytest.skip("GNU Octave is not installed")
    chosen = ("modified-bouc-wen", "gamota-filisko", "creeping-yield", "backlash", "delay", "stribeck")
    subjects = {name: damper_subject(dampers()[name]) for name in chosen}
    subjects |= {**networks(), "frame": frame()}
    lines = []
    for name, subject in subjects.items():
        write_export(subject, tmp_path / name, ["matlab"])
        lines.append(f"cd('{tmp_path / name}'); clear all; self_test();")
    (tmp_path / "all.m").write_text("\n".join(lines))
    done = subprocess.run([octave, "-q", str(tmp_path / "all.m")], capture_output=True, text=True)
    assert done.stdout.count("largest deviation") == len(subjects), done.stdout + done.stderr


@pytest.mark.property
def test_data_of_matlab_and_json_are_those_of_the_model(tmp_path: Path) -> None:
    from scipy.io import loadmat

    subject = networks()["inverse"]
    files = write_export(subject, tmp_path, ["json", "matlab"])
    assert {"inverse.json", "rig_inverse.m", "rig_inverse.mat", "self_test.m", "vectors.csv", "README.md"} == set(files)
    matlab = loadmat(tmp_path / "rig_inverse.mat", squeeze_me=True, struct_as_record=False)
    for place, matrix in enumerate(subject.model.weights):
        np.testing.assert_array_equal(np.reshape(matlab["weights"][place], matrix.shape), matrix)
    np.testing.assert_array_equal(matlab["vectors"].inputs, subject.vectors.input_table)
    content = json.loads((tmp_path / "inverse.json").read_text())
    assert content["model"]["weights"] == [matrix.tolist() for matrix in subject.model.weights]
    assert content["vectors"]["outputs"][0] == {
        "name": "drive", "unit": "V", "values": subject.vectors.outputs[0].values.tolist(),
    }  # fmt: skip
    with (tmp_path / "vectors.csv").open(newline="") as handle:
        header, *rows = csv.reader(handle)
    assert header[-1] == "drive [V]"
    np.testing.assert_array_equal(
        np.array(rows, dtype=float), np.hstack([subject.vectors.input_table, subject.vectors.output_table])
    )


@pytest.mark.property
def test_json_of_a_damper_holds_all_its_numbers(tmp_path: Path) -> None:
    damper = with_effect("heating", "cooling")
    write_export(damper_subject(damper, source="run"), tmp_path, ["json"])
    content = json.loads((tmp_path / "damper.json").read_text())
    assert content["source"] == "run"
    assert {k: v["value"] for k, v in content["model"]["parameters"].items()} == dict(damper.parameters)
    assert content["model"]["effects"][0]["name"] == "heating"
    assert [step["name"] for step in content["model"]["steps"]] == list(damper.chain().names)


@pytest.mark.property
def test_the_readme_of_a_damper_says_which_damper_it_is(tmp_path: Path) -> None:
    sensor = Addition("channel-skew", "shift", {}, {}, True, lambda _: [])
    damper = with_effect("heating", "cooling")
    traced = replace(damper, effects=(*damper.effects, sensor))
    write_export(damper_subject(traced, source="traced"), tmp_path, ["json"])
    text = (tmp_path / "README.md").read_text()
    assert "The traced damper of `close-loop` (`--damper traced`): base form `bouc-wen`" in text
    assert "with `heating` (form cooling). Faults of sensors, which do not change the force: `channel-skew`." in text
    write_export(damper_subject(model("dahl"), source="identified"), tmp_path, ["json"])
    text = (tmp_path / "README.md").read_text()
    assert "The identified damper of `identify-damper`: base form `dahl`" in text and "without effects" in text


@pytest.mark.property
def test_files_of_an_earlier_export_do_not_stay_beside_a_new_one(tmp_path: Path) -> None:
    subject = networks()["forward"]
    write_export(subject, tmp_path, ["c", "json"])
    (tmp_path / "notes.txt").write_text("of the user")
    write_export(replace(subject, prefix="other"), tmp_path, ["matlab"])
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"other.m", "other.mat", "self_test.m", "vectors.csv", "README.md", "notes.txt"}


@pytest.mark.property
def test_a_format_that_a_model_does_not_have_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="is not a format of a frame"):
        write_export(frame(), tmp_path, ["onnx"])
    assert set(formats_of("network")) == {"c", "json", "matlab", "onnx"}
    assert set(formats_of("damper")) == set(formats_of("frame")) == {"c", "json", "matlab"}


@njit(STEP_SIGNATURE)
def sorting_step(wire, state, parameters, dt):
    wire[FORCE] += sorted([wire[VELOCITY], dt])[0]


@njit
def helper(values, start, step):
    total = 0.0
    for k in range(len(values) - 1, start, -step):
        total += values[k]
    return total


@pytest.mark.property
def test_what_has_no_translation_is_refused_with_its_line(tmp_path: Path) -> None:
    step = Step("sorting", Phase.FORCE_EFFECT, sorting_step, np.zeros(0))
    own = Addition("own", "sorted", {}, {}, False, lambda _: [step])
    subject = damper_subject(replace(model("bouc-wen"), effects=(own,)))
    with pytest.raises(UserError, match=r"sorting_step, line \d+: .*sorted.* cannot be translated"):
        write_export(subject, tmp_path / "own", ["c"])
    assert not (tmp_path / "own").exists()
    with pytest.raises(UserError, match="len"):
        c_functions(routines_of([helper]))
