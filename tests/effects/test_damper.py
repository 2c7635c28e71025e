"""A damper with effects: its chain, its artifact, and its force at constant speed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.dampers.model import Addition, DamperModel, write_damper
from mrpipe.dampers.model import read_damper as read_plain
from mrpipe.effects.damper import damper_named, read_damper
from mrpipe.effects.library import damper_effects
from mrpipe.errors import UserError

BASE = {"yield_force_a": 40.0, "yield_force_b": 30.0, "c0_a": 60.0, "yield_displacement": 4e-4, "eta": 80.0}


def added(name: str, form: str, **values: float) -> Addition:
    effect = damper_effects()[name]
    shape = effect.form(form)
    given = {item.name: values.get(item.name, 0.0) for item in shape.parameters}
    units = {item.name: item.unit for item in shape.parameters}
    return Addition(name, form, given, units, effect.sensor, shape.steps)


def damper() -> DamperModel:
    inertia = added("inertia", damper_effects()["inertia"].forms[0].name, mass=1.5)
    return DamperModel("bouc-wen", BASE, "A", drive_limit=2.0, effects=(inertia,), stroke_m=0.02)


def motion() -> tuple[np.ndarray, ...]:
    t = np.arange(0.0, 1.0, 1e-3)
    return 0.01 * np.sin(9 * t), 0.09 * np.cos(9 * t), -0.81 * np.sin(9 * t), 1.0 + np.sin(5 * t)


def write(model: DamperModel, path: Path) -> Artifact:
    with ArtifactWriter.create(path, Provenance("close-loop")) as artifact:
        write_damper(artifact, model)
    return Artifact(path)


@pytest.mark.property
def test_an_effect_adds_its_force() -> None:
    x, v, a, u = motion()
    plain = DamperModel("bouc-wen", BASE, "A", drive_limit=2.0)
    np.testing.assert_allclose(damper().force(x, v, a, u, 1e-3) - plain.force(x, v, a, u, 1e-3), 1.5 * a, atol=1e-9)


@pytest.mark.golden
@pytest.mark.parametrize("unit", ["A", "V"])
def test_units_of_effects_name_the_drive_of_the_damper(tmp_path: Path, unit: str) -> None:
    """The report and the exported JSON had `N/drive` for the friction rate of a damper in volts."""
    friction = added("stribeck", "own-friction", friction=1.0, friction_rate=2.0)
    model = DamperModel("bouc-wen", BASE, unit, drive_limit=2.0, effects=(friction,))
    (effect,) = read_damper(write(model, tmp_path / "damper-traced.h5")).effects
    assert effect.units["friction_rate"] == f"N/{unit}"


@pytest.mark.property
def test_it_survives_its_artifact(tmp_path: Path) -> None:
    model = damper()
    again = read_damper(write(model, tmp_path / "damper-traced.h5"))
    assert again == model
    x, v, a, u = motion()
    np.testing.assert_array_equal(again.force(x, v, a, u, 1e-3), model.force(x, v, a, u, 1e-3))
    with pytest.raises(ValueError, match="has effects"):
        read_plain(Artifact(tmp_path / "damper-traced.h5"))


@pytest.mark.property
def test_a_saturating_law_survives_its_artifact(tmp_path: Path) -> None:
    numbers = {**BASE, "yield_force_saturating": 80.0, "yield_force_scale": 0.7}
    numbers.pop("yield_force_b")
    model = DamperModel("bouc-wen", numbers, "A", drive_limit=2.0, laws={"yield_force": "tanh"})
    again = read_damper(write(model, tmp_path / "damper.h5"))
    assert again == model
    assert again.unit("yield_force_scale") == "A"
    assert again.unit("yield_force_saturating") == "N"
    drive = np.linspace(0.0, 2.0, 5)
    np.testing.assert_allclose(again.yield_force(drive), 40.0 + 80.0 * np.tanh(drive / 0.7))
    x, v, a, u = motion()
    held = again.force(x, v, a, 0 * u + 1.3, 1e-3)
    polynomial = DamperModel(
        "bouc-wen", {**BASE, "yield_force_a": float(again.yield_force(1.3)), "yield_force_b": 0.0}, "A"
    )
    np.testing.assert_allclose(held, polynomial.force(x, v, a, 0 * u + 1.3, 1e-3), rtol=1e-9)


@pytest.mark.property
def test_a_fault_of_sensors_is_no_part_of_the_damper() -> None:
    effect = next(item for item in damper_effects().values() if item.sensor)
    form = effect.forms[0]
    fault = added(effect.name, form.name, **{item.name: 1e-3 for item in form.parameters})
    model = DamperModel("bouc-wen", BASE, "A", drive_limit=2.0, effects=(fault,))
    assert model.chain().names == DamperModel("bouc-wen", BASE, "A").chain().names


@pytest.mark.property
def test_the_force_at_constant_speed_is_simulated_with_effects() -> None:
    model, plain = damper(), DamperModel("bouc-wen", BASE, "A", drive_limit=2.0)
    speed, drive = np.array([0.02, 0.1, -0.1])[:, None], np.array([0.0, 1.0, 2.0])
    # inertia gives no force at constant speed
    np.testing.assert_allclose(
        model.quasi_static_force(speed, drive), plain.quasi_static_force(speed, drive), rtol=0.02
    )


@pytest.mark.property
def test_a_setting_names_a_damper(tmp_path: Path) -> None:
    artifact = write(damper(), tmp_path / "damper-traced.h5")
    assert damper_named("traced", {"traced": lambda: artifact}) == damper()
    assert damper_named(str(tmp_path / "damper-traced.h5"), {}) == damper()
    assert damper_named("set-c", {}).form == "bouc-wen"
    # the file is named in full, and so are the settings that can be wrong
    with pytest.raises(
        UserError, match=rf"{tmp_path / 'none.h5'}.*no such artifact.*calibrate.damper or simulate.damper"
    ):
        damper_named(str(tmp_path / "none.h5"), {})
