"""The compiled loop of the fits and that of simulations give the same force for the same chain."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.dampers.forms import form_names
from mrpipe.dampers.plant import FORCE, SLIP, build_chain, run_chain
from mrpipe.effects.library import damper_effects
from mrpipe.fitting.kernel import FORCE_AT, filter_parts, run_recordings
from mrpipe.fitting.recordings import Recordings
from tests.dampers.test_forms import NUMBERS, model

pytestmark = pytest.mark.property

DT = (0.002, 0.001)


def _recordings() -> Recordings:
    """Return two tests of different rates; the motion reverses, rests, and the drive changes."""
    parts = []
    for number, dt in enumerate(DT):
        time = np.arange(0.0, 2.0, dt)
        x = 0.01 * np.sin(9.0 * time + number) * np.where(time > 0.3, 1.0, 0.0)
        v = np.gradient(x, dt)
        parts.append((x, v, np.gradient(v, dt), 1.0 + np.sin(3.0 * time)))
    x, v, a, drive = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    lengths = [len(part[0]) for part in parts]
    each, nothing = np.zeros(len(x)), np.zeros(2)
    return Recordings(
        x, v, a, drive, each, np.array([0, *np.cumsum(lengths)]), np.array(DT), ("a", "b"), np.repeat([0, 1], lengths),
        each == 0.0, *([nothing] * 11), np.array(DT),
    )  # fmt: skip


@pytest.mark.parametrize("form", [name for name in form_names() if name in NUMBERS])
def test_both_loops_agree(form: str) -> None:
    tests = _recordings()
    chain = model(form).chain()
    force = run_recordings(chain, tests)[FORCE_AT]
    for test, dt in enumerate(DT):
        piece = slice(tests.starts[test], tests.starts[test + 1])
        channels = (tests.displacement, tests.velocity, tests.acceleration, tests.drive)
        wires = run_chain(chain, *(channel[piece] for channel in channels), dt)
        assert np.ptp(wires[:, SLIP]) > 0.0
        np.testing.assert_allclose(force[piece], wires[:, FORCE], rtol=1e-12, atol=1e-9)


def test_filtered_parts_of_the_force_add_up_to_the_filtered_force() -> None:
    tests = _recordings()
    plain = model("bouc-wen").steps()
    effect = damper_effects()["channel-skew"].form("filtered-force")
    filtered = build_chain([*plain, *effect.steps({"skew": 0.012, "damping_ratio": 0.7})])
    force = run_recordings(build_chain(plain), tests)[FORCE_AT]
    wanted = run_recordings(filtered, tests)[FORCE_AT]
    parts = filter_parts(filtered, np.stack([0.3 * force, 0.7 * force]), tests)
    assert np.max(np.abs(wanted - force)) > 0.1 * np.max(np.abs(force))
    np.testing.assert_allclose(parts.sum(axis=0), wanted, rtol=1e-12, atol=1e-9)
