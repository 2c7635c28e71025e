"""Damping of ambient modes by maximum likelihood, and the band in which sensors move together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.modal.ambient.band import common_motion_ends_hz
from mrpipe.modal.ambient.refine import refine_by_spectra
from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.records import FrameTest, Place
from mrpipe.modal.spectra import record_spectrum
from tests.modal.towers import Sensors, ambient_test, random_tower

RATE = 50.0


@pytest.fixture(scope="module")
def tower():
    return random_tower(np.random.default_rng(4), floors=4)


@pytest.fixture(scope="module")
def ambient(tower):
    seen = ambient_test(
        tower, np.random.default_rng(7), Sensors(noise=0.03, crosstalk=0.03), rate=RATE, duration_s=1800
    )
    places = tuple(Place(i + 1) for i in range(tower.floors))
    return FrameTest("ambient", "ambient", RATE, None, seen, (False,) * tower.floors, places=places)


def _wrong_fit(tower, ambient, factors):
    """Modes with the true shapes, and damping that is wrong by a factor each."""
    forced = replace(ambient, kind="random", excitation=ambient.responses[:, 0])
    spectra = [record_spectrum(forced, (0.5 * tower.frequencies_hz[0], 1.1 * tower.frequencies_hz[-1])).every(20)]
    fit = fit_modes(spectra, 2 * np.pi * tower.frequencies_hz, tower.damping_ratios, passes=1, evaluations=1)
    return replace(
        fit,
        angular_frequencies=2 * np.pi * tower.frequencies_hz * 1.003,
        damping_ratios=tower.damping_ratios * factors,
        residues=tower.shapes.astype(np.complex128),
    )


@pytest.mark.planted
def test_damping_that_is_wrong_by_factors_is_corrected_and_its_interval_holds(tower, ambient):
    fit = refine_by_spectra(_wrong_fit(tower, ambient, np.array([0.3, 3.0, 0.25, 2.0])), [ambient])
    assert fit.angular_frequencies / (2 * np.pi) == pytest.approx(tower.frequencies_hz, rel=0.005)
    assert fit.damping_ratios == pytest.approx(tower.damping_ratios, rel=0.25)
    errors = np.sqrt(np.diag(fit.covariance))[tower.floors :]
    apart = np.abs(np.log(fit.damping_ratios / tower.damping_ratios))
    assert np.all(apart < 3.5 * errors)
    assert np.all(errors < 0.2)


@pytest.mark.planted
def test_the_first_damping_ratio_is_nearly_as_certain_as_the_record_allows(tower, ambient):
    """A narrow band about the peak could not separate damping from noise: 2.2 times the least error of 16 %."""
    fit = refine_by_spectra(_wrong_fit(tower, ambient, np.ones(4)), [ambient])
    # the least relative standard error, for a force whose level is known (Au 2014)
    least = 1.0 / np.sqrt(2.0 * np.pi * tower.frequencies_hz[0] * tower.damping_ratios[0] * ambient.duration_s)
    error = np.sqrt(fit.covariance[4, 4])
    assert least < error < 1.35 * least
    assert abs(np.log(fit.damping_ratios[0] / tower.damping_ratios[0])) < 3.0 * error


@pytest.mark.planted
def test_the_band_reaches_beyond_the_highest_mode(tower, ambient):
    end = common_motion_ends_hz(ambient, float(tower.frequencies_hz[0]))
    assert end > tower.frequencies_hz[-1]
    # sensors that show nothing but their own noise have no motion in common
    noise = replace(ambient, responses=np.random.default_rng(1).standard_normal(ambient.responses.shape))
    assert common_motion_ends_hz(noise, 1.0) < 3.0


@pytest.mark.planted
def test_a_force_whose_spectrum_falls_with_frequency_does_not_move_a_mode():
    """Wind has less power above the peak than below it; a flat force made the frequency 0.4 % too low."""
    frequency, zeta, count = 5.0, 0.02, 1 << 16
    lines = np.fft.rfftfreq(count, 1.0 / RATE)[1:]
    ratio = lines / frequency
    # the response of the mode to a force whose density falls with the third power of the frequency
    transfer = -(ratio**2) / (1.0 - ratio**2 + 2j * zeta * ratio) * ratio**-1.5
    rng = np.random.default_rng(11)

    def record(name):
        white = rng.standard_normal(lines.size) + 1j * rng.standard_normal(lines.size)
        seen = np.fft.irfft(np.concatenate([[0.0], transfer * white]), count)[:, None]
        return FrameTest(name, "ambient", RATE, None, seen, (False,), places=(Place(1),))

    tests = [record(f"night {night}") for night in range(8)]
    forced = replace(tests[0], kind="random", excitation=tests[0].responses[:, 0])
    start = fit_modes([record_spectrum(forced, (4.0, 6.0)).every(20)], 2 * np.pi * np.array([frequency]),
                      np.array([zeta]), passes=1, evaluations=1)  # fmt: skip
    start = replace(start, angular_frequencies=2 * np.pi * np.array([frequency]), damping_ratios=np.array([zeta]),
                    residues=np.ones((1, 1), dtype=np.complex128))  # fmt: skip
    fit = refine_by_spectra(start, tests)
    errors = np.sqrt(np.diag(fit.covariance))
    assert errors[0] < 1e-3
    assert abs(np.log(fit.angular_frequencies[0] / (2 * np.pi * frequency))) < 3.0 * errors[0]
    assert abs(np.log(fit.damping_ratios[0] / zeta)) < 3.0 * errors[1]


@pytest.mark.planted
def test_ground_motion_whose_spectrum_falls_does_not_lower_the_frequencies():
    """The power of the response to one impulse through soil is the exact spectral density, without any scatter.

    The soil is that of Kanai and Tajimi, with a natural frequency below that of the modes. Frequencies were up to 0.5 %
    too low, because the model expected a flat spectrum of the ground.
    """
    slow = random_tower(np.random.default_rng(23), floors=3, damping=(0.03, 0.04))
    tower = replace(slow, stiffness=9.0 * slow.stiffness)
    samples = round(240.0 * RATE)
    frequency = np.fft.rfftfreq(samples, 1.0 / RATE)
    line, soil = 2 * np.pi * frequency[:, None], 2 * np.pi * 1.5
    omega, zeta = 2 * np.pi * tower.frequencies_hz, tower.damping_ratios
    moved = [(own**2 + 2j * z * own * line) / (own**2 - line**2 + 2j * z * own * line)
             for own, z in ((soil, 0.6), *zip(omega, zeta, strict=True))]  # fmt: skip
    factors = tower.shapes.T @ tower.mass
    spectrum = moved[0] * (np.hstack(moved[1:]) @ (tower.shapes * factors).T) * np.exp(-1j * line * 20.0)
    seen = np.fft.irfft(spectrum, samples, axis=0)
    seen += 1e-4 * seen.std(axis=0) * np.random.default_rng(0).standard_normal(seen.shape)
    places = tuple(Place(i + 1) for i in range(tower.floors))
    quake = FrameTest("quake", "ambient", RATE, None, seen, (False,) * tower.floors, places=places)
    fit = refine_by_spectra(_wrong_fit(tower, quake, np.ones(3)), [quake])
    assert fit.angular_frequencies == pytest.approx(omega, rel=1.5e-3)
    assert fit.damping_ratios == pytest.approx(zeta, rel=0.05)
    # as uncertain as an earthquake of some ten seconds
    assert np.sqrt(np.diag(fit.covariance))[: tower.floors].min() > 5e-3
