"""The search of the shape of an effect: ranges wide enough for real structures."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.effects.structural.library import all_structural_effects
from mrpipe.tracing.structure.base import FrameProblem, frame_problem
from mrpipe.tracing.structure.candidates import Placed, Surroundings, scales_of, search
from mrpipe.tracing.structure.fit import Design, design_of
from mrpipe.tracing.structure.records import frame_data
from tests.tracing.structure.rig import frame_campaign

FRICTION = all_structural_effects()["joint-friction"]
FORCE_N = 0.8


@functools.cache
def problem() -> FrameProblem:
    data = frame_data(frame_campaign("clean"))
    return frame_problem(data.with_role("training"), data.with_role("validation"), data.masses_kg)


def sliding(drift: np.ndarray, slip: float) -> np.ndarray:
    """Return the force of a spring that slips at a drift of `slip`, as a share of its largest force."""
    force, found = 0.0, np.zeros(len(drift))
    for index, way in enumerate(np.diff(drift), start=1):
        force = float(np.clip(force + way / slip, -1.0, 1.0))
        found[index] = force
    return found


def with_friction(slip: float) -> Design:
    """Return the clean frame with friction in storey 2; the shear force from inertia has the opposite sign."""
    changed = []
    for item in problem().training:
        target = item.target.copy()
        target[1] -= FORCE_N * item.lines_of(sliding(item.motion.drift[1], slip))
        changed.append(replace(item, target=target))
    return design_of("linear-frame", changed)


@pytest.mark.planted
@pytest.mark.parametrize("share", [0.0005, 0.005, 0.1])
def test_stiff_and_soft_joints_are_found(share: float) -> None:
    """Bolted joints slip at some hundredths of a millimetre, which is less than a thousandth of a usual drift."""
    form = next(item for item in FRICTION.forms if item.name == "slipping-spring")
    place = Placed(FRICTION, form)
    slip = share * scales_of(problem().training, place).stroke
    found = search(place, with_friction(slip), None, Surroundings(problem().storey_stiffness))
    assert found.fitted.numbers[0] == pytest.approx(slip, rel=0.2)
    assert found.solved.amplitudes[1] == pytest.approx(FORCE_N, rel=0.05)
