"""Linear frame that is equivalent to an identified frame at one amplitude of its motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrpipe.artifacts import Artifact, FloatArray
from mrpipe.errors import UserError
from mrpipe.structures.dynamics import natural_modes
from mrpipe.structures.frame import Frame, read_frame

GROUP = "amplitude"


def modes_at_amplitude(
    angular_frequencies: FloatArray,
    damping_ratios: FloatArray,
    softening: FloatArray,
    damping_growth: FloatArray,
    relative_amplitude: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return omega_0 (1 + A/A_0)^(-a) [rad/s] and zeta_0 (1 + A/A_0)^b [1] of r modes, each of shape (r,).

    Parameters
    ----------
    angular_frequencies, damping_ratios
        Values at zero amplitude, shape (r,) [rad/s], [1].
    softening, damping_growth
        Exponents a and b, shape (r,) [1].
    relative_amplitude
        Ratio of amplitude to reference amplitude A/A_0, shape (r,) [1].
    """
    level = np.log1p(relative_amplitude)
    omega = angular_frequencies * np.exp(-softening * level)
    return np.asarray(omega), np.asarray(damping_ratios * np.exp(damping_growth * level))


def frame_with_modes(frame: Frame, angular_frequencies: FloatArray, damping_ratios: FloatArray) -> Frame:
    """Return the frame with the same masses and mode shapes, and other frequencies and damping.

    With mass-normalised shapes U, K = M U diag(omega^2) U' M and C = M U diag(2 zeta omega) U' M.

    Parameters
    ----------
    frame
        Frame with n floors.
    angular_frequencies, damping_ratios
        Shape (n,) [rad/s], [1].
    """
    shapes = natural_modes(frame).mode_shapes
    shapes = shapes / np.sqrt(np.einsum("ir,ij,jr->r", shapes, frame.mass, shapes))
    left = frame.mass @ shapes
    stiffness = (left * angular_frequencies**2) @ left.T
    damping = (left * (2.0 * damping_ratios * angular_frequencies)) @ left.T
    return replace(frame, damping=damping, stiffness=stiffness)


def depends_on_amplitude(artifact: Artifact) -> bool:
    """Return whether `identify-frame` found modes that depend on the amplitude of the motion."""
    return f"{GROUP}/angular_frequency" in artifact


def read_frame_at(artifact: Artifact, amplitude_m: float) -> Frame:
    """Return the identified frame, at an amplitude of the motion as :func:`frame_at_amplitude`.

    Parameters
    ----------
    artifact
        frame.h5 of `identify-frame`.
    amplitude_m
        Amplitude at the floor that moves most [m]; 0: the frame of constant modes.

    Raises
    ------
    UserError
        If the identification found no dependence on amplitude, or not all modes.
    """
    frame = read_frame(artifact)
    return frame_at_amplitude(artifact, frame, amplitude_m) if amplitude_m > 0.0 else frame


def frame_at_amplitude(artifact: Artifact, frame: Frame, amplitude_m: float) -> Frame:
    """Return the linear frame that is equivalent to the identified one at an amplitude of the motion.

    The motion is divided among the modes in proportion to their largest amplitudes in the identification.

    Parameters
    ----------
    artifact
        frame.h5 of `identify-frame`.
    frame
        The frame in it.
    amplitude_m
        Amplitude at the floor that moves most [m].

    Raises
    ------
    UserError
        If the identification found no dependence on amplitude, or not all modes.
    """
    name = "simulate.frame_amplitude_m"
    if not depends_on_amplitude(artifact):
        problem = "identify-frame found no dependence of the modes on amplitude"
        raise UserError(artifact.path, name, problem, "set it to 0")
    omega, zeta, softening, growth, reference, largest = (
        artifact.array(f"{GROUP}/{column}")
        for column in (
            "angular_frequency",
            "damping_ratio",
            "softening_exponent",
            "damping_exponent",
            "reference",
            "largest",
        )
    )
    if omega.size != frame.floors:
        problem = f"{omega.size} of {frame.floors} modes were identified over amplitude"
        raise UserError(artifact.path, name, problem, "set it to 0")
    relative = amplitude_m * largest / largest.max() / reference
    return frame_with_modes(frame, *modes_at_amplitude(omega, zeta, softening, growth, relative))
