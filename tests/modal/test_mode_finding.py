"""The modes from forced tests, or from ambient tests if no test is forced."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.modal.mode_finding import find_modes
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.recordings import frame_tests
from mrpipe.modal.search.selection import Layout
from mrpipe.structures import complex_modes
from tests.modal.rig import Rig, campaign_of, full_set, random_frame

RIG = Rig(noise=0.01, rate=250.0, sweep_s=60.0, decay_s=20.0)


@pytest.fixture(scope="module")
def recorded():
    rng = np.random.default_rng(5)
    frame = random_frame(rng, 3)
    tests = frame_tests(campaign_of(frame, full_set(frame, rng, RIG), Path("planted")))
    return complex_modes(frame), tests, Layout(3, tests.floor_masses, is_chain=True)


@pytest.mark.planted
def test_forced_tests_determine_the_modes_and_stay_with_them(recorded):
    modes, tests, layout = recorded
    said = []
    chosen, clocks, _ = find_modes(
        tests, tests.forced, layout, IdentificationOptions(), lambda share, text: said.append(text)
    )
    assert chosen.search.fit.angular_frequencies == pytest.approx(modes.angular_frequencies[:3], rel=2e-3)
    assert {test.name for test in chosen.tests} <= {test.name for test in tests.forced} and chosen.tests
    assert clocks == () and "hidden modes" not in said


@pytest.mark.planted
def test_without_forced_tests_the_modes_come_from_ambient_tests(recorded):
    modes, tests, layout = recorded
    ambient = tuple(replace(test, excitation=None) for test in tests.forced)
    without_input = replace(tests, forced=(), ambient=ambient, decays=())
    chosen, _, findings = find_modes(without_input, (), layout, IdentificationOptions())
    assert chosen.search.fit.angular_frequencies == pytest.approx(modes.angular_frequencies[:3], rel=0.01)
    assert chosen.tests == () and any("from the responses alone" in line for line in findings)


@pytest.mark.property
def test_peaks_are_picked_instead_of_the_fit_on_request(recorded):
    _, tests, layout = recorded
    options = IdentificationOptions(clock_correction=False)
    fitted, _, _ = find_modes(tests, tests.forced, layout, options)
    picked, _, _ = find_modes(tests, tests.forced, layout, options.model_copy(update={"modes_from": "peak-picking"}))
    assert picked.search.band_hz == fitted.search.band_hz
    assert not np.array_equal(picked.search.fit.residues, fitted.search.fit.residues)
