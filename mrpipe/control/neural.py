"""Neural model reference control: a network that gives the force of fdns from past motion (thesis 4.3.4, P3)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray, Progress, no_progress
from mrpipe.control.calibration_settings import NeuralReferenceSettings
from mrpipe.control.limits import LimitingModes
from mrpipe.control.linearisation import equivalent_stiffness, friction_stiffness
from mrpipe.networks.assembly import History
from mrpipe.networks.network import FeatureSpec, Network, lagged
from mrpipe.networks.options import TrainingOptions
from mrpipe.networks.training import train
from mrpipe.signals.error_size import nrmse
from mrpipe.structures import Frame, natural_modes

_SETTINGS = NeuralReferenceSettings()
"""Source of the defaults, so that options and settings have the same ones."""


@dataclass(frozen=True)
class ReferenceOptions:
    """Harmonic loops that the network learns, and how.

    Attributes
    ----------
    alpha_n_m
        Gain of FDNS.
    amplitudes_m
        Amplitudes of the loops [m]; loops with amplitudes between them are used for verification.
    frequencies_hz
        Frequencies of the loops.
    rate_hz, past_values
        Sampling rate of the network [Hz], and number of past values of displacement and velocity in addition to the
        present ones.
    hidden
        Neurons of the hidden layers.
    starts, iterations
        Number of random starts, and largest number of iterations of a start.
    rows
        Number of rows of the training set.
    rounding_m_s
        Speed over which the friction of the law changes its sign [m/s]; 0: the jump of (4.18).
    disturbances_rad_s, disturbance_share
        Angular frequencies of the higher modes that are superimposed on the loops, and standard deviation of their
        speed relative to that of the loop (normal distribution). They are necessary because floor 1 does not move
        harmonically in the closed loop. A network that was trained on harmonic motion only gives an arbitrary output
        for the other components, and the closed loop oscillates.
    displacement_noise_m, velocity_noise_m_s
        RMS noise on the inputs in the training [m], [m/s]. Successive samples of a smooth motion are nearly collinear.
        A network trained without noise depends on their small differences, so that the noise of an estimator would
        dominate its force.
    """

    alpha_n_m: float
    amplitudes_m: tuple[float, ...]
    frequencies_hz: tuple[float, ...]
    rate_hz: float = _SETTINGS.rate_hz
    past_values: int = _SETTINGS.past_values
    hidden: tuple[int, ...] = _SETTINGS.hidden
    starts: int = _SETTINGS.starts
    iterations: int = _SETTINGS.iterations
    rows: int = 6000
    rounding_m_s: float = 0.0
    disturbances_rad_s: tuple[float, ...] = ()
    disturbance_share: float = _SETTINGS.disturbance_share
    displacement_noise_m: float = 2e-5
    velocity_noise_m_s: float = 3e-3


@dataclass(frozen=True)
class ReferenceNetwork:
    """Trained network and its errors on loops with amplitudes and frequencies that are not in the training set."""

    network: Network
    training_nrmse: float
    verification_nrmse: float
    iterations: int

    def assessment(self, alpha_n_m: float, amplitude_m: float, angular_frequency: float) -> dict[str, Any]:
        """Return the errors, and the equivalent stiffness [N/m] in harmonic motion against that of FDNS.

        Parameters
        ----------
        alpha_n_m
            Gain of FDNS that the network learned.
        amplitude_m, angular_frequency
            Amplitude and angular frequency of the motion [m], [rad/s].
        """
        H = equivalent_stiffness(lambda x, v: network_force(self.network, x, v), amplitude_m, angular_frequency)
        wanted = friction_stiffness(alpha_n_m)
        return {
            "architecture": self.network.architecture,
            "training_nrmse": self.training_nrmse,
            "verification_nrmse": self.verification_nrmse,
            "equivalent_stiffness_n_m": H.real,
            "equivalent_loss_n_m": H.imag,
            "equivalent_error": abs(H - wanted) / abs(wanted),
        }


AMPLITUDES = (0.2, 2.0)
"""Ratios of the smallest and the largest training amplitude to the expected amplitude."""

FREQUENCIES = (0.625, 1.6)
"""Ratios of the lowest and the highest training frequency to the frequency of the free mode. This frequency is in the
middle of the range, because a network that cannot distinguish a slow large motion from a fast small one gives the force
for the middle.
"""

INPUT_NOISE = (0.002, 0.04)
"""Ratio of the noise on displacement and velocity in the training to the expected amplitude of each."""


def reference_options(
    settings: NeuralReferenceSettings,
    alpha_n_m: float,
    frame: Frame,
    modes: LimitingModes,
    amplitude_m: float,
    rounding_m_s: float,
) -> ReferenceOptions:
    """Return the loops for a structure: a range about the free target mode and the expected amplitude.

    Parameters
    ----------
    settings
        Settings of the section `calibrate.neural`.
    alpha_n_m
        Gain of FDNS.
    frame, modes
        The structure and its target mode without and with the damper locked.
    amplitude_m
        Expected amplitude of the damper [m].
    rounding_m_s
        Speed over which the friction of the law changes its sign [m/s].
    """
    free = modes.omega_0 / (2.0 * np.pi)
    others = np.delete(natural_modes(frame).angular_frequencies, modes.mode - 1)
    return ReferenceOptions(
        alpha_n_m=alpha_n_m,
        amplitudes_m=tuple(amplitude_m * np.geomspace(*AMPLITUDES, settings.amplitudes)),
        frequencies_hz=tuple(free * np.geomspace(*FREQUENCIES, settings.frequencies)),
        rate_hz=settings.rate_hz,
        past_values=settings.past_values,
        hidden=settings.hidden,
        starts=settings.starts,
        iterations=settings.iterations,
        rounding_m_s=rounding_m_s,
        # what lies above a quarter of the rate is not motion to the network
        disturbances_rad_s=tuple(others[others < 0.5 * np.pi * settings.rate_hz]),
        disturbance_share=settings.disturbance_share,
        displacement_noise_m=INPUT_NOISE[0] * amplitude_m,
        velocity_noise_m_s=INPUT_NOISE[1] * amplitude_m * modes.omega_0,
    )


CYCLES = 4
"""Number of cycles of a loop."""


def loop(
    options: ReferenceOptions, amplitude_m: float, frequency_hz: float, rng: np.random.Generator | None = None
) -> tuple[FloatArray, ...]:
    """Return displacement, velocity and force of some cycles of FDNS in harmonic motion, each of shape (n,).

    With a generator, other modes with random amplitude and phase are superimposed on the motion; X of the law remains
    that of the loop.
    """
    omega = 2.0 * np.pi * frequency_hz
    t = np.arange(int(CYCLES * options.rate_hz / frequency_hz)) / options.rate_hz
    x = amplitude_m * np.sin(omega * t)
    v = amplitude_m * omega * np.cos(omega * t)
    if rng is not None:
        for other in options.disturbances_rad_s:
            speed = options.disturbance_share * amplitude_m * omega * rng.standard_normal()
            phase = other * t + rng.uniform(0.0, 2.0 * np.pi)
            x = x + speed / other * np.sin(phase)
            v = v + speed * np.cos(phase)
    side = np.tanh(v / options.rounding_m_s) if options.rounding_m_s > 0.0 else np.sign(v)
    return x, v, options.alpha_n_m * (side * np.maximum(amplitude_m, np.abs(x)) - x)


def train_reference(
    options: ReferenceOptions, rng: np.random.Generator, progress: Progress = no_progress
) -> ReferenceNetwork:
    """Train the network of 4.3.4 on harmonic loops of FDNS.

    The force of the law is proportional to the amplitude, and its loop does not depend on frequency. A network does not
    have these properties by construction; therefore the training set has many amplitudes and frequencies.
    """
    spec = FeatureSpec(("displacement", "velocity"), options.past_values, False, options.rate_hz, "force")
    history = _with_noise(_history(options, options.amplitudes_m, options.frequencies_hz, rng), options, rng)
    trained = train(
        history,
        spec,
        TrainingOptions(
            architecture=options.hidden,
            biases=False,
            starts=options.starts,
            refined_starts=1,
            held_out_failures=15,
            subsample_rows=options.rows,
            subsample_iterations=options.iterations,
            iterations=min(20, options.iterations),
            method="mu-diagonal",
        ),
        rng,
        progress=progress,
    )
    between = tuple(np.sqrt(np.multiply(options.amplitudes_m[1:], options.amplitudes_m[:-1])))
    others = tuple(np.sqrt(np.multiply(options.frequencies_hz[1:], options.frequencies_hz[:-1])))
    return ReferenceNetwork(
        trained.network,
        _nrmse(trained.network, history),
        _nrmse(trained.network, _history(options, between, others)),
        trained.iterations,
    )


def network_force(network: Network, x: FloatArray, v: FloatArray) -> FloatArray:
    """Return the force over one periodic cycle, shape (n,), of a motion sampled at any rate of at least the network's.

    For the equivalent linearisation of the neural loop; the cycle is `x`, `v` of shape (n,) at angular frequency
    v/x, its past values wrap around.
    """
    omega = float(np.max(np.abs(v)) / np.max(np.abs(x)))
    spacing = omega * len(x) / (2.0 * np.pi * network.features.sampling_rate_hz)
    past = network.features.past_values
    places = np.arange(len(x))
    columns = []
    for channel in (x, v):
        for lag in range(past + 1):
            columns.append(np.interp(places - lag * spacing, places, channel, period=len(x)))
    return network.predict(np.stack(columns, axis=1))


def _history(
    options: ReferenceOptions,
    amplitudes: tuple[float, ...],
    frequencies: tuple[float, ...],
    rng: np.random.Generator | None = None,
) -> History:
    pairs = [(a, f) for a in amplitudes for f in frequencies]
    loops = [loop(options, a, f, rng) for a, f in pairs]
    names = ("displacement", "velocity", "force")
    channels = {name: np.concatenate([item[index] for item in loops]) for index, name in enumerate(names)}
    return History(
        names=tuple(f"{1e3 * a:.2f}mm-{f:.2f}Hz" for a, f in pairs),
        channels=channels,
        starts=np.cumsum([0, *(len(item[0]) for item in loops)], dtype=np.int64),
        drive_varies=tuple(False for _ in pairs),
        sampling_rate_hz=options.rate_hz,
        drive_unit="",  # the reference network has no drive
    )


def _with_noise(history: History, options: ReferenceOptions, rng: np.random.Generator) -> History:
    noise = {"displacement": options.displacement_noise_m, "velocity": options.velocity_noise_m_s, "force": 0.0}
    channels = {
        name: values + noise[name] * rng.standard_normal(len(values)) for name, values in history.channels.items()
    }
    return replace(history, channels=channels)


def _nrmse(network: Network, history: History) -> float:
    errors, targets = [], []
    past = network.features.past_values
    for index in range(len(history.names)):
        rows = lagged([history.record(index, "displacement"), history.record(index, "velocity")], past)
        target = history.record(index, "force")[past:]
        errors.append(network.predict(rows) - target)
        targets.append(target)
    return nrmse(np.concatenate(errors), np.concatenate(targets))
