"""Modes that show only when all lines of the spectra are used."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.fit.multimode import fit_modes
from mrpipe.modal.records import FrameTest
from mrpipe.modal.search import hidden as search_of_hidden
from mrpipe.modal.search.forced_modes import ModeSearch
from mrpipe.modal.search.hidden import contested, with_missing_modes
from mrpipe.modal.search.selection import Layout
from mrpipe.modal.spectra import record_spectrum
from tests.modal.towers import Sensors, forced_test, hidden_modes, tower_with_hidden_modes

RATE = 50.0


@pytest.fixture(scope="module")
def rig():
    rng = np.random.default_rng(11)
    tower, floor = tower_with_hidden_modes(rng, most=1, weakest=0.15)
    force, seen = forced_test(tower, rng, Sensors(noise=0.02), floor, rate=RATE, duration_s=300.0, kind="random")
    test = FrameTest("random", "random", RATE, force, seen, (False,) * tower.floors, floor)
    return tower, floor, test


def _search(tower, test, modes, top_hz=None):
    band = (0.3, top_hz or 1.2 * float(tower.frequencies_hz[-1]))
    spectra = [record_spectrum(test, band).every(4)]
    omega = 2 * np.pi * tower.frequencies_hz[modes]
    fit = fit_modes(spectra, omega, tower.damping_ratios[modes], passes=2, evaluations=6)
    return ModeSearch(fit, band, tuple(int(i) + 1 for i in modes))


@pytest.mark.planted
def test_a_mode_without_a_peak_is_added(rig):
    tower, floor, test = rig
    hidden = hidden_modes(tower, floor)[0] - 1
    known = [i for i in range(tower.floors) if i != hidden]
    found = with_missing_modes(_search(tower, test, known), [test], Layout(tower.floors, tower.mass))
    assert found.numbers == tuple(range(1, tower.floors + 1))
    assert found.fit.angular_frequencies / (2 * np.pi) == pytest.approx(tower.frequencies_hz, rel=0.005)
    assert found.fit.damping_ratios[hidden] == pytest.approx(tower.damping_ratios[hidden], rel=0.2)


@pytest.mark.planted
def test_a_mode_above_the_band_of_the_others_is_added(rig):
    tower, _, test = rig
    known = list(range(tower.floors - 1))
    search = _search(tower, test, known, top_hz=0.5 * float(tower.frequencies_hz[-2:].sum()))
    layout = Layout(tower.floors, tower.mass)
    found = with_missing_modes(search, [test], layout)
    assert found.numbers == tuple(range(1, tower.floors + 1))
    assert found.fit.angular_frequencies[-1] / (2 * np.pi) == pytest.approx(tower.frequencies_hz[-1], rel=0.005)
    assert found.band_hz[1] > tower.frequencies_hz[-1]
    limited = with_missing_modes(search, [test], layout, high_hz=search.band_hz[1])
    assert limited.band_hz[1] <= search.band_hz[1]


@pytest.mark.planted
def test_a_spurious_pole_beside_a_strong_mode_gives_way_to_the_hidden_mode(rig):
    tower, floor, test = rig
    hidden = hidden_modes(tower, floor)[0] - 1
    search = _search(tower, test, list(range(tower.floors)))
    strong = int(np.argmax(np.abs(search.fit.residues).max(axis=0)))
    omega = np.delete(search.fit.angular_frequencies, hidden)
    zeta = np.delete(search.fit.damping_ratios, hidden)
    spurious = 1.006 * search.fit.angular_frequencies[strong]
    fit = fit_modes(search.fit.spectra, np.append(omega, spurious), np.append(zeta, 0.003), passes=2, evaluations=6)
    wrong = ModeSearch(fit, search.band_hz, search.numbers)
    layout = Layout(tower.floors, tower.mass)
    found = contested(wrong, [test], layout)
    assert found.fit.angular_frequencies / (2 * np.pi) == pytest.approx(tower.frequencies_hz, rel=0.005)
    right = contested(search, [test], layout)
    assert right.fit.angular_frequencies == pytest.approx(search.fit.angular_frequencies, rel=0.002)


@pytest.mark.planted
def test_nothing_is_added_where_the_shaker_does_not_excite_the_mode(rig):
    tower, floor, test = rig
    hidden = hidden_modes(tower, floor)[0] - 1
    known = [i for i in range(tower.floors) if i != hidden]
    rng = np.random.default_rng(2)
    search = _search(tower, test, known)
    # the response of the known modes alone, with the same noise
    spectra = search.fit.spectra[0]
    noise = test.responses.std(axis=0) * 0.02 * rng.standard_normal(test.responses.shape)
    lines = np.fft.rfftfreq(test.responses.shape[0], 1 / RATE) * 2 * np.pi
    whole = np.zeros((lines.size, tower.floors), dtype=complex)
    every = record_spectrum(test, search.band_hz)
    again = fit_modes([every], search.fit.angular_frequencies, search.fit.damping_ratios, passes=1, evaluations=1)
    whole[np.searchsorted(lines, every.omega - 1e-9)] = again.steady[0] + again.transients[0]
    assert spectra.omega.size < every.omega.size
    cleared = FrameTest(
        "random",
        "random",
        RATE,
        test.excitation,
        np.fft.irfft(whole, test.responses.shape[0], axis=0) + noise,
        test.is_displacement,
        floor,
    )
    found = with_missing_modes(search, [cleared], Layout(tower.floors, tower.mass))
    assert found.numbers == search.numbers


@pytest.mark.property
def test_the_band_of_each_test_is_searched(rig, monkeypatch):
    """A sweep that ends at 9 Hz and a random test up to 12 Hz: the sweep has only noise between 9 and 12 Hz."""
    tower, _, test = rig
    search = _search(tower, test, list(range(tower.floors - 1)))
    near = 1.25 * float(search.fit.angular_frequencies[-1]) / (2 * np.pi)
    tried = []
    monkeypatch.setattr(
        search_of_hidden, "bands_to_try", lambda *_: [(0.3, 1.5 * near), (0.3, 1.2 * near), (0.3, 0.9 * near)]
    )
    monkeypatch.setattr(search_of_hidden, "_spectra", lambda *_: ())
    monkeypatch.setattr(search_of_hidden, "_with_more", lambda wide, *_: tried.append(wide.band_hz[1]))
    with_missing_modes(search, [test], Layout(tower.floors, tower.mass))
    assert tried == pytest.approx([near, 1.2 * near, 1.5 * near])
