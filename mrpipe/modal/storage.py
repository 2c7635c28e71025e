"""What identification leaves in frame.h5, and its summary."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrpipe.artifacts import ArtifactWriter
from mrpipe.modal.decay import DecayResult, Estimate
from mrpipe.modal.identify import FrameIdentification
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
    """Return what `mrpipe identify-frame --json` prints (contract, section 4, and more), plain numbers in SI.

    `mac` is the diagonal of `mac_matrix`: each measured shape against the same mode of the identified frame.
    """
    modes = natural_modes(result.frame)
    return {
        "frequencies_hz": [float(item.value / _TWO_PI) for item in result.frequencies],
        "damping_ratios": [float(item.value) for item in result.damping],
        "mode_shapes": result.mode_shapes.tolist(),
        "mass": result.frame.mass.tolist(),
        "damping": result.frame.damping.tolist(),
        "stiffness": result.frame.stiffness.tolist(),
        "mac": np.diag(result.mac).tolist(),
        "mac_matrix": result.mac.tolist(),
        "frequency_intervals_hz": [_interval(item, _TWO_PI) for item in result.frequencies],
        "damping_ratio_intervals": [_interval(item) for item in result.damping],
        "damping_source": list(result.damping_source),
        "second_method_damping_ratios": [float(item.value) for item in result.sweep_damping],
        "second_method_damping_ratio_intervals": [_interval(item) for item in result.sweep_damping],
        "decays": [_decay_row(result.decays[mode]) for mode in sorted(result.decays)],
        "coherence_at_peaks": result.fit.mode_coherence().tolist(),
        "coherence_at_peaks_by_floor": result.fit.coherence.tolist(),
        "reconstruction_error": result.in_frequency.error.tolist(),
        "time_fit_percent": {item.test: item.fit_percent.tolist() for item in result.in_time},
        "model_frequencies_hz": modes.frequencies_hz.tolist(),
        "model_damping_ratios": complex_modes(result.frame).damping_ratios.tolist(),
        "storey_stiffnesses_n_m": result.tridiagonal.storey_stiffnesses.tolist(),
        "storey_stiffness_intervals_n_m": np.column_stack([result.tridiagonal.low, result.tridiagonal.high]).tolist(),
        "tridiagonal_stiffness": result.tridiagonal.stiffness.tolist(),
        "off_band_share": off_band_share(result),
        "phase_scatter": result.phase_scatter.tolist(),
        "band_hz": list(result.band_hz),
        "findings": list(result.findings),
    }


def off_band_share(result: FrameIdentification) -> float:
    """Return the largest element of K outside the tri-diagonal band over the largest of all [1]."""
    stiffness = result.frame.stiffness
    n = stiffness.shape[0]
    outside = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) > 1
    return float(np.abs(stiffness[outside]).max() / np.abs(stiffness).max()) if outside.any() else 0.0


def write_identification(artifact: ArtifactWriter, result: FrameIdentification) -> None:
    """Write matrices, modes, decays, frequency responses and verification."""
    write_frame(artifact, result.frame)
    artifact.put("modes/shapes", result.mode_shapes, unit="1", dims=("floor", "mode"))
    artifact.put("modes/mac", result.mac, unit="1", dims=("measured_mode", "frame_mode"))
    artifact.put("modes/coherence", result.fit.coherence, unit="1", dims=("floor", "mode"))
    for name, items, unit in (
        ("angular_frequency", result.frequencies, "rad/s"),
        ("damping_ratio", result.damping, "1"),
        ("sweep_damping_ratio", result.sweep_damping, "1"),
    ):
        artifact.put(f"modes/{name}", [item.value for item in items], unit=unit, dims=("mode",))
        bounds = [[item.low, item.high] for item in items]
        artifact.put(f"modes/{name}_interval", bounds, unit=unit, dims=("mode", "bound"))
    storeys = result.tridiagonal
    artifact.put("tridiagonal/storey_stiffness", storeys.storey_stiffnesses, unit="N/m", dims=("storey",))
    artifact.put("tridiagonal/stiffness", storeys.stiffness, unit="N/m", dims=("floor", "floor_of_cause"))
    for mode, decay in sorted(result.decays.items()):
        group = f"decays/mode_{mode}"
        artifact.put(f"{group}/peak_time", decay.peak_time_s, unit="s", dims=("peak",))
        artifact.put(f"{group}/peak", decay.peak, unit="m/s^2", dims=("peak",))
        artifact.put(f"{group}/point_to_point", decay.point_to_point_series, unit="1", dims=("pair",))
        artifact.attributes(group, test=decay.test)
    responses = result.in_frequency
    unit = "1/kg" if result.tests[0].shaker_floor else "1"
    artifact.put("responses/frequency", responses.frequency_hz, unit="Hz", dims=("line",))
    for name, values in (("measured", responses.measured), ("synthesised", responses.synthesised)):
        artifact.put(f"responses/{name}_real", values.real, unit=unit, dims=("line", "floor"))
        artifact.put(f"responses/{name}_imaginary", values.imag, unit=unit, dims=("line", "floor"))
    artifact.put_json("summary", summary(result))
