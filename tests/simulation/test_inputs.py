"""Ground motion in two directions and forces on a structure, against an independent state space."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from mrpipe.control.controller import build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.errors import UserError
from mrpipe.simulation.acting import acting, acting_together, excitation_at
from mrpipe.simulation.excitation import recorded
from mrpipe.simulation.inputs import acting_as_forces, in_two_directions
from mrpipe.simulation.loop import LoopOptions, Response
from mrpipe.simulation.settings import ExcitationSettings
from mrpipe.simulation.several_dampers import LoopDamper, simulate_dampers
from mrpipe.structures import Frame

C_DAMPER = 900.0
X, Y = np.array([1.0, 0.0, 1.0, 0.0]), np.array([0.0, 1.0, 0.0, 1.0])
NAMES = ("deck x", "deck y", "pier x", "pier y")
TIME = 0.01 * np.arange(400)
HISTORIES = np.random.default_rng(8).standard_normal((400, 2)) * np.exp(-(((TIME - 1.5) / 0.7) ** 2))[:, None]
POSITION = np.array([1.0, 0.0, -1.0, 0.0])


def bridge() -> Frame:
    """Return two masses that move in two directions, which an eccentric bearing couples."""
    stiffness = np.array([[9e4, 1e4, -9e4, 0.0], [1e4, 6e4, 0.0, -6e4], [-9e4, 0.0, 3e5, 2e4], [0.0, -6e4, 2e4, 2e5]])
    mass = np.diag([80.0, 80.0, 40.0, 40.0])
    return Frame(mass, 0.1 * mass + 2e-3 * stiffness, stiffness, "bridge", X, NAMES, influence_y=Y)


def expected(frame: Frame, loads: np.ndarray, follow: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and absolute accelerations by the state space of scipy."""
    n, inverse = frame.floors, np.linalg.inv(frame.mass)
    damping = frame.damping + C_DAMPER * np.outer(POSITION, POSITION)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ frame.stiffness, -inverse @ damping]])
    B = np.vstack([np.zeros((n, loads.shape[1])), inverse @ loads])
    C = np.vstack([np.eye(n, 2 * n), A[n:]])
    D = np.vstack([np.zeros((n, loads.shape[1])), inverse @ loads + follow])
    _, found, _ = lsim(StateSpace(A, B, C, D), u, TIME)
    return found[:, :n], found[:, n:]


def run(frame: Frame, excitation) -> Response:
    controller = build_controller("vd", Gains(c_n_s_m=C_DAMPER), ControllerOptions(rate_hz=200.0), position=POSITION)
    options = LoopOptions(plant_rate_hz=8000.0, tracking="unclipped", record_rate_hz=100.0)
    response = simulate_dampers(frame, [LoopDamper("bearing", POSITION, None, controller)], excitation, options)
    assert response.energy_balance_error < 1e-4
    return response.first


def same(found: np.ndarray, wanted: np.ndarray, tolerance: float) -> None:
    np.testing.assert_allclose(found[: len(wanted)], wanted, atol=tolerance * np.max(np.abs(wanted)))


@pytest.mark.oracle
def test_ground_motion_in_two_directions() -> None:
    frame = bridge()
    response = run(frame, in_two_directions(recorded(TIME, HISTORIES), frame, "record"))
    follow = np.column_stack([X, Y])
    x, a = expected(frame, -frame.mass @ follow, follow, HISTORIES)
    same(response.displacement, x, 1e-5)
    same(response.absolute_acceleration, a, 1e-4)
    same(response.acceleration, a - HISTORIES @ follow.T, 1e-4)
    same(response.base_shear, a @ frame.mass @ X, 1e-4)
    # turned by 90 degrees the first history acts along y
    turned = frame.turned(90.0)
    swapped = run(turned, in_two_directions(recorded(TIME, HISTORIES[:, ::-1] * [1.0, -1.0]), turned, "record"))
    same(swapped.displacement, x, 1e-5)


@pytest.mark.oracle
def test_a_shaker_and_wind() -> None:
    frame = bridge()
    shares = {"deck x": 500.0, "4": -300.0}
    places = np.column_stack([500.0 * np.eye(4)[0], -300.0 * np.eye(4)[3]])
    none = np.zeros((4, 2))
    response = run(frame, acting_as_forces(recorded(TIME, HISTORIES), frame, shares, "force_at"))
    x, a = expected(frame, places, none, HISTORIES)
    same(response.displacement, x, 1e-5)
    same(response.absolute_acceleration, a, 1e-4)
    same(response.base_shear, a @ frame.mass @ X - HISTORIES @ places.T @ X, 1e-4)
    # one history acts on all, each with its factor
    alone = run(frame, acting_as_forces(recorded(TIME, HISTORIES[:, 0]), frame, shares, "force_at"))
    same(alone.displacement, expected(frame, places, none, HISTORIES[:, [0, 0]])[0], 1e-5)


@pytest.mark.golden
def test_settings_and_what_can_be_wrong(tmp_path: Path) -> None:
    frame = bridge()
    path = tmp_path / "wind.csv"
    path.write_text("t, u, v\n" + "\n".join(f"{t}, {u}, {v}" for t, (u, v) in zip(TIME, HISTORIES, strict=True)))
    settings = ExcitationSettings(kind="recorded", file=str(path), file_unit="kN", force_at={"deck x": 1, 4: 1})
    excitation = acting(excitation_at(settings, 5.0, 0.0), settings, frame)
    assert [place.name for place in excitation.places] == ["force at deck x", "force at 4"]
    np.testing.assert_allclose(excitation.at(TIME), 1e3 * HISTORIES, atol=1e-9)
    ground = settings.changed(force_at={}, file_unit="g", file_channels=(2,))
    np.testing.assert_allclose(
        acting(excitation_at(ground, 5.0, 0.0), ground, frame).at(TIME), 9.80665 * HISTORIES[:, 1]
    )
    for changes, words in (
        ({"force_at": {"deck z": 1}}, "'deck z' is not a degree of freedom"),
        ({"force_at": {1: 1, 2: 1, 3: 1}}, "names 3 degrees of freedom, but the file holds 2 histories"),
        ({"force_at": {}}, "is not a unit of acceleration"),
        ({"file_channels": (3,)}, "channel 3: is not in the record"),
    ):
        wrong = settings.changed(**changes)
        with pytest.raises(UserError, match=words):
            acting(excitation_at(wrong, 5.0, 0.0), wrong, frame)
    both = ground.changed(file_channels=())
    with pytest.raises(
        UserError, match=r"two components, but the structure has one direction; give structure.influence_y"
    ):
        acting(excitation_at(both, 5.0, 0.0), both, replace(frame, influence_y=None))
    with pytest.raises(UserError, match="no second direction"):
        replace(frame, influence_y=None).turned(30.0)


@pytest.mark.property
def test_a_force_and_ground_motion_act_together(tmp_path: Path) -> None:
    """The response of a linear loop is the sum of the responses to each; each is zero after its end."""
    frame, files = bridge(), []
    for place, length in enumerate((400, 250)):
        files.append(tmp_path / f"{place}.csv")
        np.savetxt(files[-1], np.column_stack([TIME, HISTORIES[:, place]])[:length], delimiter=",")
    quake = {"kind": "recorded", "file": str(files[0])}
    wind = {"kind": "recorded", "file": str(files[1]), "file_unit": "kN", "force_at": {"deck y": 1.0}}
    alone = [run(frame, acting_together(ExcitationSettings(**item), frame, 1.0, 0.0)) for item in (quake, wind)]
    both = run(frame, acting_together(ExcitationSettings(**quake, also=[wind]), frame, 1.0, 0.0))
    for name in ("displacement", "absolute_acceleration", "base_shear"):
        parts = [getattr(item, name)[: len(alone[1].time_s)] for item in alone]
        found = getattr(both, name)[: len(alone[1].time_s) - 1]
        np.testing.assert_allclose(found, sum(parts)[:-1], rtol=0.0, atol=1e-9 * np.abs(found).max())
    assert len(both.time_s) == len(alone[0].time_s)
    assert both.energy_balance_error < 1e-3


@pytest.mark.property
@pytest.mark.parametrize(
    ("further", "words"),
    [
        ({"kind": "free-decay"}, r"also\[0\]: kind: is free-decay"),
        ({"kind": "harmonic"}, r"also\[0\]: base_amplitude_m_s2: is not given"),
        ({"kind": "harmonic", "force_at": {"deck y": 1.0}}, r"also\[0\]: force_amplitude_n: is not given"),
        (
            {"force_amplitude_n": 1.0, "force_at": {"deck y": 1.0}, "base_amplitude_m_s2": 2.0},
            r"also\[0\]: base_amplitude_m_s2: is given, but simulate.excitation.also\[0\].force_at puts a force",
        ),
        ({"base_amplitude_m_s2": 1.0, "direction_deg": 3.0}, r"also\[0\]: direction_deg"),
        ({"kind": "recorded", "file": "none.csv"}, r"also\[0\].file: none.csv: there is no such file"),
        ({"force_amplitude_n": 1.0, "force_at": {"roof": 1.0}}, r"also\[0\].force_at: 'roof'"),
    ],
)
def test_mistakes_in_what_acts_in_addition(further: dict, words: str) -> None:
    settings = ExcitationSettings(base_amplitude_m_s2=1.0, also=[further])
    with pytest.raises(UserError, match=words):
        acting_together(settings, bridge(), 10.0, 1.0)


@pytest.mark.property
def test_first_floor_and_top_lie_in_the_direction_of_the_ground_motion() -> None:
    frame = bridge()
    found = {degrees: frame.turned(degrees).moved_by_ground for degrees in (0.0, 30.0, 60.0, 90.0, 45.0)}
    assert found == {0.0: (0, 2), 30.0: (0, 2), 60.0: (1, 3), 90.0: (1, 3), 45.0: (0, 2)}
