"""Chapter 2: the forces of the damper, the signals, the networks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray, load_parameter_set
from mrpipe.dampers.model import DamperModel, bouc_wen_limits, damper_from_parameter_set
from mrpipe.networks.assembly import read_history
from mrpipe.networks.evaluation import Judgement, error_figures, judge
from mrpipe.networks.network import Network, read_network
from mrpipe.networks.options import ViscousEmulationOptions
from mrpipe.networks.tracking import emulate_viscous
from mrpipe.signals.prepared import PreparedTest, read_prepared
from mrpipe.thesis.bench import Bench
from mrpipe.thesis.claim import Missing, Outcomes, Value
from mrpipe.units import same_unit_dimension
from mrpipe.words import in_percent

FREQUENCIES_HZ = (0.5, 1.0, 1.27, 1.8, 2.2)
AMPLITUDES_M = (5e-3, 10e-3)
SLOW_M_S = 0.05
"""Speed above which the thesis calls the emulation of viscous damping accurate (section 2.4.3)."""
_RATE = 4000.0
_CYCLES = 3
_NO_RUN = "it needs a run (reproduce.source: run)"


def _motion(amplitude: float, frequency: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    time = np.arange(int(_CYCLES * _RATE / frequency)) / _RATE
    w = 2.0 * np.pi * frequency
    return amplitude * np.sin(w * time), amplitude * w * np.cos(w * time), -amplitude * w * w * np.sin(w * time)


def peak_forces(model: DamperModel, drive: float) -> FloatArray:
    """Return the peak force [N] at constant drive in every motion of Table 2.1, ascending, shape (10,)."""
    peaks = []
    for amplitude in AMPLITUDES_M:
        for frequency in FREQUENCIES_HZ:
            x, v, a = _motion(amplitude, frequency)
            force = model.force(x, v, a, np.full(x.size, drive), 1.0 / _RATE)
            peaks.append(float(np.abs(force[-int(_RATE / frequency) :]).max()))
    return np.sort(np.array(peaks))


def _ends(values: FloatArray) -> FloatArray:
    return values[[0, -1]]


def unit_of_gamma(n: int) -> str:
    """Return the unit with which gamma |v| |z|^(n-1) z of (2.2) is a velocity, as Table 2.2 writes units."""
    units = ("1", *(f"1/{base}^{power}" for base in ("m", "s") for power in (1, 2, 3)))
    return next(unit for unit in units if same_unit_dimension(f"({unit})*(m/s)*m^{n}", "m/s"))


def _parameter_sets() -> Outcomes:
    printed = load_parameter_set("dampers", "thesis-printed")
    model = damper_from_parameter_set(printed)
    limits = bouc_wen_limits(*(printed.scalar(name) for name in ("A", "gamma", "beta", "n")))
    by = "parameters of Table 2.2"
    small = (
        f"the largest hysteretic displacement is {limits[0]:.4g} m; no single change of Table 2.2 corrects both ends"
    )
    set_c = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    found: Outcomes = {
        "A1a": Value(_ends(peak_forces(model, 0.0)), by, small),
        "A1b": Value(peak_forces(model, model.drive_limit)[-1], by, small),
        "A1c": Value(limits[0], by),
        "A2": Value(unit_of_gamma(int(printed.scalar("n"))), "units of the terms of (2.2)"),
        "C-yield": Value(set_c.parameters["yield_displacement"], "damper set C"),
    }
    for drive in range(5):
        found[f"C{drive}"] = Value(_ends(peak_forces(set_c, float(drive))), "damper set C")
    return found


def _damper(bench: Bench) -> Outcomes:
    damper = bench.rig.damper
    by = f"damper of {bench.source}"
    residual = peak_forces(damper, 0.0)
    return {
        "R2-residual": Value(_ends(residual), by),
        "R2-largest": Value(peak_forces(damper, damper.drive_limit)[-1], by),
        "A22a": Value(float(np.median(residual)), by),
    }


def velocity_amplitude(test: PreparedTest) -> float:
    """Return the amplitude of the velocity of a periodic test at its own frequency [m/s].

    It is the first Fourier coefficient over the steady cycles, so that the start of the motion does not count.
    """
    first, last = int(test.cycles[0]), int(test.cycles[-1])
    count = len(test.cycles) - 1
    phase = 2.0 * np.pi * count * np.arange(last - first) / (last - first)
    return float(2.0 * np.abs(np.mean(test.velocity_m_s[first:last] * np.exp(-1j * phase))))


def _signals(tests: Sequence[PreparedTest]) -> Outcomes:
    known = {test.name: test for test in tests}
    by = "channels that `prepare` of this run gives"
    found: Outcomes = {}
    slow = known.get("1a-1.0Hz")
    found["T2.5"] = (
        Value(velocity_amplitude(slow), f"{by}, test 1a-1.0Hz")
        if slow is not None and len(slow.cycles) > 1
        else Missing("the campaign has no test 1a-1.0Hz (5 mm at 1 Hz)")
    )
    eleven = [test.drive for test in tests if test.name.startswith("11a")]
    largest = max(float(np.abs(test.drive).max()) for test in tests)
    found["A21"] = (
        Value(float(np.sqrt(np.mean(np.concatenate(eleven) ** 2))) / largest, f"{by}, tests 11a")
        if eleven
        else Missing("the campaign has no test set 11a")
    )
    return found


_SWEEP = {
    "F2-velocity": "velocity",
    "F2-acceleration": "acceleration",
    "F2-displacement": "displacement",
    "F2-both": "both",
    "F2-past": "past",
    "F2-layers": "layers",
    "F2-neurons": "neurons",
}


def _sweep(artifact: Artifact) -> Outcomes:
    """Return the changes of the error that the sweep found; a change within its uncertainty counts as none."""
    found: Outcomes = {}
    known: Mapping[str, Mapping[str, Any]] = {item["name"]: item for item in artifact.json("findings")}
    for entry, name in _SWEEP.items():
        item = known.get(name)
        if item is None or item["verdict"] == "not tested":
            found[entry] = Missing("the sweep of this run has no architecture to compare with")
            continue
        change, uncertainty = float(item["change"]), float(item["uncertainty"])
        shown = change if abs(change) > uncertainty else 0.0
        compared = f"{item['reference']} against {item['alternative']}"
        said = f"{compared}: {in_percent(change, signed=True)}, uncertainty {in_percent(uncertainty)}"
        found[entry] = Value(shown, "sweep of this run", said)
    hidden = artifact.json("choice")["hidden"]
    found["A22b"] = Value("-".join(str(count) for count in hidden), "choice of the sweep of this run")
    return found


def _networks(
    bench: Bench, forward: Network, inverse: Network, assembled: Artifact, tests: Sequence[PreparedTest]
) -> Outcomes:
    training, validation = read_history(assembled, "training"), read_history(assembled, "validation")
    ahead, back = judge(forward, training, validation), judge(inverse, training, validation)
    viscous = emulate_viscous(
        inverse, forward, training, float(training.channels["drive"].max()), ViscousEmulationOptions().frequency_hz
    )
    fast = np.abs(viscous.velocity_m_s) > SLOW_M_S
    desired, given = viscous.tracking.desired_n, viscous.tracking.force_n
    quick, slow = error_figures(desired[fast], given[fast]), error_figures(desired[~fast], given[~fast])
    by = "networks of this run on its validation tests"
    return {
        "F2-half-sine-forward": Value(
            ahead.varying.nrmse / ahead.constant.nrmse,
            by,
            f"error {ahead.varying.nrmse:.3f} with varying and {ahead.constant.nrmse:.3f} with constant current",
        ),
        # the RMS of a constant current of 0 A is not a scale for an error, so RMS errors are compared
        "F2-half-sine-inverse": Value(
            back.varying.rms / back.constant.rms,
            by,
            f"RMS error {back.varying.rms:.3f} A with varying and {back.constant.rms:.3f} A with constant current",
        ),
        "F2-better": _against_bouc_wen(bench.rig.damper, ahead, tests),
        "F2-fast": Value(quick.nrmse, "viscous damping emulated by the networks of this run, 1 Hz"),
        "F2-slow": Value(slow.rms / quick.rms, "viscous damping emulated by the networks of this run, 1 Hz"),
    }


def _against_bouc_wen(damper: DamperModel, judged: Judgement, tests: Sequence[PreparedTest]) -> Value:
    """Return the error of the forward network over that of the identified damper on the validation tests."""
    measured, estimated = [], []
    for test in tests:
        if test.role != "validation":
            continue
        force = damper.force(test.displacement_m, test.velocity_m_s, test.acceleration_m_s2, test.drive, test.dt)
        first = int(test.cycles[0]) if len(test.cycles) else 0
        measured.append(test.force_n[first:])
        estimated.append(force[first:])
    model = error_figures(np.concatenate(measured), np.concatenate(estimated)).nrmse
    network = judged.pooled.nrmse
    said = f"network {network:.4f}, identified model {model:.4f}"
    return Value(network / model, "validation tests of this run", said)


def _signed(inverse: Artifact) -> Outcomes:
    if "signed" not in inverse.members():
        reason = "train_inverse.compare_signed is off, or the inverse network takes signed values"
        return {name: Missing(reason) for name in ("F2-absolute", "F2-negative")}
    kept = inverse.json("signed")
    by = "two short trainings of this run that differ in the absolute values alone"
    errors, shares = kept["nrmse"], kept["negative_share"]
    return {
        "F2-absolute": Value(
            errors["absolute"] / errors["signed"],
            by,
            f"error {errors['absolute']:.4f} with absolute and {errors['signed']:.4f} with signed values",
        ),
        "F2-negative": Value(shares["absolute"] / shares["signed"], by)
        if shares["signed"] > 0.0
        else Missing("neither network of the comparison gives a negative current"),
    }


def chapter_2(bench: Bench) -> Outcomes:
    """Return the outcomes of chapter 2, papers P1 and P5."""
    recordings = "it needs the recordings of the thesis' rig, which are not published"
    found: Outcomes = {
        **_parameter_sets(),
        **_damper(bench),
        "A22c": Missing("two values are printed for one controller; both are settings (simulate.controller.rate_hz)"),
        "T2.6": Missing(recordings),
    }
    prepared, sweep = bench.artifact("prepare"), bench.artifact("sweep")
    assembled = bench.artifact("assemble")
    forward, inverse = bench.artifact("train-forward"), bench.artifact("train-inverse")
    tests = read_prepared(prepared) if prepared is not None else []
    if tests:
        found |= _signals(tests)
    if sweep is not None:
        found |= _sweep(sweep)
    if inverse is not None:
        found |= _signed(inverse)
    if tests and assembled is not None and forward is not None and inverse is not None:
        networks = (read_network(forward, "network"), read_network(inverse, "network"))
        found |= _networks(bench, *networks, assembled, tests)
    lacking: tuple[str, ...] = ("T2.5", "A21", "A22b", "F2-absolute", "F2-negative")
    lacking += ("F2-half-sine-forward", "F2-half-sine-inverse")
    lacking += ("F2-better", "F2-fast", "F2-slow", *_SWEEP)
    return {**{name: Missing(_NO_RUN) for name in lacking}, **found}
