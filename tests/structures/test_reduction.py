"""Reduced structures: exact where the theory says so, and with the stated error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import block_diag, solve_continuous_lyapunov, sqrtm

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.errors import UserError
from mrpipe.structures import Frame, natural_modes, read_frame, shear_frame, state_space
from mrpipe.structures.frame import write_frame
from mrpipe.structures.options import ReductionSettings
from mrpipe.structures.reduction import balanced_structure, craig_bampton, guyan, modal, reduced_structure

FRAME = shear_frame(np.full(12, 100.0), np.linspace(9e5, 4e5, 12), 0.02)
KEPT = (2, 5, 8, 11)


@pytest.mark.property
def test_static_condensation_is_exact_at_rest() -> None:
    reduced = guyan(FRAME, KEPT)
    load = np.zeros(12)
    load[list(KEPT)] = [1.0, -2.0, 3.0, 0.5]
    full = np.linalg.solve(FRAME.stiffness, load)
    small = np.linalg.solve(reduced.frame.stiffness, load[list(KEPT)])
    np.testing.assert_allclose(small, full[list(KEPT)], rtol=1e-10)
    assert reduced.frame.names == tuple(f"floor {k + 1}" for k in KEPT)


@pytest.mark.property
def test_frequencies_come_from_above_and_converge() -> None:
    exact = natural_modes(FRAME).angular_frequencies
    last = np.inf
    for modes in (1, 3, 6, 8):
        reduced = craig_bampton(FRAME, KEPT, modes, band_high_hz=8.0)
        omega = natural_modes(reduced.frame).angular_frequencies
        assert np.all(omega[:4] >= exact[:4] - 1e-9)
        assert reduced.error <= last + 1e-9
        last = reduced.error
    assert last < 1e-8  # eight fixed-interface modes are all there are


@pytest.mark.property
@pytest.mark.parametrize("kept", [(), KEPT])
def test_modal_reduction_keeps_its_modes(kept: tuple[int, ...]) -> None:
    reduced = modal(FRAME, 4, kept)
    np.testing.assert_allclose(
        natural_modes(reduced.frame).angular_frequencies, natural_modes(FRAME).angular_frequencies[:4], rtol=1e-9
    )


@pytest.mark.property
def test_the_stated_error_is_that_of_the_response() -> None:
    coarse, fine = guyan(FRAME, KEPT, 4.0), craig_bampton(FRAME, KEPT, 3, 4.0)
    assert 1e-4 < coarse.error < 0.5
    assert fine.error < 0.1 * coarse.error


@pytest.mark.property
def test_mistakes() -> None:
    for kept in ((), tuple(range(12)), (1, 1)):
        with pytest.raises(UserError):
            guyan(FRAME, kept)
    undamped = shear_frame([1.0, 1.0], [10.0, 10.0], 0.0)
    with pytest.raises(UserError, match="stable"):
        balanced_structure(undamped, (0,), 2)


@pytest.mark.property
def test_the_top_is_a_floor_and_no_mode_and_the_order_of_the_names_does_not_count(tmp_path: Path) -> None:
    settings = ReductionSettings(method="craig-bampton", keep=["floor 12", "floor 3"], modes=4)
    reduced = reduced_structure(FRAME, settings)
    assert reduced.frame.names[:3] == ("floor 3", "floor 12", "mode 1")
    assert np.max(np.abs(reduced.frame.ground_influence[2:])) > 0.01
    assert reduced.frame.moved_by_ground == (0, 1)
    assert reduced.frame.top == 1
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, reduced.frame)
    assert read_frame(Artifact(tmp_path / "frame.h5")).top == 1


@pytest.mark.property
def test_the_place_of_a_sensor_is_found_by_its_name() -> None:
    plain = replace(FRAME, influence=np.tile([1.0, 0.0], 6), degrees_of_freedom=())
    torsion = replace(plain, degrees_of_freedom=tuple(f"floor {k} {axis}" for k in range(1, 7) for axis in "xy"))
    assert FRAME.place_of("3") == 2
    assert FRAME.place_of("13") is None
    assert torsion.place_of("3_y") == 5
    assert torsion.place_of("3") == torsion.place_of("3_x") == 4
    assert torsion.place_of("3_z") is None


@pytest.mark.property
def test_a_balanced_structure_is_symmetric_stable_and_better_than_one_with_the_lowest_modes() -> None:
    # what a force on the third floor excites most is not the lowest modes
    kept = [2, 11]
    balanced_one, lowest = balanced_structure(FRAME, kept, 5, 12.0), craig_bampton(FRAME, kept, 3, 12.0)
    assert balanced_one.frame.floors == lowest.frame.floors == 5
    assert balanced_one.frame.names == ("floor 3", "floor 12", "mode 1", "mode 2", "mode 3")
    assert balanced_one.error < 0.05
    np.testing.assert_allclose(balanced_one.basis[kept], np.eye(2, 5), atol=1e-9)
    for matrix in (balanced_one.frame.mass, balanced_one.frame.stiffness):
        np.testing.assert_allclose(matrix, matrix.T)
        assert np.min(np.linalg.eigvalsh(matrix)) > 0.0
    assert np.max(np.linalg.eigvals(state_space(balanced_one.frame).A).real) < 0.0
    errors = [balanced_structure(FRAME, kept, count, 12.0).error for count in (3, 5, 8, 12)]
    assert np.all(np.diff(errors) < 0.0) and errors[-1] < 1e-8
    chosen = reduced_structure(
        FRAME, ReductionSettings(method="balanced", keep=["3", "12"], modes=5, band_high_hz=12.0)
    )
    assert chosen.error == pytest.approx(balanced_one.error)
    with pytest.raises(UserError, match="modes: is 1, and keep has 2 entries"):
        balanced_structure(FRAME, kept, 1)


@pytest.mark.property
def test_both_directions_of_the_ground_are_reduced() -> None:
    two = replace(FRAME, influence=np.tile([1.0, 0.0], 6), influence_y=np.tile([0.0, 1.0], 6))
    for reduced in (guyan(two, KEPT), craig_bampton(two, KEPT, 3), balanced_structure(two, KEPT, 8)):
        for vector, small in ((two.influence, reduced.frame.influence), (two.influence_y, reduced.frame.influence_y)):
            np.testing.assert_allclose(reduced.frame.mass @ small, reduced.basis.T @ two.mass @ vector)


@pytest.mark.property
def test_the_error_is_stated_beyond_the_first_resonance() -> None:
    # one floor kept: half of the only frequency lies below the resonance, where every reduction looks exact
    reduced = guyan(FRAME, [11])
    first = natural_modes(FRAME).frequencies_hz[0]
    shifted = natural_modes(reduced.frame).frequencies_hz[0]
    assert shifted > 1.02 * first
    assert reduced.band_high_hz > first
    assert reduced.error > 0.5


@pytest.mark.property
def test_the_error_is_that_of_the_worse_direction() -> None:
    # two uncoupled directions: one keeps every third floor, the other the top only
    both = np.kron(np.eye(2), FRAME.stiffness), np.kron(np.eye(2), FRAME.damping), np.kron(np.eye(2), FRAME.mass)
    x, y = np.repeat([1.0, 0.0], 12), np.repeat([0.0, 1.0], 12)
    one = replace(FRAME, stiffness=both[0], damping=both[1], mass=both[2], influence=x)
    kept = (*KEPT, 23)
    errors = [guyan(frame, kept, 3.0).error for frame in (one, replace(one, influence=y))]
    assert errors[1] > 2.0 * errors[0]
    assert guyan(replace(one, influence_y=y), kept, 3.0).error == pytest.approx(errors[1], rel=1e-9)


@pytest.mark.property
def test_places_that_do_not_tell_modes_apart_are_refused() -> None:
    # two uncoupled equal directions: both lowest modes move, but only one is seen at the places kept
    K = np.kron(np.eye(2), FRAME.stiffness[:3, :3])
    frame = replace(FRAME, mass=np.diag([1.0, 1, 1, 1.1, 1.1, 1.1]), stiffness=K, damping=0.0 * K)
    with pytest.raises(UserError, match="cannot tell the 2 lowest modes apart"):
        modal(frame, 2, [0, 2])
    with pytest.raises(UserError, match="cannot tell the 2 lowest modes apart"):
        reduced_structure(frame, ReductionSettings(method="modal", keep=[1, "floor 3"], modes=2))


@pytest.mark.property
def test_places_are_kept_by_number_or_name() -> None:
    settings = ReductionSettings(method="guyan", keep=[3, "floor 6", "9", 12])
    assert reduced_structure(FRAME, settings).kept == KEPT


@pytest.mark.property
def test_a_direction_that_does_not_move_the_places_is_left_out() -> None:
    """Its error is that of one rounding error over another one."""
    influence = np.ones(12)
    apart = replace(FRAME, influence=influence)
    both = Frame(
        *(block_diag(item, item) for item in (FRAME.mass, FRAME.damping, FRAME.stiffness)),
        influence=np.concatenate([influence, 0.0 * influence]),
        influence_y=np.concatenate([0.0 * influence, influence]),
    )
    assert guyan(both, KEPT, 4.0).error == pytest.approx(guyan(apart, KEPT, 4.0).error, rel=0.05)
    # a structure that the ground does not move has the error of its response to forces
    still = replace(both, influence=both.influence_y, influence_y=None)
    assert 0.0 < guyan(still, KEPT, 4.0).error < 1.0


@pytest.mark.oracle
@pytest.mark.parametrize("coordinates", [3, 5, 8])
def test_a_balanced_structure_is_within_the_bound_of_balanced_truncation(coordinates: int) -> None:
    """The bound is twice the sum of the Hankel singular values that a square-root truncation of the states leaves out.

    Inputs are the ground motion and a force on the first floor, each with the same static energy; the output is the
    displacement of this floor.
    """
    n = FRAME.floors
    reduced = balanced_structure(FRAME, (0,), coordinates, None)
    loads = np.column_stack([FRAME.mass @ np.ones(n), np.eye(n)[0]])
    loads /= np.sqrt(np.einsum("ni,ni->i", loads, np.linalg.solve(FRAME.stiffness, loads)))
    space = state_space(FRAME, loads)
    inputs, output = space.B[:, 1:], np.eye(2 * n)[:1]
    reachable = solve_continuous_lyapunov(space.A, -inputs @ inputs.T)
    observable = solve_continuous_lyapunov(space.A.T, -output.T @ output)
    hankel = np.linalg.svd(np.real(sqrtm(reachable) @ sqrtm(observable)), compute_uv=False)
    small, basis = reduced.frame, reduced.basis

    def response(omega: float) -> float:
        full = np.linalg.solve(1j * omega * np.eye(2 * n) - space.A, inputs.astype(complex))[0]
        dynamic = small.stiffness + 1j * omega * small.damping - omega**2 * small.mass
        return float(np.linalg.norm(full - basis[0] @ np.linalg.solve(dynamic, basis.T @ loads.astype(complex))))

    omega = natural_modes(FRAME).angular_frequencies
    lines = np.concatenate([omega, natural_modes(small).angular_frequencies, np.linspace(1.0, 1.2 * omega[-1], 400)])
    assert max(response(float(line)) for line in lines) < 2.0 * np.sum(hankel[2 * coordinates :])
