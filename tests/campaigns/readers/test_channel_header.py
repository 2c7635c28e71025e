"""Sampling intervals, units and directions in COSMOS headers; the layout is that of distributed files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.readers.channel_header import channel_name, is_vertical
from mrpipe.campaigns.readers.strong_motion import read_strong_motion
from mrpipe.errors import UserError

pytestmark = pytest.mark.golden

STEP_MS, RECORDED_STEP_S, SERIAL_NUMBER = 61, 33, 41
"""Places of three of the real values, from 0."""


def cosmos(
    values: np.ndarray, seconds: int, *, unit: str = ", units=cm/sec2 (04)", peak: str = "", **reals: float
) -> str:
    """Return a channel; `reals` are `step_ms`, `recorded_step_s` and `serial_number`."""
    places = {"step_ms": STEP_MS, "recorded_step_s": RECORDED_STEP_S, "serial_number": SERIAL_NUMBER}
    header = np.full(100, -999.0)
    for name, value in reals.items():
        header[places[name]] = value
    rows = ["".join(f"{value:13.6f}" for value in header[at : at + 6]) for at in range(0, 100, 6)]
    samples = ["".join(f"{value:10.5f}" for value in values[at : at + 8]) for at in range(0, values.size, 8)]
    lines = ["Corrected acceleration    (Format v01.20 with 13 text lines)", *["text"] * 7]
    lines += ["Sta Chan  3: 90 deg (Rcrdr Chan  3) Location: Roof", f"Processed: 2019, {peak}", "text"]
    lines += ["Values used when parameter or data value is unknown/unspecified:   -999, -999.00"]
    lines += [" 100 Real-header values follow on 17 lines , Format = (6F13.6)", *rows]
    lines += [f"{values.size:8d} acceleration pts, approx {seconds:4d} secs{unit},Format=(8F10.5)", *samples]
    return "\n".join([*lines, "End-of-data for Chan  3 acceleration", ""])


def read(folder: Path, text: str) -> tuple[np.ndarray, float]:
    (folder / "a.V2c").write_text(text)
    [found] = read_strong_motion(folder / "a.V2c")
    return found.acceleration_m_s2, found.interval_s


SAMPLES = np.round(50.0 * np.sin(np.arange(588) / 9.0) * np.hanning(588), 5)


def test_a_large_number_of_the_header_touches_the_one_before_it(tmp_path: Path) -> None:
    # -999.000000426212.000000: the interval stands behind it, and 4.9 s are cut to 4
    text = cosmos(SAMPLES, 4, step_ms=1000.0 / 120.0, serial_number=426212.0)
    assert "-999.000000426212.000000" in text
    values, interval = read(tmp_path, text)
    assert interval == pytest.approx(1.0 / 120.0, rel=1e-6)
    np.testing.assert_allclose(values, 1e-2 * SAMPLES, atol=1e-12)


def test_the_interval_of_the_samples_counts_and_not_that_of_the_recorder(tmp_path: Path) -> None:
    assert read(tmp_path, cosmos(SAMPLES, 5, step_ms=10.0, recorded_step_s=0.005))[1] == pytest.approx(0.01)
    assert read(tmp_path, cosmos(SAMPLES, 6))[1] == pytest.approx(0.01), "the only usual rate of 588 samples in 6 s"


@pytest.mark.planted
def test_an_interval_is_never_guessed_from_a_rounded_duration(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"a\.V2c: real header 62: states no sampling interval, and 588 samples"):
        read(tmp_path, cosmos(SAMPLES, 4))
    with pytest.raises(UserError, match=r"real header 62: states a sampling interval of 0\.0025 s, but 588 samples"):
        read(tmp_path, cosmos(SAMPLES, 5, step_ms=2.5))


def test_units_that_only_records_use_and_the_unit_of_the_peak(tmp_path: Path) -> None:
    for unit, peak, factor in (
        (", units=mg (11)", "", 9.80665e-3),
        (", units=g (02)", "", 9.80665),
        ("", "Max =   -0.051 g  at  2.215 sec", 9.80665),
        ("", "Max =  -50.000 cm/sec2 at  2.215 sec", 1e-2),
        ("", "Uncor  Max =  -0.051 g  at  2.215 sec", 1e-2),
        ("", "", 1e-2),
    ):
        values, _ = read(tmp_path, cosmos(SAMPLES, 5, unit=unit, peak=peak, step_ms=10.0))
        np.testing.assert_allclose(values, factor * SAMPLES, rtol=1e-9, atol=1e-12)


@pytest.mark.planted
def test_a_sample_that_stands_for_an_unknown_value_is_refused(tmp_path: Path) -> None:
    gap = SAMPLES.copy()
    gap[4:7] = -999.0
    with pytest.raises(UserError, match=r"line 31: sample 5 after it is -999\.00, .* unknown value \(3 samples\)"):
        read(tmp_path, cosmos(gap, 5, step_ms=10.0))
    strong = 18.5 * SAMPLES
    strong[100] = -999.0
    assert np.abs(strong[:90]).max() < 999.0 < np.abs(strong).max() * 1.1, "a strong record may come close to it"
    assert read(tmp_path, cosmos(strong, 5, step_ms=10.0))[0][100] == pytest.approx(-9.99)


def test_a_direction_of_one_letter_is_vertical() -> None:
    for direction, vertical in (("Z", True), ("V", True), ("H1", False), ("N", False)):
        header = f"Chan  2:  {direction}         Location: Roof\n"
        assert is_vertical(channel_name(header), header) is vertical
