"""Effects that can be planted in the virtual damper: names as in docs/effects.md, forms, parameters and ranges."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.errors import UserError
from mrpipe.laboratory import coefficient_effects as coefficient
from mrpipe.laboratory import current_effects as current
from mrpipe.laboratory import kernel

CHANNEL_SKEW_CONSTANT, CHANNEL_SKEW_FILTER = 70, 71
SENSOR_CODES = (CHANNEL_SKEW_CONSTANT, CHANNEL_SKEW_FILTER)


@dataclass(frozen=True)
class Number:
    """Parameter of a form: default, range of the draw, unit."""

    name: str
    unit: str
    default: float
    low: float
    high: float


@dataclass(frozen=True)
class Form:
    """Functional form of an effect.

    Attributes
    ----------
    effect, form
        Names; an unfamiliar shape has the effect `unfamiliar`.
    code
        Code in the kernel.
    numbers
        Parameters in the order of the kernel; the first one is the strength.
    strongest
        Largest strength that is physically reasonable.
    needs
        `varying-drive` if the effect cannot be observed at constant current.
    """

    effect: str
    form: str
    code: int
    numbers: tuple[Number, ...]
    strongest: float
    needs: str = ""


def _form(effect: str, form: str, code: int, strongest: float, *numbers: tuple[Any, ...], needs: str = "") -> Form:
    return Form(effect, form, code, tuple(Number(*item) for item in numbers), strongest, needs)


# fmt: off
FORMS: tuple[Form, ...] = (
    _form("offset", "per-test", coefficient.OFFSET_PER_TEST, 1e4, ("spread", "N", 5.0, 1.0, 10.0)),
    _form(
        "offset", "with-drive", coefficient.OFFSET_DRIVE, 1e4,
        ("per_ampere_to_the_power", "N", 3.0, 1.0, 8.0), ("power", "1", 1.2, 0.8, 1.6),
    ),
    _form(
        "accumulator", "gas-spring", coefficient.ACCUMULATOR_GAS, 1e6,
        ("stiffness", "N/m", 800.0, 200.0, 3000.0), ("gas_length", "m", 0.08, 0.06, 0.15),
        ("preload", "N", 0.0, 0.0, 5.0),
    ),
    _form(
        "accumulator", "bladder", coefficient.ACCUMULATOR_BLADDER, 1e6,
        ("stiffness", "N/m", 800.0, 200.0, 3000.0), ("stiffening_length", "m", 0.03, 0.02, 0.06),
        ("preload", "N", 0.0, -5.0, 5.0),
    ),
    _form(
        "inertia", "lagged", coefficient.INERTIA_LAGGED, 1e4,
        ("mass", "kg", 8.0, 2.0, 40.0), ("lag", "s", 0.0015, 0.0005, 0.003),
    ),
    _form(
        "inertia", "plain", coefficient.INERTIA_PLAIN, 1e4,
        ("mass", "kg", 8.0, 2.0, 40.0), ("growth_length", "m", 0.03, 0.02, 0.06),
    ),
    _form(
        "asymmetry", "yield", coefficient.ASYMMETRY_YIELD, 0.9,
        ("share", "1", 0.08, 0.02, 0.3), ("rounding_speed", "m/s", 0.002, 0.0005, 0.004),
    ),
    _form(
        "asymmetry", "force", coefficient.ASYMMETRY_FORCE, 0.9,
        ("share", "1", 0.08, 0.02, 0.3), ("rounding_force", "N", 2.0, 0.5, 5.0),
    ),
    _form(
        "stribeck", "rational", coefficient.STRIBECK_RATIONAL, 5.0,
        ("share", "1", 0.4, 0.1, 1.0), ("speed", "m/s", 0.012, 0.006, 0.025),
    ),
    _form(
        "stribeck", "cusp", coefficient.STRIBECK_CUSP, 5.0,
        ("share", "1", 0.6, 0.1, 1.0), ("speed", "m/s", 0.008, 0.003, 0.015),
    ),
    _form(
        "quadratic-drag", "power", coefficient.DRAG_POWER, 1e7,
        ("drag", "N*(s/m)^power", 4000.0, 500.0, 9000.0), ("power", "1", 1.9, 1.8, 2.2),
    ),
    _form(
        "quadratic-drag", "turbulent", coefficient.DRAG_TURBULENT, 1e7,
        ("drag", "N*s^2/m^2", 5000.0, 500.0, 9000.0), ("onset_speed", "m/s", 0.01, 0.004, 0.03),
    ),
    _form(
        "rate-dependent-yield", "creep", coefficient.RATE_CREEP, 0.5,
        ("speed", "m/s", 0.01, 0.002, 0.03),
    ),
    _form(
        "rate-dependent-yield", "eyring", coefficient.RATE_EYRING, 1.0,
        ("share", "1", 0.3, 0.1, 1.0), ("speed", "m/s", 0.004, 0.002, 0.02),
        ("reference_speed", "m/s", 0.1, 0.06, 0.15),
    ),
    _form(
        "migration", "stretched-time", coefficient.MIGRATION_STRETCHED, 0.95,
        ("share", "1", 0.3, 0.05, 0.6), ("time", "s", 0.06, 0.03, 0.15), ("power", "1", 0.8, 0.7, 1.3),
    ),
    _form(
        "migration", "slip", coefficient.MIGRATION_SLIP, 0.95,
        ("share", "1", 0.3, 0.05, 0.6), ("slip", "m", 0.0015, 0.0006, 0.003),
    ),
    _form(
        "remanence", "relaxing", current.REMANENCE_RELAXING, 4.0,
        ("share", "1", 0.6, 0.2, 0.9), ("saturation", "A", 3.0, 2.0, 6.0), ("rise_time", "s", 0.02, 0.01, 0.03),
        ("fade_time", "s", 0.4, 0.3, 1.5), ("fade_slip", "m", 0.02, 0.02, 0.15), needs="varying-drive",
    ),
    _form(
        "remanence", "domains", current.REMANENCE_DOMAINS, 2.5,
        ("gain", "1", 0.6, 0.2, 1.0), ("threshold", "A", 0.9, 0.7, 1.5), needs="varying-drive",
    ),
    _form(
        "heating", "two-nodes", coefficient.HEATING_TWO_NODES, 1.0,
        ("sensitivity", "1/K", 0.01, 0.003, 0.03), ("fluid_capacity", "J/K", 6.0, 3.0, 15.0),
        ("exchange", "W/K", 0.6, 0.3, 1.2), ("housing_capacity", "J/K", 60.0, 30.0, 120.0),
        ("loss", "W/K", 0.5, 0.2, 1.0),
    ),
    _form(
        "heating", "one-node", coefficient.HEATING_ADIABATIC, 1.0,
        ("sensitivity", "1/K", 0.01, 0.003, 0.03), ("fluid_capacity", "J/K", 6.0, 3.0, 15.0),
        ("loss_time", "s", 15.0, 6.0, 40.0),
    ),
    _form("backlash", "free", kernel.BACKLASH_FREE, 2e-3, ("gap", "m", 15e-6, 10e-6, 300e-6)),
    _form(
        "backlash", "held", kernel.BACKLASH_HELD, 2e-3,
        ("gap", "m", 15e-6, 10e-6, 300e-6), ("hardness", "1", 8.0, 5.0, 12.0),
    ),
    _form(
        "delay", "dead-time", current.DELAY_DEAD_TIME, 0.12, ("time", "s", 0.01, 0.004, 0.05), needs="varying-drive"
    ),
    _form(
        "delay", "second-order", current.DELAY_SECOND_ORDER, 0.12,
        ("time", "s", 0.01, 0.004, 0.05), ("damping_ratio", "1", 0.8, 0.6, 1.0), needs="varying-drive",
    ),
    _form(
        "saturation", "knee", current.SATURATION_KNEE, 4.0, ("inverse_knee", "1", 1.4, 1.0, 2.5),
        ("sharpness", "1", 5.0, 4.0, 8.0),
    ),
    _form(
        "saturation", "driver", current.SATURATION_DRIVER, 4.0, ("inverse_limit", "1", 1.5, 1.0, 2.5),
        ("rate", "A/s", 400.0, 200.0, 800.0),
    ),
    _form(
        "pinching", "quartic", coefficient.PINCHING_QUARTIC, 0.95,
        ("share", "1", 0.4, 0.1, 0.8), ("width", "m", 0.0025, 0.0015, 0.0045), ("centre", "m", 0.0, -5e-4, 5e-4),
    ),
    _form(
        "pinching", "cusp", coefficient.PINCHING_CUSP, 0.95,
        ("share", "1", 0.4, 0.1, 0.8), ("width", "m", 0.002, 0.0012, 0.004), ("centre", "m", 0.0, -5e-4, 5e-4),
    ),
    _form("channel-skew", "constant", CHANNEL_SKEW_CONSTANT, 0.1, ("time", "s", 0.003, 0.001, 0.01)),
    _form("channel-skew", "filter", CHANNEL_SKEW_FILTER, 0.1, ("time", "s", 0.003, 0.001, 0.01)),
    _form(
        "end-stop", "hertz", coefficient.END_STOP_HERTZ, 1e9,
        ("stiffness", "N/m^1.5", 5e5, 1e5, 3e6), ("clearance", "m", 0.0085, 0.0065, 0.009),
        ("damping", "s/m", 0.8, 0.2, 1.5),
    ),
    _form(
        "end-stop", "rubber", coefficient.END_STOP_RUBBER, 1e9,
        ("stiffness", "N/m", 3e4, 1e4, 1e5), ("clearance", "m", 0.008, 0.006, 0.009),
        ("hardening_length", "m", 0.001, 0.0008, 0.002),
    ),
    _form(
        "unfamiliar", "cogging", coefficient.COGGING, 1e4,
        ("amplitude", "N", 8.0, 2.0, 20.0), ("pitch", "m", 0.0028, 0.0022, 0.0036), ("phase", "rad", 0.7, 0.0, 6.28),
    ),
    _form(
        "unfamiliar", "field-parity", coefficient.FIELD_PARITY, 1e4,
        ("per_ampere", "N/A", 5.0, 1.0, 20.0), ("length", "m", 0.006, 0.005, 0.008),
    ),
    _form(
        "unfamiliar", "pump-ripple", coefficient.PUMP_RIPPLE, 1e4,
        ("amplitude", "N", 8.0, 2.0, 20.0), ("frequency", "Hz", 6.3, 5.3, 8.1), ("phase", "rad", 0.3, 0.0, 6.28),
    ),
)
# fmt: on
EFFECT_NAMES = tuple(dict.fromkeys(form.effect for form in FORMS if form.effect != "unfamiliar"))
"""The effects of docs/effects.md that can be planted in a damper."""


def find_form(effect: str, form: str = "", *, source: str = "laboratory.effects") -> Form:
    """Return a form by name (the first form of the effect if no form is named).

    Raises
    ------
    UserError
        If the effect or the form does not exist.
    """
    found = [item for item in FORMS if item.effect == effect and form in ("", item.form)]
    if not found:
        forms = [item.form for item in FORMS if item.effect == effect]
        known = (
            f"forms of {effect}: {', '.join(forms)}" if forms else f"known: {', '.join((*EFFECT_NAMES, 'unfamiliar'))}"
        )
        raise UserError(source, f"{effect} {form}".strip(), "no such effect", known)
    return found[0]


@dataclass(frozen=True)
class Planted:
    """Effect of the true damper.

    Attributes
    ----------
    form
        Form of the effect.
    values
        Parameter -> value, SI; missing parameters have their defaults.
    strength_share
        Ratio of the RMS of the effect to the RMS of the force, to which the strength is scaled; None: the strength is
        that of `values`.
    declared
        Whether campaign.yaml names the effect.
    """

    form: Form
    values: Mapping[str, float] = field(default_factory=dict)
    strength_share: float | None = None
    declared: bool = False

    def __post_init__(self) -> None:
        known = [number.name for number in self.form.numbers]
        for name in self.values:
            if name not in known:
                raise UserError(f"effect {self.form.effect}", name, "no such number", f"known: {', '.join(known)}")

    @property
    def name(self) -> str:
        """Name as in docs/effects.md (`unfamiliar` for shapes of no family)."""
        return self.form.effect

    @property
    def strength(self) -> float:
        """Value of the first parameter."""
        return self.number(0)

    def number(self, index: int) -> float:
        """Return a parameter by its index."""
        number = self.form.numbers[index]
        return float(self.values.get(number.name, number.default))

    def with_strength(self, strength: float) -> Planted:
        """Return the effect with another strength."""
        values = {**self.values, self.form.numbers[0].name: float(strength)}
        return Planted(self.form, values, self.strength_share, self.declared)

    def described(self) -> dict[str, Any]:
        """Return the effect in the form of the sealed file."""
        return {
            "name": self.name,
            "form": self.form.form,
            "declared": self.declared,
            "requested_share": self.strength_share,
            "parameters": {
                number.name: {"value": self.number(index), "unit": number.unit}
                for index, number in enumerate(self.form.numbers)
            },
        }


def packed(effects: tuple[Planted, ...]) -> tuple[IntArray, FloatArray]:
    """Return codes (k,) and numbers (k, 8) for the kernel, without the effects of the sensors."""
    inside = [effect for effect in effects if effect.form.code not in SENSOR_CODES]
    values = np.zeros((len(inside), kernel.PARAMETERS))
    for row, effect in enumerate(inside):
        for column in range(len(effect.form.numbers)):
            values[row, column] = effect.number(column)
    return np.array([effect.form.code for effect in inside], dtype=np.int64), values


def draw_hidden_effect(
    rng: np.random.Generator,
    names: tuple[str, ...] = EFFECT_NAMES,
    share: float | tuple[float, float] | None = None,
) -> Planted:
    """Draw an undeclared effect: name, form and parameters, and its share of the RMS force.

    Parameters
    ----------
    rng
        Generator.
    names
        Effects to draw from (`unfamiliar` for shapes of no family).
    share
        Ratio of the RMS of the effect to the RMS of the force; a pair: a range to draw from; None: the drawn strength
        is used.
    """
    name = names[int(rng.integers(len(names)))]
    forms = [form for form in FORMS if form.effect == name]
    if not forms:
        find_form(name)
    form = forms[int(rng.integers(len(forms)))]
    values = {
        number.name: float(np.exp(rng.uniform(np.log(number.low), np.log(number.high))))
        if number.low > 0.0
        else float(rng.uniform(number.low, number.high))
        for number in form.numbers
    }
    wanted = float(rng.uniform(*share)) if isinstance(share, tuple) else share
    return Planted(form, values, wanted)
