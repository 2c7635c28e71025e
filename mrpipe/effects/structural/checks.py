"""Demands on every effect of a structure, of the program and of users."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.effects.checks import Check, described, parameter_failure
from mrpipe.effects.contract import EffectScales, Parameter
from mrpipe.effects.structural.contract import StructuralEffect, StructuralForm
from mrpipe.effects.trials import RATE_HZ

SCALES = (
    EffectScales(stroke=0.004, speed=0.15, acceleration=5.0, drive=1.0, force=50.0, time=20.0),
    EffectScales(stroke=0.05, speed=0.3, acceleration=2.0, drive=1.0, force=2e6, time=60.0),
)
"""Scales of a storey of a laboratory frame, and of a building."""
COMPILED = ("storey", "floor")


def checks_of(effect: StructuralEffect, known: Sequence[str]) -> list[Check]:
    """Return the result of every demand on an effect of a structure.

    Parameters
    ----------
    effect
        The effect.
    known
        Names of all effects that it may be separated from.
    """
    rivals = [name for name in effect.separated_by if name not in known]
    checks = [
        *described(effect),
        Check("", "Separating tests name known effects", f"unknown effects: {', '.join(rivals)}" if rivals else ""),
        Check("", "There is a form", "" if effect.forms else "there is no form"),
    ]
    for form in effect.forms:
        failure = _parameters(form)
        checks.append(Check(form.name, "Units, scales, bounds and starts of the parameters are sound", failure))
        if not failure and effect.acts_on in COMPILED:
            demand = "The step is compiled, writes only to its memory, and depends on state and motion alone"
            checks.append(Check(form.name, demand, _each(form)))
        elif not failure and effect.acts_on == "base":
            checks.append(
                Check(
                    form.name, "Columns of the rotation of the base match the amplitudes and are finite", _columns(form)
                )
            )
    return checks


def _parameters(form: StructuralForm) -> str:
    own: tuple[Parameter, ...] = (*form.searched, *form.amplitudes)
    failures = (parameter_failure(item, scales) for scales in SCALES for item in own)
    return next((failure for failure in failures if failure), "")


def _each(form: StructuralForm) -> str:
    for scales in SCALES:
        try:
            failure = _step(form, scales)
        except IndexError:
            failure = f"reads or writes beyond its memory (state_size {form.state_size}) or its parameters"
        except Exception as error:  # the file of a user may raise any error
            failure = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        if failure:
            return failure
    return ""


def _step(form: StructuralForm, scales: EffectScales) -> str:
    """Run the step uncompiled, so that an index beyond its memory is an error; do every third step twice."""
    plain = getattr(form.step, "py_func", None)
    if plain is None:
        return "the function is not compiled: decorate it with @njit(STEP_SIGNATURE, cache=True)"
    values = [item.start_values(scales)[0] for item in form.searched]
    numbers = np.array([*values, *form.constants], dtype=np.float64)
    before_all = numbers.copy()
    state = np.zeros(form.state_size)
    forces = []
    omega = scales.speed / scales.stroke
    for index in range(400):
        phase = omega * index * 5.0 / RATE_HZ
        position, rate = scales.stroke * np.sin(phase), scales.speed * np.cos(phase)
        before, out = state.copy(), np.full(len(form.amplitudes), np.nan)
        plain(position, rate, state, numbers, 5.0 / RATE_HZ, out)
        if index % 3 == 1:
            after, again = state.copy(), np.full(len(form.amplitudes), np.nan)
            state[:] = before
            plain(0.5 * position, -rate, state, numbers, 5.0 / RATE_HZ, np.zeros(len(form.amplitudes)))
            state[:] = before
            plain(position, rate, state, numbers, 5.0 / RATE_HZ, again)
            if not (np.array_equal(again, out) and np.array_equal(state, after)):
                return "the same step from the same state gives another force: something is stored outside the state"
        if not np.isfinite(out).all():
            return "the unit forces are not finite, or one of them is not written"
        forces.append(out)
    if not np.array_equal(numbers, before_all):
        return "writes into its parameters: numbers that it stores belong into its state"
    return "" if all(np.any(column) for column in np.array(forces).T) else "a unit force is always 0"


def _columns(form: StructuralForm) -> str:
    if form.columns is None:
        return "there is no function `columns`"
    for scales in SCALES:
        values = {item.name: item.start_values(scales)[0] for item in form.searched}
        time = np.arange(2000) / RATE_HZ
        turn: FloatArray = scales.stroke * np.sin(2.0 * np.pi * scales.speed / scales.stroke * time)
        try:
            columns = form.columns(turn, 1.0 / RATE_HZ, values)
        except Exception as error:  # the file of a user may raise any error
            return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        if np.shape(columns) != (len(turn), len(form.amplitudes)):
            return f"columns have the shape {np.shape(columns)}, expected {(len(turn), len(form.amplitudes))}"
        if not np.isfinite(columns).all():
            return "columns are not finite"
    return ""
