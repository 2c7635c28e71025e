"""Structures from matrices, storey tables and modes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from pydantic import ValidationError
from scipy.sparse import csc_matrix

from mrpipe.errors import UserError
from mrpipe.structures import natural_modes, shear_frame
from mrpipe.structures.given import floor_heights, structure_from_settings
from mrpipe.structures.given_storage import read_matrix
from mrpipe.structures.options import MatrixEntry, Storey, StoreyColumn, StoreyTable, StructureSettings
from mrpipe.structures.places import degree_of_freedom, device_position

FRAME = shear_frame([2.0, 3.0, 1.0], [500.0, 400.0, 300.0], 0.02)


def reader(content: dict[str, Any]):  # type: ignore[no-untyped-def]
    return lambda path, name: content[name]


def settings(**changes: Any) -> StructureSettings:
    given: dict[str, Any] = {
        "file": "model.mat",
        "mass": MatrixEntry(name="M", unit="kg"),
        "stiffness": MatrixEntry(name="K", unit="N/m"),
        "damping": MatrixEntry(name="C", unit="N*s/m"),
    }
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
        ({}, {**CONTENT, "M": np.diag([1.0, -2.0, 1.0])}, "mass[2, 2]", "negative mass"),
        ({}, {**CONTENT, "M": np.eye(3) + 2.0 * np.eye(3)[[1, 0, 2]]}, "mass", "not positive definite"),
        ({}, {**CONTENT, "K": FRAME.stiffness + 2j * np.eye(3)}, "K", "complex"),
        ({}, {**CONTENT, "K": FRAME.stiffness - np.diag([500.0, 0.0, 0.0])}, "stiffness", "restoring force"),
        ({}, {**CONTENT, "K": np.triu(FRAME.stiffness)}, "stiffness[1, 2]", "one triangle"),
        ({"damping_ratio": (0.01,) * 4, "damping": MatrixEntry()}, CONTENT, "damping_ratio", "3 modes"),
        ({"degrees_of_freedom": ("3", "2", "1")}, CONTENT, "degrees_of_freedom[0]", "number 3"),
        ({"degrees_of_freedom": ("a", "ground", "b")}, CONTENT, "degrees_of_freedom[1]", "ground"),
        ({"influence_y": (1.0, 0.0)}, CONTENT, "influence_y", "2 entries"),
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
    np.testing.assert_array_equal(device_position(frame, "ground", 2), [0.0, 1.0, 0.0])
    for first, second in (("pier", "pier"), ("cable", "ground"), (4, "ground"), (0, "ground")):
        with pytest.raises(UserError):
            device_position(frame, first, second)
    with pytest.raises(UserError, match="connects the ground to itself"):
        device_position(frame, 0, "ground")


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


@pytest.mark.property
def test_degrees_of_freedom_without_mass_are_condensed_exactly() -> None:
    # a cantilever of two elements: rotations have no mass
    element = np.array([[12.0, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    K = np.zeros((4, 4))
    K[:2, :2] += element[2:, 2:]
    K += element
    M = np.diag([2.0, 0.0, 3.0, 0.0])
    warnings: list[str] = []
    frame = structure_from_settings(
        settings(
            damping_ratio=(0.02,),
            damping=MatrixEntry(),
            degrees_of_freedom=("u1", "r1", "u2", "r2"),
            influence=(1.0, 0.0, 1.0, 0.0),
        ),
        reader({"M": M, "K": K}),
        warn=warnings.append,
    )
    assert frame.names == ("u1", "u2") and "r1, r2" in warnings[0] and "exact" in warnings[0]
    np.testing.assert_allclose(np.linalg.inv(frame.stiffness), np.linalg.inv(K)[::2, ::2], rtol=1e-10)
    np.testing.assert_allclose(frame.ground_influence, [1.0, 1.0])
    modes = natural_modes(frame)
    ratios = np.diag(modes.mode_shapes.T @ frame.damping @ modes.mode_shapes) / (2.0 * modes.angular_frequencies)
    np.testing.assert_allclose(ratios, 0.02)
    with pytest.raises(UserError, match="neither mass nor a spring"):
        structure_from_settings(
            settings(damping=MatrixEntry()), reader({"M": np.diag([1.0, 0]), "K": np.diag([1.0, 0])})
        )


@pytest.mark.golden
def test_a_storey_table_with_units_from_a_file_and_as_lists(tmp_path: Path) -> None:
    (tmp_path / "storeys.csv").write_text("storey,m,k,h\n1,0.5,100,144\n2,0.4,80,120\n")
    table = StoreyTable(
        file=str(tmp_path / "storeys.csv"),
        mass=StoreyColumn(name="m", unit="kip*s^2/in"),
        stiffness=StoreyColumn(name="k", unit="kip/in"),
        height=StoreyColumn(name="h", unit="in"),
    )
    kip_per_inch = 4448.2216152605 / 0.0254
    given = StructureSettings(storey_table=table)
    frame = structure_from_settings(given, read_matrix)
    np.testing.assert_allclose(np.diag(frame.mass), np.array([0.5, 0.4]) * kip_per_inch)
    np.testing.assert_allclose(frame.stiffness, np.array([[180.0, -80.0], [-80.0, 80.0]]) * kip_per_inch)
    np.testing.assert_allclose(floor_heights(given, read_matrix), [144 * 0.0254, 264 * 0.0254])
    lists = StoreyTable(
        mass=StoreyColumn(values=(5.0, 4.0), unit="t"), stiffness=StoreyColumn(values=(9.0,), unit="kN/mm")
    )
    with pytest.raises(UserError, match="2 masses and 1 stiffnesses"):
        structure_from_settings(StructureSettings(storey_table=lists), read_matrix)
    with pytest.raises(UserError, match="storey 1: is -5"):
        wrong = lists.changed(mass=StoreyColumn(values=(-5.0,), unit="t"))
        structure_from_settings(StructureSettings(storey_table=wrong), read_matrix)


@pytest.mark.golden
def test_sparse_matrices_of_matlab_7_3(tmp_path: Path) -> None:
    sparse = csc_matrix(FRAME.stiffness)
    with h5py.File(tmp_path / "model.mat", "w") as file:
        group = file.create_group("K")
        group.attrs["MATLAB_sparse"] = np.uint64(3)
        group["data"], group["ir"], group["jc"] = sparse.data, sparse.indices, sparse.indptr
        file["M"] = FRAME.mass
    np.testing.assert_allclose(read_matrix(tmp_path / "model.mat", "K"), FRAME.stiffness)
    np.testing.assert_allclose(read_matrix(tmp_path / "model.mat", "M"), FRAME.mass)


@pytest.mark.property
def test_condensation_is_called_exact_only_where_it_is() -> None:
    # a massless node between two springs: with dashpots of another proportion it does not follow statically
    K = np.array([[3.0, -1.0, 0.0], [-1.0, 3.0, -2.0], [0.0, -2.0, 2.0]])
    content = {"M": np.diag([1.0, 0.0, 1.0]), "K": K, "C": 0.1 * K}
    for dashpot, word in ((0.0, "exact"), (0.5, "approximation")):
        warnings: list[str] = []
        structure_from_settings(
            settings(), reader({**content, "C": content["C"] + np.diag([0.0, dashpot, 0.0])}), warn=warnings.append
        )
        assert len(warnings) == 1 and word in warnings[0] and "floor 2" in warnings[0]


@pytest.mark.property
@pytest.mark.parametrize(
    "wrong",
    [
        {"damping_ratio": (2.0,)},
        {"damping_ratio": (-0.01,)},
        {"damping_ratio": (float("nan"),)},
        {"influence": (1.0, float("nan"))},
        {"frequencies_hz": (-1.0, 2.0)},
        {"mode_shapes": ((1.0, 2.0), (1.0,))},
    ],
)
def test_impossible_numbers_are_refused_before_anything_runs(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        StructureSettings(**wrong)


@pytest.mark.property
def test_a_stiffness_file_alone_is_a_structure_that_lacks_its_mass() -> None:
    given = StructureSettings(stiffness=MatrixEntry(file="K.csv"))
    assert given.given
    with pytest.raises(UserError, match=r"mass\.file"):
        structure_from_settings(given, reader({}))


@pytest.mark.property
def test_the_unit_in_the_name_of_a_column_counts() -> None:
    content = {"m [t]": [5.0, 4.0], "k [kN/mm]": [9.0, 8.0], "k (south)": [9.0, 8.0]}

    def table(**stiffness: str) -> StructureSettings:
        mass = StoreyColumn(name="m [t]")
        return StructureSettings(storey_table=StoreyTable(file="a.csv", mass=mass, stiffness=StoreyColumn(**stiffness)))

    frame = structure_from_settings(table(name="k [kN/mm]"), reader(content))
    np.testing.assert_allclose(np.diag(frame.mass), [5000.0, 4000.0])
    assert frame.stiffness[1, 1] == pytest.approx(8.0e6)
    south = structure_from_settings(table(name="k (south)", unit="MN/m"), reader(content))
    assert south.stiffness[1, 1] == pytest.approx(8.0e6)
    with pytest.raises(UserError, match=r"stiffness: unit: is kN/m, and the column is called"):
        structure_from_settings(table(name="k [kN/mm]", unit="kN/m"), reader(content))


@pytest.mark.property
def test_a_height_belongs_to_each_storey() -> None:
    table = StoreyTable(
        mass=StoreyColumn(values=(5.0, 4.0)),
        stiffness=StoreyColumn(values=(9.0, 8.0)),
        height=StoreyColumn(values=(3.0,)),
    )
    with pytest.raises(UserError, match="has 1 values, and the table has 2 storeys"):
        floor_heights(StructureSettings(storey_table=table), reader({}))


@pytest.mark.property
def test_a_matrix_of_json_is_a_list_of_rows(tmp_path: Path) -> None:
    (tmp_path / "bare.json").write_text("[[2, -1], [-1, 1]]")
    np.testing.assert_array_equal(read_matrix(tmp_path / "bare.json", ""), [[2.0, -1.0], [-1.0, 1.0]])
    (tmp_path / "ragged.json").write_text("[[2, -1], [-1]]")
    with pytest.raises(UserError, match="row 2: has 1 values, the first row 2"):
        read_matrix(tmp_path / "ragged.json", "")
    # a list of uneven rows beside a matrix does not make the file unreadable
    (tmp_path / "model.json").write_text('{"K": [[2, -1], [-1, 1]], "notes": [[1], [2, 3]]}')
    np.testing.assert_array_equal(read_matrix(tmp_path / "model.json", "K"), [[2.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(UserError, match="notes: cannot be read"):
        read_matrix(tmp_path / "model.json", "notes")


@pytest.mark.property
def test_the_matrix_of_a_table_without_a_header_needs_no_name(tmp_path: Path) -> None:
    (tmp_path / "M.csv").write_text("2,0\n0,1\n")
    with pytest.raises(UserError, match="for the whole table write name: ''"):
        read_matrix(tmp_path / "M.csv", "M")


@pytest.mark.property
def test_a_number_is_the_matrix_of_one_degree_of_freedom() -> None:
    """MATLAB stores a matrix of one entry as a number."""
    content = {"M": np.float64(2.0), "K": np.array(800.0), "C": np.array([[4.0]])}
    frame = structure_from_settings(settings(damping=MatrixEntry(name="C")), reader(content))
    assert (frame.mass, frame.stiffness, frame.damping) == ([[2.0]], [[800.0]], [[4.0]])
