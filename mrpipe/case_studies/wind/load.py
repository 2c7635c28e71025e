"""Across-wind loads on a tall building by spectral representation, or from a user's file.

Two sources of force act on each floor: vortex shedding (spectrum and correlation of Vickery and Clark 1972: narrow
about the local Strouhal frequency, correlated over a few widths) and lateral turbulence (Kaimal's spectrum, Davenport's
exponential coherence). All numbers are settings; none claims to be the wind-tunnel record of the benchmark, which is
not public.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.case_studies.options import WindClimate
from mrpipe.errors import UserError
from mrpipe.units import to_si

AIR_DENSITY = 1.2
"""kg/m^3."""


@dataclass(frozen=True)
class WindLoad:
    """Forces on the floors.

    Attributes
    ----------
    name
        `synthetic` or that of the file.
    forces_n
        Shape (n, floors) [N].
    interval_s
        Sampling interval [s].
    """

    name: str
    forces_n: FloatArray
    interval_s: float

    @property
    def duration_s(self) -> float:
        """Length [s]."""
        return (len(self.forces_n) - 1) * self.interval_s


def mean_speed(heights_m: FloatArray, climate: WindClimate, top_m: float) -> FloatArray:
    """Return the mean wind [m/s] at heights, shape (n,)."""
    return np.asarray(climate.top_speed_m_s * (np.asarray(heights_m) / top_m) ** climate.profile_exponent)


def shedding_spectrum(frequency_hz: FloatArray, speed_m_s: float, width_m: float, climate: WindClimate) -> FloatArray:
    """Return the one-sided spectrum [1/Hz] of the lift coefficient over its variance (integral 1 over n > 0)."""
    centre = climate.strouhal_number * speed_m_s / width_m
    b = climate.bandwidth
    shape = np.exp(-(((1.0 - frequency_hz / centre) / b) ** 2)) / (np.sqrt(np.pi) * b * centre)
    return np.asarray(shape)


def lateral_spectrum(frequency_hz: FloatArray, height_m: float, speed_m_s: float) -> FloatArray:
    """Return the one-sided spectrum [1/Hz] of lateral turbulence over its variance: Kaimal's form, integral 1."""
    f = frequency_hz * height_m / speed_m_s
    # the integral of 17/(1 + 9.5 f)^(5/3) over f is 17 * 3/(2 * 9.5)
    return np.asarray(17.0 / (1.0 + 9.5 * f) ** (5.0 / 3.0) * height_m / speed_m_s / (17.0 * 1.5 / 9.5))


def shedding_correlation(heights_m: FloatArray, width_m: float) -> FloatArray:
    """Return the correlation of shedding forces between heights, shape (n, n) (Vickery and Clark)."""
    r = np.abs(heights_m[:, None] - heights_m[None, :]) / width_m
    return np.asarray(np.cos(2.0 / 3.0 * r) * np.exp(-((r / 3.0) ** 2)))


def _square_root(correlation: FloatArray) -> FloatArray:
    """Return a matrix L with L L' = correlation (its tiny negative eigenvalues taken as none)."""
    values, vectors = np.linalg.eigh(correlation)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def synthetic_wind(
    rng: np.random.Generator,
    floors: int,
    height_m: float,
    width_m: float,
    *,
    duration_s: float = 900.0,
    interval_s: float = 0.05,
    climate: WindClimate | None = None,
) -> WindLoad:
    """Return across-wind forces of a Gaussian process with the given spectra and correlation, seeded.

    Parameters
    ----------
    rng
        Source of the amplitudes.
    floors, height_m, width_m
        Number of floors, height and width of the building.
    duration_s, interval_s
        Length and sampling interval [s].
    climate
        Parameters of the wind.
    """
    climate = climate or WindClimate()
    samples = round(duration_s / interval_s) + 1
    period = 2 * samples
    heights = (np.arange(floors) + 1.0) * height_m / floors
    speeds = mean_speed(heights, climate, height_m)
    frequency: FloatArray = np.asarray(np.fft.rfftfreq(period, interval_s)[1:], dtype=np.float64)
    # of a record of `period` samples each line has the variance S df; half of it is kept, so that the ends do not join
    amplitude = period * np.sqrt(0.5 / (period * interval_s))
    pressure = 0.5 * AIR_DENSITY * speeds**2 * width_m * height_m / floors

    def noise() -> FloatArray:
        shape = (len(frequency), floors)
        return np.asarray((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0))

    shedding = noise() @ _square_root(shedding_correlation(heights, width_m)).T
    turbulence = noise()
    spread = climate.decay * frequency[:, None] * (height_m / floors) / (0.5 * (speeds[1:] + speeds[:-1]))
    for floor in range(1, floors):
        kept = np.exp(-spread[:, floor - 1])
        turbulence[:, floor] = kept * turbulence[:, floor - 1] + np.sqrt(1.0 - kept**2) * turbulence[:, floor]
    lines = np.zeros((len(frequency) + 1, floors), dtype=np.complex128)
    for floor in range(floors):
        vortex = climate.lift_coefficient**2 * shedding_spectrum(frequency, speeds[floor], width_m, climate)
        intensity = climate.lateral_intensity * climate.top_speed_m_s / speeds[floor]
        lateral = (climate.lateral_coefficient * intensity) ** 2
        lateral = lateral * lateral_spectrum(frequency, float(heights[floor]), float(speeds[floor]))
        lines[1:, floor] = (
            amplitude
            * pressure[floor]
            * (np.sqrt(vortex) * shedding[:, floor] + np.sqrt(lateral) * turbulence[:, floor])
        )
    forces = np.fft.irfft(lines, period, axis=0)[:samples]
    return WindLoad("synthetic", np.asarray(forces), interval_s)


def read_wind(path: Path, floors: int, *, unit: str = "kN", interval_s: float | None = None) -> WindLoad:
    """Read forces on the floors: text or csv (a row a sample), `.mat` or `.npy` (one matrix); a clock may come first.

    Parameters
    ----------
    path
        The file.
    floors
        Columns expected, one more with a clock.
    unit
        Unit of the forces.
    interval_s
        Sampling interval if the file has no clock [s].

    Raises
    ------
    UserError
        If the file is missing, not a matrix of finite numbers with this number of columns, or its interval is unknown.
        For text, the message names line and column.
    """
    path = Path(path)
    if not path.is_file():
        raise UserError(path, "", "no such wind record", "give a file of floor forces, or `synthetic`")
    values = _matrix(path)
    if values.ndim == 2 and values.shape[1] not in (floors, floors + 1) and values.shape[0] in (floors, floors + 1):
        values = values.T
    if values.ndim != 2 or values.shape[1] not in (floors, floors + 1) or len(values) < 10:
        raise UserError(path, "", f"has shape {values.shape}", f"{floors} columns, or {floors + 1} with a clock")
    bad = np.argwhere(~np.isfinite(values))
    if len(bad):
        raise UserError(
            path, f"row {int(bad[0][0]) + 1}, column {int(bad[0][1]) + 1}", "is not finite", "correct the row"
        )
    if values.shape[1] == floors + 1:
        steps = np.diff(values[:, 0])
        if steps.min() <= 0.0 or np.ptp(steps) > 0.02 * steps.mean():
            raise UserError(path, "column 1", "the clock is not uniform", "equal steps of time")
        interval_s, values = float(steps.mean()), values[:, 1:]
    if interval_s is None:
        raise UserError(path, "interval", "the file has no clock", "give benchmark.wind.load.interval_s")
    return WindLoad(path.stem, to_si(values, unit, where=str(path), quantity="force"), interval_s)


def _matrix(path: Path) -> FloatArray:
    """Return the matrix in a file, of any shape."""
    readers = {".npy": _numpy_array, ".mat": _matlab_array}
    return readers.get(path.suffix.lower(), _rows_of_text)(path)


def _numpy_array(path: Path) -> FloatArray:
    try:
        return np.asarray(np.load(path, allow_pickle=False), dtype=np.float64)
    except (OSError, ValueError, TypeError) as error:
        raise UserError(
            path, "", f"is not an array of numbers ({error})", "store one matrix, a row a sample"
        ) from error


def _matlab_array(path: Path) -> FloatArray:
    from scipy.io import loadmat

    try:
        content = loadmat(path)
    except Exception as error:  # scipy raises half a dozen kinds for a bad file
        raise UserError(path, "", f"not a MATLAB file that can be read ({error})", "save it as version 7") from error
    arrays = [np.asarray(value) for key, value in content.items() if not key.startswith("__")]
    arrays = [array for array in arrays if array.dtype.kind in "fiu"]
    if not arrays:
        raise UserError(path, "", "holds no array of real numbers", "store one matrix, a row a sample")
    return np.asarray(max(arrays, key=np.size), dtype=np.float64)


def _rows_of_text(path: Path) -> FloatArray:
    """Return the rows of a text; blank lines and those that begin with % or # are left out."""
    rows: list[list[float]] = []
    for number, line in enumerate(path.read_text(encoding="latin-1").splitlines(), start=1):
        words = line.replace(",", " ").replace(";", " ").split()
        if not words or words[0][0] in "%#":
            continue
        rows.append([_number(path, word, number, column) for column, word in enumerate(words, start=1)])
        if len(words) != len(rows[0]):
            problem = f"has {len(words)} numbers, the first row {len(rows[0])}"
            raise UserError(path, f"line {number}", problem, "write a force for each floor in each row")
    return np.array(rows)


def _number(path: Path, word: str, line: int, column: int) -> float:
    try:
        value = float(word)
    except ValueError:
        value, problem = np.nan, f"{word[:30]!r} is not a number"
    else:
        problem = "is not finite"
    if not np.isfinite(value):
        raise UserError(path, f"line {line}, column {column}", problem, "write a force in each column")
    return value
