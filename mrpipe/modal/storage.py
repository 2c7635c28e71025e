"""Contents of frame.h5 and the summary of an identification."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray
from mrpipe.modal.clocks.delays import SensorClock
from mrpipe.modal.decays.decay import DecayResult, Estimate
from mrpipe.modal.identification import FrameIdentification
from mrpipe.structures import complex_modes, natural_modes, write_frame

_TWO_PI = 2.0 * np.pi


def _interval(estimate: Estimate, scale: float = 1.0) -> list[float]:
    return [float(estimate.low / scale), float(estimate.high / scale)]


def _decay_row(result: DecayResult) -> dict[str, Any]:
    return {
        "test": result.test,
        "mode": result.mode,
        "frequency_hz": float(result.angular_frequency / _TWO_PI),
        "logarithmic_decrement": result.logarithmic_decrement.as_dict(),
        "exponential_fit": result.exponential_fit.as_dict(),
        "point_to_point": result.point_to_point.as_dict(),
        "peak_count": int(result.peak.size),
        "band_pass": result.filtered,
    }


def summary(result: FrameIdentification) -> dict[str, Any]:
    """Return the document that `mrpipe identify-frame --json` prints, as plain numbers in SI.

    `mac` is the diagonal of `mac_matrix`: each measured shape against the same mode of the identified frame. Matrices
    are null if the data determine modes only.
    """
    frame, storeys = result.frame, result.tridiagonal
    modes = None if frame is None else natural_modes(frame)
    return {
        "frequencies_hz": [float(item.value / _TWO_PI) for item in result.frequencies],
        "damping_ratios": [float(item.value) for item in result.damping],
        "mode_shapes": _plain(result.mode_shapes),
        "mass": None if frame is None else frame.mass.tolist(),
        "damping": None if frame is None else frame.damping.tolist(),
        "stiffness": None if frame is None else frame.stiffness.tolist(),
        "mac": np.diag(result.mac).tolist(),
        "mac_matrix": result.mac.tolist(),
        "mode_numbers": list(result.numbers),
        "degrees_of_freedom": list(result.degrees_of_freedom),
        "frequency_intervals_hz": [_interval(item, _TWO_PI) for item in result.frequencies],
        "damping_ratio_intervals": [_interval(item) for item in result.damping],
        "mode_shape_errors": _plain(result.shape_errors),
        "damping_source": list(result.damping_source),
        "second_method_damping_ratios": [float(item.value) for item in result.sweep_damping],
        "second_method_damping_ratio_intervals": [_interval(item) for item in result.sweep_damping],
        "decays": [_decay_row(result.decays[mode]) for mode in sorted(result.decays)],
        # without a measured excitation there is no coherence
        "coherence_at_peaks": result.fit.mode_coherence().tolist() if result.fit.spectra else [None] * len(result.mac),
        "coherence_at_peaks_by_floor": result.fit.coherence.tolist() if result.fit.spectra else [],
        "reconstruction_error": [] if result.in_frequency is None else result.in_frequency.error.tolist(),
        "time_fit_percent": {item.test: item.fit_percent.tolist() for item in result.in_time},
        "model_frequencies_hz": [] if modes is None else modes.frequencies_hz.tolist(),
        "model_damping_ratios": [] if frame is None else complex_modes(frame).damping_ratios.tolist(),
        "floor_mass_intervals_kg": _plain(result.mass_intervals),
        "storey_stiffnesses_n_m": [] if storeys is None else storeys.storey_stiffnesses.tolist(),
        "storey_stiffness_intervals_n_m": []
        if storeys is None
        else np.column_stack([storeys.low, storeys.high]).tolist(),
        "undetermined_storeys": [] if storeys is None else list(storeys.undetermined),
        "tridiagonal_stiffness": None if storeys is None else storeys.stiffness.tolist(),
        "off_band_share": None if frame is None else off_band_share(frame.stiffness),
        "phase_scatter": result.phase_scatter.tolist(),
        "clocks": [_clock_row(item) for item in result.clocks],
        "amplitude_dependence": _over_amplitude(result),
        "stabilisation": [
            {
                "frequency_hz": float(item.angular_frequency / _TWO_PI),
                "damping_ratio": float(item.damping_ratio),
                "model_orders": int(item.occurrences),
            }
            for item in sorted(result.candidates, key=lambda item: item.angular_frequency)
        ],
        "band_hz": list(result.band_hz),
        "findings": list(result.findings),
        "doubts": list(result.doubts),
    }


def _over_amplitude(result: FrameIdentification) -> dict[str, Any] | None:
    """Return the laws of the modes over amplitude, values at the measured amplitudes, and errors on data left out."""
    found = result.amplitude
    if found is None:
        return None
    laws, smallest, largest = found.model.laws, found.model.smallest_m, found.model.largest_m
    amplitudes = np.geomspace(smallest, largest, 5)
    return {
        "measure": laws.measure,
        "frequencies_hz": (laws.angular_frequencies / _TWO_PI).tolist(),
        "damping_ratios": laws.damping_ratios.tolist(),
        "softening_exponents": laws.softening.tolist(),
        "damping_exponents": laws.damping_growth.tolist(),
        "reference_amplitudes_m": laws.references_m.tolist(),
        "seen_amplitudes_m": np.column_stack([smallest, largest]).tolist(),
        "at_amplitudes": [
            {
                "amplitudes_m": each.tolist(),
                "frequencies_hz": (laws.at(each)[0] / _TWO_PI).tolist(),
                "damping_ratios": laws.at(each)[1].tolist(),
            }
            for each in amplitudes
        ],
        "left_out": [
            {"name": name, "constant_modes_error": before, "error": after}
            for name, before, after in zip(found.left_out, found.constant_error, found.error, strict=True)
        ],
        "time_fit_percent": {item.test: item.fit_percent.tolist() for item in result.amplitude_in_time},
    }


def _plain(values: FloatArray) -> list[Any]:
    """Return nested lists with None instead of NaN, because JSON has no NaN."""
    return [[float(item) if np.isfinite(item) else None for item in row] for row in np.atleast_2d(values)]


def _clock_row(clock: SensorClock) -> dict[str, Any]:
    return {
        "test": clock.test,
        "floor": clock.sensor.floor,
        "direction": clock.sensor.direction,
        "offset_s": float(clock.offset_s),
        "offset_error_s": float(clock.offset_error_s),
        "drift": float(clock.drift),
        "step_s": float(clock.step_s),
        "step_at_s": float(clock.step_at_s),
    }


def off_band_share(stiffness: FloatArray) -> float:
    """Return the largest element of K outside the tri-diagonal band over the largest element of K [1]."""
    n = stiffness.shape[0]
    outside = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) > 1
    return float(np.abs(stiffness[outside]).max() / np.abs(stiffness).max()) if outside.any() else 0.0


def doubts_of(artifact: Artifact) -> list[str]:
    """Return the findings because of which the structure of a frame.h5 may be wrong.

    Parameters
    ----------
    artifact
        frame.h5 of an identification or of a given structure, which has none.
    """
    summary = artifact.json("summary") if "summary" in artifact else {}
    return [str(line) for line in summary.get("doubts", [])]


def write_identification(artifact: ArtifactWriter, result: FrameIdentification) -> None:
    """Write matrices, modes, decays, frequency responses and verification."""
    if result.frame is not None:
        write_frame(artifact, result.frame)
    artifact.put("modes/shapes", result.mode_shapes, unit="1", dims=("floor", "mode"))
    artifact.put("modes/mac", result.mac, unit="1", dims=("measured_mode", "frame_mode"))
    artifact.put("modes/coherence", result.fit.coherence, unit="1", dims=("sensor", "mode"))
    artifact.put("modes/number", np.asarray(result.numbers, dtype=np.float64), unit="1", dims=("mode",))
    for name, items, unit in (
        ("angular_frequency", result.frequencies, "rad/s"),
        ("damping_ratio", result.damping, "1"),
        ("sweep_damping_ratio", result.sweep_damping, "1"),
    ):
        artifact.put(f"modes/{name}", [item.value for item in items], unit=unit, dims=("mode",))
        bounds = [[item.low, item.high] for item in items]
        artifact.put(f"modes/{name}_interval", bounds, unit=unit, dims=("mode", "bound"))
    storeys = result.tridiagonal
    if storeys is not None:
        artifact.put("tridiagonal/storey_stiffness", storeys.storey_stiffnesses, unit="N/m", dims=("storey",))
        artifact.put("tridiagonal/stiffness", storeys.stiffness, unit="N/m", dims=("floor", "floor_of_cause"))
    for mode, decay in sorted(result.decays.items()):
        group = f"decays/mode_{mode}"
        artifact.put(f"{group}/peak_time", decay.peak_time_s, unit="s", dims=("peak",))
        artifact.put(f"{group}/peak", decay.peak, unit="m/s^2", dims=("peak",))
        artifact.put(f"{group}/point_to_point", decay.point_to_point_series, unit="1", dims=("pair",))
        artifact.attributes(group, test=decay.test)
    if result.amplitude is not None:
        laws = result.amplitude.model.laws
        for name, column, unit in (
            ("angular_frequency", laws.angular_frequencies, "rad/s"),
            ("damping_ratio", laws.damping_ratios, "1"),
            ("softening_exponent", laws.softening, "1"),
            ("damping_exponent", laws.damping_growth, "1"),
            ("reference", laws.references_m, "m"),
        ):
            artifact.put(f"amplitude/{name}", column, unit=unit, dims=("mode",))
        artifact.put("amplitude/largest", result.amplitude.model.largest_m, unit="m", dims=("mode",))
        artifact.attributes("amplitude", measure=laws.measure)
    responses = result.in_frequency
    if responses is not None:
        unit = "1/kg" if result.tests[0].shaker_floor else "1"
        artifact.put("responses/frequency", responses.frequency_hz, unit="Hz", dims=("line",))
        for name, values in (("measured", responses.measured), ("synthesised", responses.synthesised)):
            artifact.put(f"responses/{name}_real", values.real, unit=unit, dims=("line", "sensor"))
            artifact.put(f"responses/{name}_imaginary", values.imag, unit=unit, dims=("line", "sensor"))
    artifact.put_json("summary", summary(result))
