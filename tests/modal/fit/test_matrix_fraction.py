"""Poles of a matrix-fraction model: exact without noise, and close modes that a common denominator merges."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.fit.lscf import stable_poles
from mrpipe.modal.fit.matrix_fraction import _divided, matrix_orders, stable_matrix_poles
from mrpipe.modal.spectra import record_spectrum
from tests.modal.plates import building, shaken


def _light(candidates):
    """Return the poles of most orders with a damping ratio that a structure can have."""
    return [item for item in candidates if item.occurrences >= 5 and item.damping_ratio < 0.05]


@pytest.mark.planted
def test_close_modes_are_resolved_by_their_shapes() -> None:
    """In this building the modes at 5.60 and 5.62 Hz, and those at 2.89 and 2.93 Hz, overlap (1 % damping)."""
    rng = np.random.default_rng(103)
    tower = building(rng, 4)
    test = shaken(tower, rng, rate=50.0, duration_s=300.0).forced[0]
    band = (0.0, 2.0 * np.pi * 19.0)
    spectra = [record_spectrum(test, (0.2, 19.0))]
    found = _light(stable_matrix_poles(spectra, matrix_orders(spectra, 12), band))
    frequency = np.array([item.angular_frequency for item in found]) / (2.0 * np.pi)
    damping = np.array([item.damping_ratio for item in found])
    assert frequency == pytest.approx(tower.frequencies_hz, rel=2e-3)
    # the response of the highest mode is near the noise, which makes its damping ratio of a linear estimate too large
    assert damping[:-1] == pytest.approx(tower.damping_ratios[:-1], rel=0.25)
    common = _light(stable_poles(spectra, range(26, 44, 2), band))
    assert len(common) < 12, "a common denominator shows all modes: the case no longer tests what it should"


@pytest.mark.property
def test_there_are_no_more_coefficients_than_the_lines_determine() -> None:
    test = shaken(building(np.random.default_rng(1), 3), np.random.default_rng(2), rate=50.0, duration_s=60.0).forced[0]
    spectrum = record_spectrum(test, (0.2, 19.0))
    assert matrix_orders([spectrum], 9) == range(3, 12)
    short = record_spectrum(
        replace(
            test,
            responses=test.responses[:300],
            excitation=test.excitation[:300],
            further_inputs=tuple((p, v[:300]) for p, v in test.further_inputs),
        ),
        (0.2, 19.0),
    )
    assert matrix_orders([short], 9) == range(3, 10)
    single = replace(test, responses=test.responses[:, :1], places=test.places[:1], is_displacement=(False,))
    assert len(matrix_orders([record_spectrum(single, (0.2, 19.0))], 9)) == 0
    assert len(matrix_orders([spectrum, record_spectrum(single, (0.2, 19.0))], 9)) == 0, "one common sensor"


@pytest.mark.property
def test_a_group_is_divided_where_most_orders_have_several_poles_in_it() -> None:
    pair = [(1.0, 0.01, order) for order in range(5)] + [(1.002, 0.02, order) for order in range(4)]
    first, second = _divided([*pair, (1.001, 0.5, 7)])
    assert [item[2] for item in first] == [item[2] for item in second] == [0, 1, 2, 3]
    assert {item[:2] for item in first} == {(1.0, 0.01)} and {item[:2] for item in second} == {(1.002, 0.02)}
    single = [(1.0, 0.01, order) for order in range(5)] + [(1.001, 0.02, 4)]
    assert _divided(single) == [single]
    # as many orders with one pole as with three: the poles stay together or are divided, but none is lost
    mixed = [(1.0, 0.01, 0), (1.0, 0.01, 1), (1.001, 0.01, 1), (1.002, 0.01, 1)]
    assert all(len(part) > 0 for part in _divided(mixed))
