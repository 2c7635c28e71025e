"""Linear frame that is equivalent at one amplitude."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.artifacts import Artifact, ArtifactWriter, Provenance
from mrpipe.errors import UserError
from mrpipe.structures import complex_modes, natural_modes, shear_frame, write_frame
from mrpipe.structures.over_amplitude import depends_on_amplitude, frame_at_amplitude, read_frame_at


def _frame():
    return shear_frame([2.0, 3.0], [4000.0, 3000.0], [0.01, 0.02], name="two floors")


def _artifact(path, **amplitude):
    with ArtifactWriter.create(path, Provenance("identify-frame")) as artifact:
        for name, values in amplitude.items():
            artifact.put(f"amplitude/{name}", values, unit="1", dims=("mode",))
    return Artifact(path)


@pytest.mark.property
def test_modes_follow_their_laws_and_keep_their_shapes(tmp_path):
    frame = _frame()
    modes = natural_modes(frame)
    omega = modes.angular_frequencies
    artifact = _artifact(
        tmp_path / "frame.h5",
        angular_frequency=omega,
        damping_ratio=[0.01, 0.02],
        softening_exponent=[0.02, 0.01],
        damping_exponent=[0.4, 0.2],
        reference=[0.001, 0.001],
        largest=[0.04, 0.01],
    )
    found = frame_at_amplitude(artifact, frame, 0.02)
    levels = np.array([21.0, 6.0])
    assert natural_modes(found).angular_frequencies == pytest.approx(omega * levels ** [-0.02, -0.01])
    assert complex_modes(found).damping_ratios == pytest.approx(np.array([0.01, 0.02]) * levels ** [0.4, 0.2])
    assert np.abs(natural_modes(found).mode_shapes) == pytest.approx(np.abs(modes.mode_shapes), abs=1e-9)


@pytest.mark.property
def test_constant_modes_leave_nothing_to_take(tmp_path):
    artifact = _artifact(tmp_path / "frame.h5", other=[1.0])
    assert not depends_on_amplitude(artifact)
    with pytest.raises(UserError, match="found no dependence of the modes on amplitude"):
        frame_at_amplitude(artifact, _frame(), 0.01)


@pytest.mark.property
def test_without_amplitude_the_frame_is_the_identified_one(tmp_path):
    with ArtifactWriter.create(tmp_path / "frame.h5", Provenance("identify-frame")) as artifact:
        write_frame(artifact, _frame())
    read = Artifact(tmp_path / "frame.h5")
    assert np.array_equal(read_frame_at(read, 0.0).stiffness, _frame().stiffness)
    with pytest.raises(UserError, match="set it to 0"):
        read_frame_at(read, 0.01)
