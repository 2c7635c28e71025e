"""Updating of a storey model: planted stiffness and masses come back, with honest intervals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.matrices.updating import MeasuredModes, StiffnessModel, storey_model, update_model, with_jackknife
from mrpipe.structures import natural_modes, shear_frame

MASSES = np.array([6.0, 5.5, 5.0, 4.5])
STOREYS = np.array([9000.0, 7000.0, 8000.0, 6000.0])
FRAME = shear_frame(MASSES, STOREYS, 0.01)
MODES = natural_modes(FRAME)


def _measured(count: int = 4, rows: tuple[int, ...] = (0, 1, 2, 3), noise: float = 0.0, seed: int = 1) -> MeasuredModes:
    rng = np.random.default_rng(seed)
    shapes = MODES.mode_shapes[list(rows), :count]
    return MeasuredModes(
        MODES.angular_frequencies[:count] * (1.0 + noise * 1e-3 * rng.standard_normal(count)),
        shapes + noise * 2e-2 * rng.standard_normal(shapes.shape) * np.linalg.norm(shapes, axis=0),
        rows,
        tuple(range(1, count + 1)),
    )


@pytest.mark.property
def test_the_storey_model_is_the_shear_frame() -> None:
    assert storey_model(4).stiffness(STOREYS) == pytest.approx(FRAME.stiffness)
    known = StiffnessModel(
        storey_model(4).parts[:1], ("storey 1",), FRAME.stiffness - 9000.0 * storey_model(4).parts[0]
    )
    assert known.stiffness(np.array([9000.0])) == pytest.approx(FRAME.stiffness)


@pytest.mark.planted
@pytest.mark.parametrize(("count", "rows"), [(4, (0, 1, 2, 3)), (2, (0, 1, 2, 3)), (3, (0, 3))])
def test_exact_modes_give_the_planted_storeys(count: int, rows: tuple[int, ...]) -> None:
    found = update_model(storey_model(4), MASSES, _measured(count, rows), np.full(4, 5000.0))
    assert found.parameters == pytest.approx(STOREYS, rel=1e-3)
    assert np.abs(found.frequency_error).max() < 1e-5
    assert found.undetermined == ()


@pytest.mark.planted
def test_intervals_contain_the_truth_as_often_as_they_say() -> None:
    inside = []
    for seed in range(30):
        found = update_model(storey_model(4), MASSES, _measured(noise=1.0, seed=seed), np.full(4, 7500.0))
        inside.append((found.low < STOREYS) & (found.high > STOREYS))
    assert 0.85 < np.mean(inside) <= 1.0


@pytest.mark.planted
def test_the_jackknife_covers_stiffness_that_the_model_lacks() -> None:
    """Springs between floors that are no neighbours bias the masses; the fit alone gives far too narrow intervals."""
    plain, jackknifed = [], []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        stiffness = FRAME.stiffness.copy()
        for first, second in ((0, 2), (1, 3), (0, 3)):
            spring = np.zeros(4)
            spring[first], spring[second] = 1.0, -1.0
            stiffness += 0.03 * rng.uniform() * 8000.0 * np.outer(spring, spring)
        modes = natural_modes(replace(FRAME, stiffness=stiffness))
        norm = np.sqrt(np.einsum("ir,i,ir->r", modes.mode_shapes, MASSES, modes.mode_shapes))
        data = MeasuredModes(
            modes.angular_frequencies, modes.mode_shapes[1:], (1, 2, 3), (1, 2, 3, 4),
            scaled_residues=(modes.mode_shapes[3] / norm) ** 2, driven=3,
        )  # fmt: skip
        model, unknown = storey_model(4), np.full(4, np.nan)
        found = update_model(model, unknown, data, np.full(4, 7500.0), start_mass=5.0)
        wide = with_jackknife(model, unknown, data, found)
        assert np.all(wide.mass_low <= found.mass_low) and np.all(wide.mass_high >= found.mass_high)
        assert set(found.undetermined) <= set(wide.undetermined)
        plain.append((found.mass_low < MASSES) & (found.mass_high > MASSES))
        jackknifed.append((wide.mass_low < MASSES) & (wide.mass_high > MASSES))
    assert np.mean(jackknifed) > 0.9
    assert np.mean(jackknifed) > np.mean(plain)


@pytest.mark.property
def test_two_modes_are_too_few_for_a_jackknife() -> None:
    data = _measured(count=2)
    found = update_model(storey_model(4), MASSES, data, np.full(4, 7500.0))
    assert with_jackknife(storey_model(4), MASSES, data, found) is found


@pytest.mark.planted
def test_unknown_masses_follow_from_a_measured_force() -> None:
    masses = np.array([np.nan, 5.5, 5.0, np.nan])
    modes = _measured()
    shapes = MODES.mode_shapes / np.sqrt(np.einsum("ir,ij,jr->r", MODES.mode_shapes, FRAME.mass, MODES.mode_shapes))
    driven = MeasuredModes(modes.angular_frequencies, modes.shapes, modes.rows, modes.numbers, shapes[1] ** 2, driven=1)
    found = update_model(storey_model(4), masses, driven, np.full(4, 5000.0), start_mass=5.25)
    assert found.masses == pytest.approx(MASSES, rel=2e-3)
    assert found.parameters == pytest.approx(STOREYS, rel=2e-3)
    # a mass that was given has no interval
    assert found.mass_low[1] == found.mass_high[1] == 5.5
    assert found.mass_low[0] <= found.masses[0] <= found.mass_high[0]


@pytest.mark.property
def test_what_one_mode_leaves_open_is_named() -> None:
    one = MeasuredModes(MODES.angular_frequencies[:1], MODES.mode_shapes[[3], :1], (3,), (1,))
    found = update_model(storey_model(4), MASSES, one, np.full(4, 7500.0))
    # one frequency is a single equation for four storeys
    assert found.undetermined == ("storey 1", "storey 2", "storey 3", "storey 4")
    assert found.frequency_error == pytest.approx(0.0, abs=1e-6)


@pytest.mark.property
def test_parameters_stay_within_their_bounds() -> None:
    found = update_model(storey_model(4), MASSES, _measured(), np.full(4, 5000.0), bounds=(4000.0, 7500.0))
    assert np.all((found.parameters >= 4000.0 - 1e-3) & (found.parameters <= 7500.0 + 1e-3))
