"""A free decay begins in the calibrated mode."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from mrpipe.errors import UserError
from mrpipe.simulation.release import calibrated_shape, released
from mrpipe.structures import Frame, natural_modes, shear_frame

pytestmark = pytest.mark.property

STOREYS = shear_frame([20.0, 20.0, 15.0], [3.0e4, 3.0e4, 2.0e4], 0.0)
SQUARE = Frame(
    *(block_diag(item, item) for item in (STOREYS.mass, STOREYS.damping, STOREYS.stiffness)),
    influence=np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
    influence_y=np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
)


@pytest.mark.parametrize("mode", [1, 2])
def test_the_damper_starts_at_its_amplitude_in_its_mode(mode: int) -> None:
    position = np.array([-1.0, 1.0, 0.0])
    modes = natural_modes(STOREYS)
    z = released(STOREYS, position, float(modes.angular_frequencies[mode - 1]), 0.01, None)
    assert abs(position @ z[:3]) == pytest.approx(0.01)
    assert np.all(z[3:] == 0.0)
    ratio = z[:3] / modes.mode_shapes[:, mode - 1]
    np.testing.assert_allclose(ratio, ratio[0])
    assert z[2] > 0.0
    given = released(STOREYS, position, float(modes.angular_frequencies[mode - 1]), 0.01, 0.05)
    np.testing.assert_allclose(given, z * 0.05 / z[2])


def test_a_damper_across_the_ground_motion_moves_in_its_own_direction() -> None:
    """Of the two modes of equal frequency the first one does not move this damper."""
    omega = float(natural_modes(STOREYS).angular_frequencies[0])
    across = np.eye(6)[3]
    z = released(SQUARE, across, omega, 0.01, None)
    assert np.allclose(z[:3], 0.0) and z[3] == pytest.approx(0.01)
    np.testing.assert_allclose(calibrated_shape(SQUARE, across, omega)[:3], 0.0, atol=1e-12)
    with pytest.raises(UserError, match=r"release_top_m: the mode of the damper does not move the top, floor 3"):
        released(SQUARE, across, omega, 0.01, 0.05)
    turned = released(SQUARE.turned(90.0), across, omega, 0.01, 0.05)
    assert turned[5] == pytest.approx(0.05)
