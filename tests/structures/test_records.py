"""Ground-motion records: formats, units, checks, resampling."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from mrpipe.artifacts import public_data_directory
from mrpipe.case_studies.motion import (
    PERIODS_S,
    SEVEN_MOTIONS,
    design_spectrum,
    load_motion,
    response_spectrum,
    spectrum_compatible_motion,
)
from mrpipe.errors import UserError
from mrpipe.structures.records import GRAVITY, GroundMotion, read_motion

TIME = np.arange(400) * 0.01
SIGNAL = 0.3 * np.sin(2.0 * np.pi * 2.0 * TIME) * np.exp(-0.5 * TIME)


def at2(path: Path, points: int | None = None, head: str = "NPTS= {n}, DT= .0100 SEC") -> Path:
    values = [f"{value:15.7E}" for value in SIGNAL]
    rows = ["".join(values[i : i + 5]) for i in range(0, len(values), 5)]
    header = ["PEER STRONG MOTION", "SOMEWHERE 1999", "ACCELERATION TIME SERIES IN UNITS OF G"]
    path.write_text("\n".join([*header, head.format(n=points or len(SIGNAL)), *rows]) + "\n")
    return path


@pytest.mark.golden
@pytest.mark.parametrize("head", ["NPTS= {n}, DT= .0100 SEC", "{n} 0.0100 NPTS, DT", "NPTS={n}, DT=0.01"])
def test_at2_in_its_dialects(tmp_path: Path, head: str) -> None:
    motion = read_motion(at2(tmp_path / "a.at2", head=head))
    assert motion.unit == "g"
    assert motion.unit_from == "header"
    assert motion.interval_s == pytest.approx(0.01)
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 0], SIGNAL * GRAVITY, rtol=1e-6, atol=1e-7)


@pytest.mark.golden
@pytest.mark.parametrize(("unit", "factor"), [("g", 1.0), ("cm/s^2", 100.0 * GRAVITY), ("m/s^2", GRAVITY)])
def test_two_columns_in_every_unit_give_the_same_motion(tmp_path: Path, unit: str, factor: float) -> None:
    path = tmp_path / "record.csv"
    rows = "\n".join(f"{t:.4f},{a:.9g}" for t, a in zip(TIME, SIGNAL * factor, strict=True))
    path.write_text(f"time [s],acceleration [{unit}]\n{rows}\n")
    motion = read_motion(path)
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 0], SIGNAL * GRAVITY, rtol=1e-6, atol=1e-9)
    path.write_text(rows + "\n")
    assert read_motion(path).unit == unit, "the peak tells where the header does not"


@pytest.mark.golden
@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("t_s,a_m_s2", "m/s^2"),
        ("time,acceleration cm/sec/sec", "cm/s^2"),
        ("t,acc in g", "g"),
        ("t,a (gal)", "cm/s^2"),
        ("t,a [m/s**2]", "m/s^2"),
        ("t [s],a [m/s\u00b2]", "m/s^2"),
        ("t [s],a [cm/sec2] (NW/SE)", "cm/s^2"),
    ],
)
def test_units_in_headers(tmp_path: Path, header: str, unit: str) -> None:
    factor = {"g": 1.0, "cm/s^2": 100.0 * GRAVITY, "m/s^2": GRAVITY}[unit]
    rows = "\n".join(f"{t:.4f},{a:.9g}" for t, a in zip(TIME, SIGNAL * factor, strict=True))
    path = tmp_path / "record.csv"
    path.write_text(f"{header}\n{rows}\n")
    motion = read_motion(path)
    assert (motion.unit, motion.unit_from) == (unit, "header")


@pytest.mark.golden
def test_further_units_and_decimal_commas(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    rows = "\n".join(f"{t:.4f};{a * 1e3 * GRAVITY:.6f}".replace(".", ",") for t, a in zip(TIME, SIGNAL, strict=True))
    path.write_text(f"Zeit [s];a [mm/s^2]\n{rows}\n")
    motion = read_motion(path)
    assert (motion.unit, motion.unit_from) == ("mm/s^2", "header")
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 0], SIGNAL * GRAVITY, rtol=1e-4, atol=1e-8)


@pytest.mark.golden
def test_decimal_commas_between_blanks_do_not_separate_columns(tmp_path: Path) -> None:
    path = tmp_path / "record.txt"
    rows = "\n".join(f"{t:.4f}\t{a * GRAVITY:.6f}".replace(".", ",") for t, a in zip(TIME, SIGNAL, strict=True))
    path.write_text(f"Zeit [s]\ta [m/s^2]\n{rows}\n")
    motion = read_motion(path)
    assert motion.components == 1
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 0], SIGNAL * GRAVITY, rtol=1e-4, atol=1e-6)


@pytest.mark.golden
def test_matlab_rows_of_time_and_acceleration(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"record": np.stack([TIME, SIGNAL * GRAVITY])})
    motion = read_motion(tmp_path / "a.mat")
    assert motion.unit == "m/s^2"
    np.testing.assert_allclose(motion.acceleration_m_s2[:, 0], SIGNAL * GRAVITY)


def spoilt(kind: str, folder: Path) -> Path:
    path = folder / f"{kind}.txt"
    rows = [f"{t:.4f} {a:.7f}" for t, a in zip(TIME, SIGNAL, strict=True)]
    if kind == "npts":
        return at2(folder / "npts.at2", points=500)
    if kind == "nan":
        rows[37] = f"{TIME[37]:.4f} nan"
    elif kind == "empty":
        rows = []
    elif kind == "word":
        rows[12] = "oops"
    elif kind == "ragged":
        rows[12] += " 0.1"
    elif kind == "clock":
        rows[200] = f"{TIME[200] + 0.004:.4f} 0.0"
    elif kind == "backwards":
        rows = [*rows[:300], *rows[250:]]
    elif kind == "shuffled":
        rows = ["t,a [g]", *[row.replace(" ", ",") for row in np.random.default_rng(0).permutation(rows)]]
    elif kind == "unknown-unit":
        rows = ["t [s],a [blah/s^2]", *[row.replace(" ", ",") for row in rows]]
    elif kind == "velocity":
        path = at2(folder / "velocity.at2")
        path.write_text(
            path.read_text().replace("ACCELERATION TIME SERIES IN UNITS OF G", "VELOCITY TIME SERIES IN UNITS OF CM/S")
        )
        return path
    elif kind == "no-header":
        path = at2(folder / "bare.at2")
        path.write_text("\n".join(path.read_text().splitlines()[4:]) + "\n")
        return path
    elif kind in ("no-array", "complex", "cube"):
        content = {"no-array": "text", "complex": np.stack([TIME, SIGNAL + 1j]), "cube": np.ones((3, 40, 2))}[kind]
        savemat(folder / f"{kind}.mat", {"record": content})
        return folder / f"{kind}.mat"
    elif kind == "suffix":
        path = folder / "record.json"
    elif kind == "units":
        rows = ["% cm/s^2 and g, in units of g", *rows]
    elif kind == "two-units":
        rows = [f"{a:.7f} {b:.7f}" for a, b in zip(SIGNAL, SIGNAL[::-1] * 980.0, strict=True)]
        rows = ["% acc in cm/s^2, dt=0.01", *rows]
    elif kind == "too-strong":
        rows = ["% in units of g", *[f"{t:.4f} {a * 980.0:.7f}" for t, a in zip(TIME, SIGNAL, strict=True)]]
    elif kind == "dt":
        rows = ["% dt=0.02", *rows]
    elif kind == "flat":
        rows = [f"{t:.4f} 0.0" for t in TIME]
        rows = ["% in units of g", *rows]
    elif kind == "ambiguous":
        rows = [f"{t:.4f} {a * 3.0:.7f}" for t, a in zip(TIME, SIGNAL, strict=True)]
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.planted
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("npts", "promises 500 points"),
        ("nan", "sample 38"),
        ("empty", "no samples"),
        ("word", "line 13"),
        ("ragged", "line 13"),
        ("clock", "not uniform"),
        ("units", "names the units"),
        ("two-units", "mixed units"),
        ("too-strong", "not a ground motion"),
        ("dt", "header says 0.02"),
        ("flat", "all samples are zero"),
        ("ambiguous", "could be g or m/s^2"),
        ("missing", "no such record"),
        ("backwards", "the clock goes from 2.99 to 2.5 s"),
        ("shuffled", "the clock goes from"),
        ("unknown-unit", "is not a unit"),
        ("velocity", "this is not an acceleration"),
        ("no-header", "has no NPTS and DT"),
        ("no-array", "no array of real numbers"),
        ("complex", "no array of real numbers"),
        ("cube", "shape (3, 40, 2)"),
        ("suffix", "a .json file is not a ground-motion record"),
    ],
)
def test_bad_records_get_one_line(tmp_path: Path, kind: str, words: str) -> None:
    path = tmp_path / "nothing.txt" if kind == "missing" else spoilt(kind, tmp_path)
    with pytest.raises(UserError) as caught:
        read_motion(path)
    message = str(caught.value)
    assert words in message
    assert str(path) in message
    assert "\n" not in message


@pytest.mark.property
@settings(max_examples=20, deadline=None)
@given(frequency=st.floats(0.5, 8.0), factor=st.sampled_from([2, 4, 5]))
def test_resampling_keeps_the_band_and_drops_what_would_fold(frequency: float, factor: int) -> None:
    interval = 0.005
    time = np.arange(4000) * interval
    nyquist = 0.5 / (interval * factor)
    kept, folded = np.sin(2 * np.pi * frequency * time), np.sin(2 * np.pi * 1.6 * nyquist * time)
    window = np.hanning(len(time))
    motion = GroundMotion("a", np.stack([kept * window, folded * window], axis=1), interval, "m/s^2", "given")
    coarse = motion.resampled(interval * factor)
    assert coarse.interval_s == pytest.approx(interval * factor)
    at = (kept * window)[::factor]
    assert np.abs(coarse.acceleration_m_s2[: len(at), 0] - at).max() < 0.02
    assert np.abs(coarse.acceleration_m_s2[:, 1]).max() < 0.02


@pytest.mark.literature
def test_synthetic_motion_follows_its_spectrum_and_comes_to_rest() -> None:
    motion = spectrum_compatible_motion(np.random.default_rng(3))
    assert motion.components == 2
    band = (PERIODS_S > 0.1) & (PERIODS_S < 3.5)
    ratio = response_spectrum(motion.acceleration_m_s2[:, 0], motion.interval_s, PERIODS_S[band])
    ratio /= design_spectrum(PERIODS_S[band], 0.3)
    assert ratio.min() > 0.8
    assert ratio.max() < 1.2
    velocity = np.cumsum(motion.acceleration_m_s2, axis=0) * motion.interval_s
    assert np.abs(velocity[-1]).max() < 0.01 * np.abs(velocity).max()
    again = spectrum_compatible_motion(np.random.default_rng(3))
    np.testing.assert_array_equal(again.acceleration_m_s2, motion.acceleration_m_s2)


@pytest.mark.oracle
def test_response_spectrum_of_a_resonant_sine() -> None:
    # steady state of an oscillator of 5 % at resonance: ten times the excitation
    time = np.arange(0.0, 60.0, 0.005)
    spectrum = response_spectrum(np.sin(2 * np.pi * time), 0.005, np.array([1.0]))
    assert spectrum[0] == pytest.approx(10.0, rel=2e-3)


@pytest.mark.real
def test_public_motions() -> None:
    if public_data_directory() is None:
        pytest.skip("the public data are not there (MRPIPE_DATA)")
    rng = np.random.default_rng(0)
    peaks = {name: load_motion(name, rng).peaks_m_s2 for name in SEVEN_MOTIONS}
    np.testing.assert_allclose(peaks["elcentro"], [3.07, 2.11], rtol=2e-3)
    assert load_motion("jiji", rng).duration_s == pytest.approx(90.0, abs=0.02)
    assert load_motion("elcentro-ns", rng).peaks_m_s2[0] == pytest.approx(0.349 * GRAVITY, rel=2e-3)


@pytest.mark.planted
def test_a_name_that_is_nearly_a_motion_is_told_the_nearest(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"neither a file nor a name.*elcentro"):
        load_motion("elcentroo", np.random.default_rng(0))
    with pytest.raises(UserError, match="no such record"):
        load_motion(str(tmp_path / "nothing.txt"), np.random.default_rng(0))
    monkeypatch.setenv("MRPIPE_DATA", str(tmp_path / "nowhere"))
    with pytest.raises(UserError, match="public data are not there"):
        load_motion("kobe", np.random.default_rng(0))


@pytest.mark.golden
def test_two_files_make_two_components(tmp_path: Path) -> None:
    first = at2(tmp_path / "h1.at2")
    second = at2(tmp_path / "h2.at2")
    motion = load_motion(str(first), np.random.default_rng(0), second_file=str(second))
    assert motion.components == 2
    np.testing.assert_array_equal(motion.acceleration_m_s2[:, 0], motion.acceleration_m_s2[:, 1])
    other = at2(tmp_path / "h3.at2", head="NPTS= {n}, DT= .0050 SEC")
    with pytest.raises(UserError, match="first component"):
        load_motion(str(first), np.random.default_rng(0), second_file=str(other))
    alone = read_motion(first).in_components(2)
    assert alone.peaks_m_s2[1] == 0.0
    assert "the others are zero" in alone.notes[-1]
