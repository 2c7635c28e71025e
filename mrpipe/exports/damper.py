"""A damper as a subject of exports: its test vectors and its plain description."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mrpipe.dampers.model import DamperModel
from mrpipe.dampers.plant import Chain, in_order
from mrpipe.exports.contract import Channel, Subject, Vectors
from mrpipe.words import listed

ROWS = 800
SAMPLE_TIME_S = 2e-3
_PERIODS = (3.0, 7.0)
"""Periods of the two harmonics in the test motion; together they reverse at many displacements."""

ORIGINS = {
    "identified": "The identified damper of `identify-damper`",
    "traced": "The traced damper of `close-loop` (`--damper traced`)",
}
"""Name of a damper of the run -> where it comes from."""


def damper_subject(damper: DamperModel, name: str = "damper", prefix: str = "mrpipe", **details: Any) -> Subject:
    """Return a damper with test vectors over the stroke and the drives of its tests."""
    about = about_damper(damper, str(details.get("source", "")))
    return Subject("damper", name, f"{prefix}_{name}".replace("-", "_"), damper, damper_vectors(damper), details, about)


def about_damper(damper: DamperModel, source: str) -> str:
    """Return sentences on what a damper is: where it comes from, its base form and its effects.

    Parameters
    ----------
    damper
        The damper.
    source
        Value of `simulate.damper`: `identified`, `traced`, a parameter set or a file; empty: not known.
    """
    origin = f"{ORIGINS.get(source, f'The damper {source}')}: base" if source else "Base"
    text = f"{origin} form `{damper.form}` ({damper.base.summary})"
    acting = [f"`{item.name}` (form {item.form})" for item in damper.effects if not item.sensor]
    faults = [f"`{item.name}`" for item in damper.effects if item.sensor]
    text += f", with {listed(acting)}." if acting else ", without effects."
    if faults:
        text += f" Faults of sensors, which do not change the force: {listed(faults)}."
    return text


def damper_vectors(damper: DamperModel) -> Vectors:
    """Return a motion with reversals, a drive that rises, falls and jumps, and the force of the damper."""
    time = SAMPLE_TIME_S * np.arange(ROWS)
    length = ROWS * SAMPLE_TIME_S
    omega = [2.0 * np.pi * count / length for count in _PERIODS]
    shares = (0.65, 0.3)
    x = damper.stroke_m * sum(share * np.sin(w * time) for share, w in zip(shares, omega, strict=True))
    v = damper.stroke_m * sum(share * w * np.cos(w * time) for share, w in zip(shares, omega, strict=True))
    a = -damper.stroke_m * sum(share * w * w * np.sin(w * time) for share, w in zip(shares, omega, strict=True))
    largest = damper.drive_limit if math.isfinite(damper.drive_limit) else 1.0
    drive = largest * (0.5 - 0.5 * np.cos(2.0 * np.pi * 2.0 * time / length))
    drive[ROWS // 4 : ROWS // 3] = 0.0
    drive[2 * ROWS // 3 : 3 * ROWS // 4] = largest
    force = damper.force(x, v, a, drive, SAMPLE_TIME_S)
    return Vectors(
        (
            Channel("displacement", "m", x),
            Channel("velocity", "m/s", v),
            Channel("acceleration", "m/s^2", a),
            Channel("drive", damper.drive_unit, drive),
        ),
        (Channel("force", "N", force),),
        SAMPLE_TIME_S,
        single_limit=1e-2,
    )


def smallest_interval(chain: Chain) -> float:
    """Return the smallest sampling interval [s] at which the memory of all steps reaches back far enough; 0: any."""
    return max((back_s / (kept - 2) for _, back_s, kept in chain.memories), default=0.0)


def described(damper: DamperModel) -> dict[str, Any]:
    """Return the damper as plain values: form, parameters with units, laws of the drive and effects."""
    return {
        "form": damper.form,
        "summary": damper.base.summary,
        "source": damper.base.source,
        "parameters": {
            name: {"value": float(value), "unit": damper.unit(name)} for name, value in damper.parameters.items()
        },
        "laws_of_the_drive": dict(damper.laws),
        "drive_unit": damper.drive_unit,
        "drive_limit": float(damper.drive_limit) if math.isfinite(damper.drive_limit) else None,
        "stroke_m": float(damper.stroke_m),
        "effects": [
            {
                "name": item.name,
                "form": item.form,
                "sensor": item.sensor,
                "parameters": {
                    name: {"value": float(value), "unit": item.units.get(name, "1")}
                    for name, value in item.values.items()
                },
            }
            for item in damper.effects
        ],
        "steps": [
            {"name": step.name, "numbers": [float(value) for value in step.parameters], "memory": step.state_size}
            for step in in_order(damper.steps())
        ],
    }
