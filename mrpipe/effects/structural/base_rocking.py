"""Base rocking: the base rotates, and every floor moves in proportion to its height."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.effects.contract import Separation, Values, amplitude, shape
from mrpipe.effects.structural.contract import StructuralEffect, StructuralForm


def _oscillator(turn: FloatArray, dt: float, values: Values) -> FloatArray:
    """Return the rotation [rad] of a base with inertia from that of a base without inertia, shape (m,)."""
    frequencies = np.fft.rfftfreq(len(turn), dt)
    ratio = frequencies / values["base_frequency"]
    response = 1.0 / (1.0 - ratio**2 + 2j * values["damping_ratio"] * ratio)
    return np.asarray(np.fft.irfft(np.fft.rfft(turn) * response, len(turn)))


def _plain(turn: FloatArray, dt: float, values: Values) -> FloatArray:
    return _oscillator(turn, dt, values)[:, None]


def _uplift(turn: FloatArray, dt: float, values: Values) -> FloatArray:
    moved = _oscillator(turn, dt, values)
    beyond = np.abs(moved) - values["uplift"]
    return np.column_stack([moved, np.sign(moved) * np.maximum(beyond, 0.0)])


_FREQUENCY = shape(
    "base_frequency",
    "Hz",
    "natural frequency of the base with the floors at rest",
    "speed/stroke",
    0.2,
    60.0,
    (0.8, 1.6, 3.2, 8.0),
)
_RATIO = shape("damping_ratio", "1", "damping ratio of the base", "one", 1e-3, 0.5, (0.03,))
_SHARE = amplitude("turn_share", "1", "share of the mean drift due to the rotation of the base", "one", 0.0, 1.0)
_MORE = amplitude("uplift_share", "1", "additional share beyond uplift", "one", 0.0, 5.0)

EFFECT = StructuralEffect(
    name="base-rocking",
    summary="the base rotates: all storeys have a common drift, proportional to the overturning moment",
    physics="Base plate or ground deform under the overturning moment, so that each floor moves in proportion to its "
    "height.",
    remedy="Bolt or stiffen the base, or measure its rotation; declare its rotational stiffness and inertia.",
    residual="All storeys show a residual in phase with the overturning moment; it grows linearly with height.",
    source="Wolf (1985), sway-rocking model; Housner (1963) for uplift",
    acts_on="base",
    forms=(
        StructuralForm("spring", "J psi'' + c psi' + k psi = moment", (_FREQUENCY, _RATIO), (_SHARE,), columns=_plain),
        StructuralForm(
            "uplift",
            "the same, with less stiffness beyond a rotation",
            (
                _FREQUENCY,
                _RATIO,
                shape(
                    "uplift",
                    "m",
                    "rotation times storey height at which one edge lifts",
                    "stroke",
                    0.05,
                    0.9,
                    (0.2, 0.5),
                ),
            ),
            (_SHARE, _MORE),
            columns=_uplift,
        ),
    ),
    separated_by={
        "cubic-stiffness": Separation("an inclinometer on the base, or the same motion at two amplitudes"),
        "joint-friction": Separation("an inclinometer on the base"),
    },
)
