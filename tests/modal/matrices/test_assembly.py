"""From incomplete modes to mass, damping and stiffness: what is determined comes back, what is not is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.modal.matrices.assembly import Assembly, PartialModes, assemble_partial, can_scale
from mrpipe.modal.search.selection import Layout
from mrpipe.structures import complex_modes, modal_assurance, natural_modes, shear_frame
from tests.modal.towers import random_tower

pytestmark = pytest.mark.planted

MASSES = np.array([6.0, 5.5, 5.0, 4.5])
STOREYS = np.array([9000.0, 7000.0, 8000.0, 6000.0])
RATIOS = np.array([0.004, 0.006, 0.008, 0.01])
FRAME = shear_frame(MASSES, STOREYS, RATIOS)
MODES = natural_modes(FRAME)
NORMALISED = MODES.mode_shapes / np.sqrt(np.einsum("ir,ij,jr->r", MODES.mode_shapes, FRAME.mass, MODES.mode_shapes))
ALL = tuple(range(4))


def _modes(
    count: int = 4, measured: tuple[int, ...] = ALL, driven: int = -1, numbers: tuple[int, ...] = ()
) -> PartialModes:
    chosen = [number - 1 for number in numbers] or list(range(count))
    shapes = np.zeros((4, len(chosen)))
    shapes[list(measured)] = MODES.mode_shapes[np.ix_(list(measured), chosen)]
    errors = np.full(shapes.shape, np.inf)
    errors[list(measured)] = 1e-3
    known = [(number + 1, number + 1) for number in chosen]
    return PartialModes(
        MODES.angular_frequencies[chosen], RATIOS[chosen], shapes, errors, measured, tuple(known),
        NORMALISED[driven, chosen] ** 2 if driven >= 0 else None, driven,
    )  # fmt: skip


def _assembled(modes: PartialModes, masses: np.ndarray, chain: bool = True) -> Assembly:
    return assemble_partial(modes, masses, Layout(4, masses, chain), Path("campaign.yaml"))


def test_all_modes_with_a_floor_without_a_sensor_give_the_whole_frame() -> None:
    found = _assembled(_modes(measured=(0, 1, 3)), MASSES)
    assert found.frame is not None and found.numbers == (1, 2, 3, 4)
    assert np.linalg.norm(found.frame.stiffness - FRAME.stiffness) < 0.01 * np.linalg.norm(FRAME.stiffness)
    assert np.diag(modal_assurance(found.shapes, MODES.mode_shapes)).min() > 0.999
    assert complex_modes(found.frame).damping_ratios == pytest.approx(RATIOS, rel=0.01)
    assert any("floors without a sensor (3)" in line for line in found.findings)


def test_missing_modes_are_named_and_get_the_mean_damping() -> None:
    found = _assembled(_modes(numbers=(1, 3)), MASSES)
    assert found.frame is not None and found.numbers == (1, 3)
    assert np.linalg.norm(found.frame.stiffness - FRAME.stiffness) < 0.01 * np.linalg.norm(FRAME.stiffness)
    assert complex_modes(found.frame).damping_ratios == pytest.approx([0.004, 0.006, 0.008, 0.006], rel=0.02)
    assert "2 of 4 modes were found; modes 2, 4 are not determined" in found.findings[0]
    one = _assembled(_modes(numbers=(1, 2, 3)), MASSES).findings[0]
    assert "mode 4 is not determined by the data" in one and "its damping is the mean" in one


def test_unknown_masses_follow_from_the_measured_force() -> None:
    found = _assembled(_modes(driven=1), np.full(4, np.nan))
    assert found.masses == pytest.approx(MASSES, rel=0.01)
    assert np.all(found.mass_intervals[:, 0] <= found.masses) and np.all(found.masses <= found.mass_intervals[:, 1])
    assert any("scaled by the measured force" in line for line in found.findings)


def test_without_a_mass_and_a_force_only_the_modes_are_left() -> None:
    unknown = np.full(4, np.nan)
    assert not can_scale(unknown, _modes()) and can_scale(MASSES, _modes()) and can_scale(unknown, _modes(driven=0))
    found = _assembled(_modes(measured=(0, 1, 3)), unknown)
    assert found.frame is None and found.storeys is None
    assert np.isnan(found.shapes[2]).all() and np.isfinite(found.shapes[[0, 1, 3]]).all()
    assert "no mass is known and no force" in found.findings[0]


def test_a_shape_that_open_masses_leave_open_is_not_given() -> None:
    """With all masses unknown, two sensors and a scale, the shape of the other floors had been given as if known."""
    found = _assembled(_modes(count=2, measured=(1, 3), driven=3), np.full(4, np.nan))
    assert np.isnan(found.shapes[[0, 2]]).all() and np.isfinite(found.shapes[[1, 3]]).all()
    assert any(
        line.startswith("floors without a sensor (1, 3): their mode shapes are not determined, because the data do")
        for line in found.findings
    )


def test_a_shape_that_orthogonality_gives_does_not_wait_for_the_storey_model() -> None:
    """Coupled floors make storeys uncertain: shapes that known masses determine had been withheld."""
    tower = random_tower(np.random.default_rng(2), 7)
    shapes = tower.shapes / np.linalg.norm(tower.shapes, axis=0)
    shapes[3], errors = 0.0, np.full((7, 7), 1e-3)
    errors[3] = np.inf
    numbers = tuple((number, number) for number in range(1, 8))
    measured = (0, 1, 2, 4, 5, 6)
    modes = PartialModes(2.0 * np.pi * tower.frequencies_hz, np.full(7, 0.01), shapes, errors, measured, numbers)
    found = assemble_partial(modes, tower.mass, Layout(7, tower.mass), Path("campaign.yaml"))
    assert any("do not determine" in line and "storey 5" in line for line in found.findings)
    assert np.diag(modal_assurance(found.shapes, tower.shapes)).min() > 0.9999


def test_unknown_masses_leave_measured_shapes_as_they_are() -> None:
    """Shapes made orthogonal to wrong masses had a modal assurance of 0.9 at the very floors with a sensor."""
    modes = _modes(measured=(0, 1, 3), driven=3)
    rng = np.random.default_rng(4)
    modes.shapes[[0, 1, 3]] *= 1.0 + 0.03 * rng.standard_normal((3, 4))
    for masses, kept in ((np.full(4, np.nan), True), (MASSES, False)):
        shapes = _assembled(modes, masses).shapes[[0, 1, 3]]
        ratio = shapes / modes.shapes[[0, 1, 3]]
        assert bool(np.allclose(ratio, ratio[0])) == kept


def test_sensors_in_several_directions_give_no_chain() -> None:
    found = _assembled(_modes(), MASSES, chain=False)
    assert found.frame is None and "several directions" in found.findings[0]


def test_a_frame_that_is_no_chain_of_storeys_is_warned_of() -> None:
    modes = _modes()
    stiffer = PartialModes(
        modes.angular_frequencies * np.array([1.0, 1.12, 1.0, 1.0]), modes.damping_ratios, modes.shapes, modes.errors,
        modes.measured, modes.possible_numbers,
    )  # fmt: skip
    assert any("the frequency of mode 2 differs by" in line for line in _assembled(stiffer, MASSES).findings)
