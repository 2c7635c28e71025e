"""Damper models, the sets that come with the program, and what the thesis prints of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance, load_parameter_set
from mrpipe.dampers.model import (
    DamperModel,
    damper_from_parameter_set,
    parameter_unit,
    read_damper,
    thesis_parameters,
    write_damper,
)
from mrpipe.errors import UserError
from mrpipe.units import conversion

SETS = ("set-c", "thesis-printed", "p4-1000kn", "bingham-1000kn")


def damper(name: str) -> DamperModel:
    return damper_from_parameter_set(load_parameter_set("dampers", name))


def peak_force(model: DamperModel, amplitude: float, frequency: float, drive: float) -> float:
    times = np.arange(0.0, 3.0 / frequency, 1e-3)
    omega = 2 * np.pi * frequency
    displacement = amplitude * np.sin(omega * times)
    velocity = amplitude * omega * np.cos(omega * times)
    force = model.force(displacement, velocity, -(omega**2) * displacement, np.full_like(times, drive), 1e-3)
    return float(np.abs(force[len(force) // 2 :]).max())


def peaks(model: DamperModel, drive: float) -> list[float]:
    return [peak_force(model, amplitude, frequency, drive) for amplitude in (5e-3, 10e-3) for frequency in (0.5, 2.2)]


@pytest.mark.literature
@pytest.mark.parametrize(
    ("current", "low", "high"), [(0, 23, 29), (1, 50, 65), (2, 109, 134), (3, 189, 223), (4, 277, 320)]
)
def test_set_c_gives_the_forces_of_errata_section_c(current, low, high):
    found = peaks(damper("set-c"), float(current))
    assert min(found) == pytest.approx(low, abs=0.5)
    assert max(found) == pytest.approx(high, abs=0.6)


@pytest.mark.literature
def test_printed_parameters_do_not_give_the_printed_forces_errata_row_1():
    model = damper("thesis-printed")
    z_max = model.parameters["yield_displacement"] * 1000.0
    assert z_max == pytest.approx(1.104, abs=5e-4)
    at_rest, full = peaks(model, 0.0), peaks(model, 4.0)
    assert min(at_rest) == pytest.approx(4.6, abs=0.05)
    assert max(at_rest) == pytest.approx(5.8, abs=0.05)
    assert min(full) == pytest.approx(109, abs=0.5)
    assert max(full) == pytest.approx(160, abs=0.5)


@pytest.mark.literature
def test_set_c_yields_at_a_third_of_a_millimetre():
    assert damper("set-c").parameters["yield_displacement"] == pytest.approx(0.37e-3, abs=0.005e-3)


@pytest.mark.literature
def test_bingham_follows_equation_6_1_in_volts():
    model = damper("bingham-1000kn")
    assert model.drive_unit == "V"
    expected = (100e3 + 75e3 * 6.0) + (81e3 + 90e3 * 6.0) * 0.3
    velocity = np.array([0.3, -0.3])
    force = model.force(np.zeros(2), velocity, np.zeros(2), np.full(2, 6.0), 1e-3)
    np.testing.assert_allclose(force, [expected, -expected], rtol=1e-12)
    np.testing.assert_allclose(model.quasi_static_force(velocity, 6.0), force, rtol=1e-12)


@pytest.mark.literature
def test_the_1000_kn_damper_reaches_its_name_at_full_voltage():
    # P4: 1000 kN, saturation at 10 V; at a few centimetres per second
    assert float(damper("p4-1000kn").quasi_static_force(0.1, 10.0)) == pytest.approx(1.0e6, rel=0.1)


@pytest.mark.property
@pytest.mark.parametrize("name", SETS)
def test_post_yield_force_is_what_the_chain_settles_at(name):
    model = damper(name)
    speed = 0.2 if model.drive_unit == "V" else 0.05
    times = np.arange(0.0, 1.0, 1e-3)
    drive = np.full_like(times, 0.7 * model.drive_limit)
    force = model.force(speed * times, np.full_like(times, speed), 0 * times, drive, 1e-3)
    springs = model.parameters.get("k0", 0.0) * speed + model.parameters.get("k1", 0.0)
    settled = float(model.quasi_static_force(speed, drive[-1]))
    assert force[-1] == pytest.approx(settled, abs=2.0 * springs + 1e-6 * settled)


@pytest.mark.property
@pytest.mark.parametrize("name", ["set-c", "thesis-printed", "p4-1000kn"])
def test_the_thesis_notation_comes_back(name):
    given = load_parameter_set("dampers", name)
    found = thesis_parameters(damper_from_parameter_set(given), given.scalar("A"))
    for key in ("alpha_a", "alpha_b", "gamma", "beta", "A", "n"):
        assert found[key] == pytest.approx(given.scalar(key), rel=1e-12)


@pytest.mark.property
def test_another_reference_describes_the_same_damper():
    model = damper("set-c")
    rescaled = thesis_parameters(model, 500.0)
    z_max = (500.0 / (rescaled["gamma"] + rescaled["beta"])) ** 0.5
    assert rescaled["alpha_a"] * z_max == pytest.approx(model.parameters["yield_force_a"], rel=1e-12)
    assert z_max / 500.0 == pytest.approx(model.parameters["yield_displacement"], rel=1e-12)


@pytest.mark.property
@pytest.mark.parametrize("name", SETS)
def test_models_survive_their_artifact_bit_for_bit(tmp_path: Path, name):
    model = damper(name)
    with ArtifactWriter.create(tmp_path / "damper.h5", Provenance("identify-damper")) as artifact:
        write_damper(artifact, model)
    assert read_damper(Artifact(tmp_path / "damper.h5")) == model


@pytest.mark.property
@pytest.mark.parametrize("name", SETS)
def test_every_parameter_has_a_unit_that_parses(name):
    model = damper(name)
    for parameter in model.parameters:
        assert conversion(parameter_unit(parameter, model.drive_unit)) == 1.0


def parameter_file(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "mine.yaml"
    path.write_text("name: mine\nsource: test\n" + text, encoding="utf-8")
    return path


@pytest.mark.property
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("model: bouc-wenn\nparameters:\n  drive_limit: {value: 4, unit: A}\n", "'bouc-wenn' is not a base form"),
        ("model: bouc-wen\nparameters:\n  A: {value: 4, unit: '1'}\n", "no drive_limit"),
        (
            "model: bouc-wen\nparameters:\n  A: {value: 4, unit: '1'}\n  drive_limit: {value: 4, unit: A}\n",
            "no gamma",
        ),
    ],
)
def test_a_faulty_set_is_told_in_one_line(tmp_path: Path, text, message):
    with pytest.raises(UserError, match=message) as caught:
        damper_from_parameter_set(load_parameter_set("dampers", parameter_file(tmp_path, text)))
    assert "\n" not in str(caught.value)


@pytest.mark.property
def test_forms_that_round_agree_with_their_post_yield_force():
    common = {"yield_displacement": 1e-4, "yield_force_a": 50.0, "yield_force_b": 20.0, "c0_a": 30.0}
    models = [
        DamperModel("rounded-yield", {**common, "rounded_force_a": 25.0, "velocity_scale": 0.02}, "A"),
        DamperModel("power-yield", {**common, "reference_velocity": 0.1, "velocity_exponent": 0.2}, "A"),
        DamperModel("saturating-dashpot", {**common, "spring_rate": 4000.0, "velocity_scale": 0.03}, "A"),
        DamperModel("dahl", common, "A"),
        DamperModel("bingham", {**common, "transition_velocity": 0.01}, "A"),
    ]
    times = np.arange(0.0, 1.0, 1e-3)
    for model in models:
        force = model.force(0.05 * times, 0 * times + 0.05, 0 * times, 0 * times + 1.5, 1e-3)
        assert force[-1] == pytest.approx(float(model.quasi_static_force(0.05, 1.5)), rel=1e-6)


@pytest.mark.property
def test_signals_of_other_lengths_are_refused_and_numbers_are_constants() -> None:
    """The compiled loop had read beyond the end of the shorter one: arbitrary forces, or NaN for a number."""
    model = damper("set-c")
    times = np.arange(0.0, 1.0, 1e-3)
    x, v = 0.01 * np.sin(6.0 * times), 0.06 * np.cos(6.0 * times)
    full = model.force(x, v, np.zeros_like(x), np.full_like(x, 2.0), 1e-3)
    np.testing.assert_array_equal(model.force(x, v, 0.0, 2.0, 1e-3), full)
    with pytest.raises(UserError, match=r"force: drive: has the shape \(999,\), another signal has 1000 samples"):
        model.force(x, v, np.zeros_like(x), np.full(999, 2.0), 1e-3)
    with pytest.raises(UserError, match="force: displacement: has the shape"):
        model.force(x[:5], v, np.zeros_like(x), 2.0, 1e-3)
    for dt in (0.0, -1e-3, float("nan")):
        with pytest.raises(UserError, match="a sampling interval above 0 s expected"):
            model.force(x, v, np.zeros_like(x), 2.0, dt)
