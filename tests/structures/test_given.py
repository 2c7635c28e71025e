"""Structures from matrices, storey tables and modes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrpipe.errors import UserError
from mrpipe.structures import natural_modes, shear_frame
from mrpipe.structures.given import degree_of_freedom, device_position, structure_from_settings
from mrpipe.structures.options import MatrixEntry, Storey, StructureSettings

FRAME = shear_frame([2.0, 3.0, 1.0], [500.0, 400.0, 300.0], 0.02)


def reader(content: dict[str, Any]):  # type: ignore[no-untyped-def]
    return lambda path, name: content[name]


def settings(**changes: Any) -> StructureSettings:
    given: dict[str, Any] = {"file": "model.mat", "damping": MatrixEntry(name="C")}
    return StructureSettings(**{**given, **changes})


CONTENT = {"M": FRAME.mass, "K": FRAME.stiffness, "C": FRAME.damping}


@pytest.mark.property
def test_matrices_with_units() -> None:
    frame = structure_from_settings(
        settings(
            mass=MatrixEntry(name="M", unit="t"),
            stiffness=MatrixEntry(name="K", unit="kN/m"),
            damping=MatrixEntry(name="C", unit="kN*s/m"),
        ),
        reader({name: values / 1000.0 for name, values in CONTENT.items()}),
    )
    np.testing.assert_allclose(frame.mass, FRAME.mass)
    np.testing.assert_allclose(frame.stiffness, FRAME.stiffness)
    np.testing.assert_allclose(frame.damping, FRAME.damping)
    np.testing.assert_array_equal(frame.ground_influence, np.ones(3))


@pytest.mark.property
def test_lumped_masses_and_modal_damping() -> None:
    content = {"M": np.diag(FRAME.mass)[:, None], "K": FRAME.stiffness}
    frame = structure_from_settings(settings(damping=MatrixEntry(), damping_ratio=(0.02,)), reader(content))
    np.testing.assert_allclose(frame.mass, FRAME.mass)
    np.testing.assert_allclose(frame.damping, FRAME.damping)


@pytest.mark.property
def test_a_storey_table_is_a_shear_frame() -> None:
    rows = (Storey(mass_kg=2.0, stiffness_n_m=500.0), Storey(mass_kg=3.0, stiffness_n_m=400.0, repeat=2))
    frame = structure_from_settings(StructureSettings(storeys=rows, damping_ratio=(0.05, 0.02)), reader({}))
    np.testing.assert_allclose(frame.mass, np.diag([2.0, 3.0, 3.0]))
    assert frame.stiffness[1, 1] == 800.0


@pytest.mark.property
@pytest.mark.parametrize(
    ("changes", "content", "where", "problem"),
    [
        ({"storeys": (Storey(mass_kg=1.0, stiffness_n_m=1.0),)}, CONTENT, "", "2 times"),
        ({}, {**CONTENT, "K": FRAME.stiffness[:2, :2]}, "stiffness", "2 x 2"),
        ({}, {**CONTENT, "K": FRAME.stiffness + np.diag([9.0, 9.0], 1)}, "stiffness[1, 2]", "mirror"),
        ({}, {**CONTENT, "M": np.diag([1.0, 0.0, 1.0])}, "mass", "positive definite"),
        ({}, {**CONTENT, "K": "text"}, "K", "numbers"),
        ({}, {**CONTENT, "K": np.full((3, 3), np.nan)}, "K[1, 1]", "not finite"),
        ({"mass": MatrixEntry(name="M", unit="N/m")}, CONTENT, "structure.mass.unit", "not a unit"),
        ({"influence": (1.0, 0.0)}, CONTENT, "influence", "2 entries"),
        ({"degrees_of_freedom": ("a", "b", "a")}, CONTENT, "degrees_of_freedom", "more than once"),
    ],
)
def test_mistakes_are_named(changes: dict[str, Any], content: dict[str, Any], where: str, problem: str) -> None:
    with pytest.raises(UserError) as caught:
        structure_from_settings(settings(**changes), reader(content))
    assert where in str(caught.value)
    assert problem in str(caught.value)


@pytest.mark.property
def test_devices_by_name_and_number() -> None:
    frame = structure_from_settings(settings(degrees_of_freedom=("deck x", "deck y", "pier")), reader(CONTENT))
    assert degree_of_freedom(frame, "pier") == degree_of_freedom(frame, 3) == 2
    np.testing.assert_array_equal(device_position(frame, "pier", "deck x"), [-1.0, 0.0, 1.0])
    np.testing.assert_array_equal(device_position(frame, 2), [0.0, 1.0, 0.0])
    for first, second in (("pier", "pier"), ("cable", "ground"), (4, "ground"), (0, "ground")):
        with pytest.raises(UserError):
            device_position(frame, first, second)


@pytest.mark.property
def test_the_influence_vector_loads_only_what_the_ground_moves() -> None:
    from mrpipe.structures import frequency_response

    still = structure_from_settings(settings(influence=(0.0, 0.0, 0.0)), reader(CONTENT))
    assert np.max(np.abs(frequency_response(still, [3.0], absolute_acceleration=False))) == 0.0


@pytest.mark.real
def test_the_tall_building_as_published(public_data: Path) -> None:
    from mrpipe.campaigns.files import open_data_file

    path = public_data / "tall76" / "76dof_MKC_matrix.mat"
    given = StructureSettings(
        file=str(path),
        mass=MatrixEntry(name="Ms", unit="kg"),
        stiffness=MatrixEntry(name="Ks", unit="N/m"),
        damping=MatrixEntry(name="Cs"),
    )
    known = open_data_file(path).names
    names = {letter: next(name for name in known if name.lower().startswith(letter)) for letter in "mkc"}
    given = given.model_copy(
        update={
            "mass": MatrixEntry(name=names["m"]),
            "stiffness": MatrixEntry(name=names["k"]),
            "damping": MatrixEntry(name=names["c"]),
        }
    )
    frame = structure_from_settings(given, lambda file, name: open_data_file(file).fetch(name))
    assert frame.floors == 76
    # the natural frequencies of the benchmark: 0.16, 0.77, 1.99, 3.79, 6.40 Hz
    np.testing.assert_allclose(
        natural_modes(frame).angular_frequencies[:5] / (2.0 * np.pi), [0.16, 0.765, 1.992, 3.790, 6.395], rtol=5e-3
    )
