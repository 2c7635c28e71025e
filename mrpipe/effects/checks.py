"""Demands on every effect file, of the program and of users.

Fit, tracing and closed loop rely on these demands. An effect of a damper is run in a chain after a simple base form, on
dampers of two sizes, because an effect with absolute numbers would be valid for one size only.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.artifacts.yaml_source import nearest
from mrpipe.dampers.plant import (
    ACCELERATION,
    CHAIN_LENGTH,
    DISPLACEMENT,
    DRIVE,
    FIRST,
    FORCE,
    TIME,
    VELOCITY,
    WIRE_SIZE,
    Phase,
    Step,
    build_chain,
    run_chain,
)
from mrpipe.effects.contract import Described, Effect, EffectForm, EffectScales, Needs, Parameter, TestKind
from mrpipe.effects.trials import SIZES, Motion, Size, motion_of, tried_twice
from mrpipe.errors import UserError
from mrpipe.units import conversion

Values = dict[str, float]
Test = Callable[[EffectForm, Size], str]
"""Function that returns why a form does not meet a demand on a damper of one size; empty if it does."""


@dataclass(frozen=True)
class Check:
    """One demand and whether an effect meets it.

    Attributes
    ----------
    form
        Form that was checked; empty for the effect as a whole.
    demand
        The demand, a sentence.
    failure
        Why it is not met; empty if it is.
    """

    form: str
    demand: str
    failure: str = ""

    @property
    def passed(self) -> bool:
        """Whether the demand is met."""
        return not self.failure


def checks_of(effect: Effect, known: Sequence[str]) -> list[Check]:
    """Return the result of every demand on an effect of a damper.

    Parameters
    ----------
    effect
        The effect.
    known
        Names of all effects that it may be separated from.
    """
    checks = [*described(effect), Check("", "Needs and separating tests are known", _unknown(effect, known))]
    forms = (*effect.forms, *effect.refinements)
    names = [form.name for form in forms]
    checks.append(Check("", "There is at least one form, and all forms have different names", _names(names)))
    for form in forms:
        checks += form_checks(form)
    return checks


def described(effect: Described) -> Iterator[Check]:
    """Yield the demands on the texts of an effect of a damper or of a structure."""
    texts = {name: getattr(effect, name) for name in ("name", "summary", "physics", "remedy", "source")}
    short = [name for name, text in texts.items() if not isinstance(text, str) or len(text.strip()) < 3]
    yield Check(
        "", "Name, summary, physics, remedy and source are given", f"empty: {', '.join(short)}" if short else ""
    )


def _unknown(effect: Effect, known: Sequence[str]) -> str:
    needs = [item for item in effect.needs if item not in get_args(Needs)]
    rivals = [name for name in effect.separated_by if name not in known]
    kinds = [
        f"{kind} (against {name})"
        for name, separation in effect.separated_by.items()
        for kind in getattr(separation, "kinds", ("no Separation",))
        if kind not in get_args(TestKind)
    ]
    return "; ".join(
        f"unknown {what}: {', '.join(words)} ({right})"
        for what, words, right in (
            ("needs", needs, f"known: {', '.join(get_args(Needs))}"),
            ("effects", rivals, nearest(rivals[0], known) if rivals else ""),
            ("kinds of test", kinds, f"known: {', '.join(get_args(TestKind))}"),
        )
        if words
    )


def _names(names: Sequence[str]) -> str:
    twice = sorted({name for name in names if names.count(name) > 1})
    return f"used twice: {', '.join(twice)}" if twice else "" if names else "there is no form"


def form_checks(form: EffectForm) -> list[Check]:
    """Return the result of the demands on one form; it ends with a failure that makes the other checks impossible."""
    demands: list[tuple[str, Test, bool]] = [
        ("Units, scales, bounds and starts of the parameters are sound", _parameters, True),
        ("Steps are compiled, write only to their memory and do not change their parameters", _steps, True),
        ("The force is finite at the bounds of the parameters and at rest", _finite, True),
        ("The force depends on state, motion and drive alone (no hidden memory)", _memory, False),
        ("Some strength changes the force", _effective, False),
    ]
    if any(item.role != "shape" for item in form.parameters):
        demands.append(("At zero strength nothing changes", _vanishes, False))
    if form.amplitudes:
        demands.append(("The force is proportional to its amplitudes", _linear, False))
    if form.dissipative:
        demands.append(("No energy is fed in over a cycle (declared dissipative)", _dissipative, False))
    checks = []
    for text, test, needed in demands:
        checks.append(Check(form.name, text, _each(test, form)))
        if needed and not checks[-1].passed:
            break
    return checks


def _each(test: Test, form: EffectForm) -> str:
    """Return the first failure of a test on dampers of all sizes."""
    for size in SIZES:
        try:
            with np.errstate(all="ignore"):
                failure = test(form, size)
        except UserError as error:
            failure = str(error)
        except Exception as error:  # the file of a user may raise any error
            failure = f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"
        if failure:
            return f"{failure} (damper of {size.scales.force:g} N, {size.scales.stroke:g} m)"
    return ""


def parameter_failure(item: Parameter, scales: EffectScales) -> str:
    """Return what is wrong with a parameter; empty if nothing is."""
    if not item.meaning.strip():
        return f"{item.name}: the meaning is empty"
    try:
        # `drive` stands for A or V, and an exponent may be a parameter itself
        conversion(re.sub(r"\^[A-Za-z]\w*", "", re.sub(r"\bdrive\b", "A", item.unit)))
    except UserError:
        return f"{item.name}: {item.unit!r} is not a unit"
    try:
        low, high = item.bounds(scales)
        starts = item.start_values(scales)
    except (AttributeError, ValueError):
        return f"{item.name}: {item.scale!r} is not a product of {', '.join(EffectScales.__dataclass_fields__)}"
    if not (np.isfinite([low, high]).all() and low < high):
        return f"{item.name}: the lower bound {item.lower} is not below the upper bound {item.upper}"
    if not starts:
        return f"{item.name}: no start is given"
    if item.role == "amplitude":
        return ""
    outside = [start for start in starts if not low <= start <= high]
    if outside:
        return f"{item.name}: starts outside the bounds"
    if item.logarithmic and low <= 0.0:
        return f"{item.name}: is searched as its logarithm, so its lower bound must be above 0"
    if item.role == "strength" and not low <= 0.0 <= high:
        return f"{item.name}: is a strength, so 0 must lie within its bounds"
    return ""


def _parameters(form: EffectForm, size: Size) -> str:
    for item in form.parameters:
        failure = parameter_failure(item, size.scales)
        if failure:
            return failure
    names = [item.name for item in form.parameters]
    if len(set(names)) < len(names):
        return "two parameters have the same name"
    declared, amplitudes = set(form.amplitude_steps), {item.name for item in form.amplitudes}
    if declared != amplitudes:
        return f"amplitude_steps names {sorted(declared)}, the amplitudes are {sorted(amplitudes)}"
    return ""


def _strong(form: EffectForm, size: Size) -> Values:
    return {
        item.name: 0.6 * item.bounds(size.scales)[1] if item.role == "strength" else item.start_values(size.scales)[-1]
        for item in form.parameters
    }


def _usual(form: EffectForm, size: Size) -> Values:
    return {
        item.name: item.start_values(size.scales)[0] * (0.05 if item.role == "amplitude" else 1.0)
        for item in form.parameters
    }


def _force(form: EffectForm | None, values: Values, size: Size, motion: Motion) -> FloatArray:
    steps = [] if form is None else form.steps(values)
    return run_chain(build_chain([*size.base, *steps]), *motion)[:, FORCE]


def _steps(form: EffectForm, size: Size) -> str:
    values = _usual(form, size)
    steps = form.steps(values)
    if not isinstance(steps, list) or not all(isinstance(item, Step) for item in steps):
        return "steps(values) does not return a list of Step"
    beyond = [name for name, place in form.amplitude_steps.items() if not 0 <= place < len(steps)]
    if beyond:
        return f"amplitude_steps of {', '.join(beyond)} is not the index of one of the {len(steps)} steps"
    if len(steps) > CHAIN_LENGTH - len(size.base) - 1:
        return f"{len(steps)} steps are too many for a chain"
    build_chain([*size.base, *steps])
    motion = motion_of(size)
    for step in steps:
        if not isinstance(step.phase, Phase):
            return f"step {step.name}: the phase is not a Phase"
        failure = _within_memory(step, motion)
        if failure:
            return f"step {step.name}: {failure}"
    return ""


def _within_memory(step: Step, motion: Motion) -> str:
    """Run the step uncompiled, so that an index beyond its memory raises an error instead of damage."""
    plain = getattr(step.function, "py_func", None)
    if plain is None:
        return "the function is not compiled: decorate it with @njit(STEP_SIGNATURE, cache=True)"
    x, v, a, drive, dt = motion
    wire, state = np.ones(WIRE_SIZE), np.zeros(step.state_size)
    numbers = np.array(step.parameters, dtype=np.float64)
    before = numbers.copy()
    for index in range(0, len(x), max(1, len(x) // 200)):
        wire[TIME], wire[FIRST] = index * dt, float(index == 0)
        wire[DISPLACEMENT], wire[VELOCITY], wire[ACCELERATION], wire[DRIVE] = x[index], v[index], a[index], drive[index]
        try:
            plain(wire, state, numbers, dt)
        except IndexError:
            return f"reads or writes beyond its memory (state_size {step.state_size}, {len(numbers)} parameters)"
    if not np.array_equal(numbers, before):
        return "writes into its parameters: numbers that it stores belong into its state"
    return ""


def _finite(form: EffectForm, size: Size) -> str:
    sets = [_usual(form, size), _strong(form, size)]
    for item in form.parameters:
        if item.role != "amplitude":
            sets += [{**_usual(form, size), item.name: bound} for bound in item.bounds(size.scales)]
    moving = motion_of(size)
    resting: Motion = (*(np.zeros_like(moving[0]),) * 3, moving[3], moving[4])
    for values in sets:
        for motion, where in ((moving, "in motion"), (resting, "at rest")):
            if not np.isfinite(_force(form, values, size, motion)).all():
                shown = ", ".join(f"{name} {value:.4g}" for name, value in values.items())
                return f"the force is not finite {where} with {shown}"
    return ""


def _memory(form: EffectForm, size: Size) -> str:
    first, again = tried_twice(build_chain([*size.base, *form.steps(_strong(form, size))]), size, motion_of(size))
    if first == again:
        return ""
    return (
        f"the same step from the same state gives {first:.6g} N, then {again:.6g} N: something is stored outside "
        "the state"
    )


def _effective(form: EffectForm, size: Size) -> str:
    motion = motion_of(size, 0.99)
    change = _force(form, _strong(form, size), size, motion) - _force(None, {}, size, motion)
    return "" if np.sqrt(np.mean(change**2)) > 1e-6 * size.scales.force else "the force stays the same"


def _vanishes(form: EffectForm, size: Size) -> str:
    values = form.without_strength(size.scales)
    for share, faster in ((0.9, 1.0), (0.2, 1.0), (1.2, 0.3), (0.5, 1.6)):
        motion = motion_of(size, share, faster)
        change = np.abs(_force(form, values, size, motion) - _force(None, {}, size, motion)).max()
        if not change <= 1e-9 * size.scales.force:
            return f"the force changes by {change:.3g} N"
    return ""


def _linear(form: EffectForm, size: Size) -> str:
    motion = motion_of(size)
    values, plain = _usual(form, size), _force(None, {}, size, motion)
    doubled = {**values, **{item.name: 2.0 * values[item.name] for item in form.amplitudes}}
    once, twice = (_force(form, item, size, motion) - plain for item in (values, doubled))
    error = np.abs(twice - 2.0 * once).max()
    return (
        ""
        if error <= 1e-9 * size.scales.force
        else f"with twice the amplitude the force differs from twice the force by {error:.3g} N"
    )


def _dissipative(form: EffectForm, size: Size) -> str:
    x, v, a, drive, dt = motion_of(size)
    motion: Motion = (x, v, a, np.full_like(drive, 0.6 * size.scales.drive), dt)
    plain = _force(None, {}, size, motion)
    cycle = slice(len(x) // 3, 2 * (len(x) // 3))
    for values in (_usual(form, size), _strong(form, size)):
        force = _force(form, values, size, motion)
        if force[cycle] @ v[cycle] <= 0.0:
            return "damper and effect together feed energy into the motion"
        added = (force - plain)[cycle] @ v[cycle] * dt
        if form.amplitudes and added < -1e-9 * size.scales.force * size.scales.stroke:
            return f"the effect feeds {-added:.3g} J into each cycle"
    return ""
