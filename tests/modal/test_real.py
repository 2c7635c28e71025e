"""A measured three-storey model on a small shaking table."""

from __future__ import annotations

import contextlib
import io
import logging
from dataclasses import replace

import numpy as np
import pytest

from mrpipe.campaigns import load_campaign
from mrpipe.modal.identify import identify_frame
from mrpipe.modal.records import frame_tests


@pytest.fixture(scope="module")
def northridge(public_data):
    tests = frame_tests(load_campaign(public_data / "shake3_flexible"))
    own = [test for test in tests.forced if test.name == "northridge"]
    return replace(tests, forced=tuple(own))


@pytest.fixture(scope="module")
def result(northridge):
    return identify_frame(northridge)


@pytest.mark.real
@pytest.mark.oracle
def test_one_earthquake_record_gives_the_poles_that_pyoma2_gives(northridge, result):
    ssi = pytest.importorskip("pyoma2.functions.ssi", reason="pyOMA2 is not installed")
    test = northridge.forced[0]
    responses = (test.responses - test.responses.mean(axis=0)).T
    logging.getLogger("pyoma2").setLevel(logging.ERROR)
    with contextlib.redirect_stderr(io.StringIO()):
        hankel, _ = ssi.build_hank(
            responses, responses, 30, "IOcov", U=(test.excitation - test.excitation.mean())[None]
        )
        _, state, _, _ = ssi.SSI_fast(hankel, 30, 12)
    poles = np.log(np.linalg.eigvals(state[12]).astype(complex)) * test.sampling_rate_hz
    for frequency, damping in zip(result.frequencies, result.damping, strict=True):
        nearest = poles[np.argmin(np.abs(np.abs(poles) - frequency.value) + 1e6 * (poles.imag < 0))]
        assert frequency.value == pytest.approx(abs(nearest), rel=0.005)
        assert damping.value == pytest.approx(-nearest.real / abs(nearest), rel=0.15)


@pytest.mark.real
@pytest.mark.golden
def test_three_modes_real_shapes_and_a_late_clock(result):
    hertz = [item.value / (2 * np.pi) for item in result.frequencies]
    assert hertz == pytest.approx([3.69, 11.12, 16.60], rel=0.005)
    late = {item.sensor.floor: item.offset_s for item in result.clocks}
    assert late == {3: pytest.approx(2e-3, abs=3e-4)}
    assert result.phase_scatter[:2].max() < 0.03
    # one linear model for all amplitudes: this is what it reaches
    assert result.in_time[0].fit_percent.min() > 65.0
