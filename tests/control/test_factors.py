"""Factors on the gains of several dampers: the objective, and its maximum with critically damped modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.control.calibration import CalibrationOptions
from mrpipe.control.factors import best_factors, least_improvement
from mrpipe.control.placed import PlacedDamper, calibrate_placed
from mrpipe.control.together import LinearDevice, damping_together
from mrpipe.structures import shear_frame


@pytest.mark.property
def test_a_critically_damped_mode_does_not_hide_that_others_improve() -> None:
    reference = np.array([1.0, 0.25])
    assert least_improvement(np.array([1.0, 0.3]), reference) == pytest.approx(1.2)
    assert least_improvement(np.array([0.9, 0.3]), reference) == pytest.approx(0.9)
    assert least_improvement(np.array([1.0, 1.0]), reference) == 4.0
    # an unstable structure has ratios of -1
    assert least_improvement(np.array([-1.0, -1.0]), reference) == -4.0


@pytest.mark.property
def test_of_all_factors_that_damp_critically_the_smallest_are_taken() -> None:
    found = best_factors(lambda factors: np.minimum(1.0, factors), np.array([0.5, 0.5]), np.array([8.0, 8.0]))
    assert float(np.min(found)) == pytest.approx(1.0, rel=1e-6)


@pytest.mark.oracle
def test_a_mode_improves_where_another_one_is_critically_damped() -> None:
    """No point of a grid of factors is better. All factors had been 1 here."""
    frame = shear_frame([20.0] * 3, [3.0e3, 3.0e4, 3.0e4], np.full(3, 0.01), name="isolated", source="test")
    bare, places = replace(frame, damping=np.zeros((3, 3))), (np.eye(3)[0], np.array([0.0, -1.0, 1.0]))
    dampers = [PlacedDamper("isolation", places[0], "vd"), PlacedDamper("storey", places[1], "vd", mode=2)]
    found = calibrate_placed(frame, dampers, CalibrationOptions())
    alone, together = (np.array([vars(item)[key].c_n_s_m for item in found]) for key in ("alone", "together"))

    def effective(viscosities: np.ndarray) -> np.ndarray:
        devices = [LinearDevice(place, float(c)) for place, c in zip(places, viscosities, strict=True)]
        return damping_together(bare, devices, [1, 2]).effective_ratios

    reference, ratios = effective(alone), effective(together)
    best = least_improvement(ratios, reference)
    assert reference[0] > 0.9 and reference[1] < 0.6 and ratios[0] == pytest.approx(1.0)
    assert best > 1.1 * least_improvement(reference, reference)
    for centre, width in ((alone, np.log(8.0)), (together, 0.02)):
        steps = np.exp(np.linspace(-width, width, 9))
        grid = [least_improvement(effective(centre * [a, b]), reference) for a in steps for b in steps]
        assert max(grid) <= best * (1.0 + 1e-4)
