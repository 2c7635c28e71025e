"""Which of the fitted poles are modes of the structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.records import FrameTest, Place
from mrpipe.modal.search.selection import Layout, certainty, contradictory_phases, resolved_set
from mrpipe.modal.spectra import record_spectrum
from tests.modal.towers import Sensors, forced_test, random_tower

RATE = 50.0


@pytest.fixture(scope="module")
def rig():
    rng = np.random.default_rng(5)
    tower = random_tower(rng, floors=5)
    force, seen = forced_test(tower, rng, Sensors(noise=0.02), 5, rate=RATE, duration_s=200.0, kind="random")
    places = tuple(Place(floor) for floor in (1, 3, 4, 5))
    keep = [place.floor - 1 for place in places]
    test = FrameTest("random", "random", RATE, force, seen[:, keep], (False,) * 4, 5, places=places)
    spectrum = record_spectrum(test, (0.3, 1.2 * float(tower.frequencies_hz[-1])))
    return tower, fit_modes([spectrum], 2 * np.pi * tower.frequencies_hz, tower.damping_ratios, passes=2, evaluations=6)


@pytest.mark.property
def test_poles_with_real_shapes_apart_from_each_other_are_modes_whatever_their_signs(rig):
    tower, fit = rig
    layout = Layout(5, tower.mass)
    assert resolved_set(fit, layout) == {pole: pole + 1 for pole in range(5)}
    flipped = fit.residues.copy()
    flipped[:, 3] = np.abs(flipped[:, 3])
    assert resolved_set(replace(fit, residues=flipped), layout) == {pole: pole + 1 for pole in range(5)}


@pytest.mark.property
def test_a_complex_pole_or_one_inside_the_bandwidth_of_another_is_not_resolved(rig):
    tower, fit = rig
    layout = Layout(5, tower.mass)
    turned = fit.residues.copy()
    turned[:, 2] *= np.exp(1j * np.linspace(0.9, 1.5, 4))
    assert resolved_set(replace(fit, residues=turned), layout) == {}
    close = fit.angular_frequencies.copy()
    close[2] = close[1] * (1.0 + 0.5 * fit.damping_ratios[1])
    assert resolved_set(replace(fit, angular_frequencies=close), layout) == {}


@pytest.mark.property
def test_the_certainty_of_a_pole_falls_with_the_error_of_its_damping(rig):
    _, fit = rig
    covariance = fit.covariance.copy()
    covariance[5:, 5:] *= 4.0
    assert certainty(replace(fit, covariance=covariance)) == pytest.approx(0.5 * certainty(fit))


@pytest.mark.property
def test_an_uncertain_pole_whose_phases_are_no_noise_is_contradictory(rig):
    _, fit = rig
    turned = fit.residues.copy()
    turned[:, 2] = np.abs(turned[:, 2]) * np.exp(1j * np.array([0.5, -0.6, 0.7, -0.4]))
    complex_shape = replace(fit, residues=turned)
    assert not contradictory_phases(complex_shape).any()
    covariance = fit.covariance.copy()
    covariance[5:, 5:] = np.diag(np.full(5, 0.15**2))
    uncertain = replace(complex_shape, covariance=covariance)
    assert contradictory_phases(uncertain).tolist() == [False, False, True, False, False]
    # errors of the shape that are as large as its imaginary part explain it
    loud = replace(uncertain, residue_errors=np.abs(turned))
    assert not contradictory_phases(loud).any()
