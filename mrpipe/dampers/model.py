"""A damper model: a base form, effects, their numbers, and the chain of steps.

The hysteretic variable is normalised to its limit, so that measurements determine all numbers: the yield force F_y(u) =
alpha(u) z_max [N], the yield displacement x_y = z_max/A [m], the share g = gamma/(gamma + beta). With z_max = (A/(gamma
+ beta))^(1/n) the parameters alpha, A, gamma, beta of (2.1) to (2.3) in the thesis follow from these numbers once one
of them is chosen, because measurements determine only three of the four, see :func:`thesis_parameters`.

The numbers of every damper (SI; `u` is the drive in A or V) are the laws of the drive `yield_force`, `c0` and, if the
form has a second yielding part, the law of that part (see :func:`mrpipe.dampers.laws.law_names`: `yield_force_a` [N],
`yield_force_b` [N/u], ...; coefficients that are left out are 0), `eta` [1/s] (left out: no lag; with `eta_fall` it is
the rate of a rising drive only), and those that the form lists (`mrpipe/dampers/forms/<form>.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray, ParameterSet
from mrpipe.dampers import drive as _drive
from mrpipe.dampers.form import BaseForm, Strength
from mrpipe.dampers.in_use import steady_force
from mrpipe.dampers.laws import Law, law_of, law_unit
from mrpipe.dampers.library import base_form, base_forms
from mrpipe.dampers.parameters import Values
from mrpipe.dampers.plant import FORCE, Chain, Step, build_chain, run_chain
from mrpipe.errors import UserError

_TESTED = {"displacement": "m", "velocity": "m/s"}

_BLOCK_UNITS = {"yield_force": "N", "c0": "N*s/m", "c1": "N*s/m", "alpha": "N/m"}


@dataclass(frozen=True)
class Addition:
    """An effect of a damper, with its numbers.

    Attributes
    ----------
    name, form
        Name and form of the effect in the library of effects.
    values
        Parameter -> value, SI.
    units
        Parameter -> unit.
    sensor
        Whether it is a fault of sensors, which belongs to the recordings and is not part of the chain.
    steps
        (values) -> steps of the chain.
    file
        File of the user that defines the effect; empty for effects of the library.
    """

    name: str
    form: str
    values: Mapping[str, float]
    units: Mapping[str, str]
    sensor: bool
    steps: Callable[[Values], list[Step]] = field(compare=False, repr=False)
    file: str = ""


@dataclass(frozen=True)
class DamperModel:
    """A damper model with its numbers.

    Attributes
    ----------
    form
        Name of a base form, see :mod:`mrpipe.dampers.library`.
    parameters
        Name -> value, SI; the names are explained in this module.
    drive_unit
        `A` or `V`.
    drive_limit
        Largest drive of the damper, up to which the numbers are valid, in `drive_unit`.
    laws
        Block -> kind of its law of the drive; blocks that are not listed have polynomials.
    effects
        Effects that act in addition to the base form.
    stroke_m
        Half the largest peak-to-peak displacement of the tests [m]; effects with a memory need it for the force at
        constant speed.
    form_file
        File of the user that defines the form; empty for forms of the library.
    """

    form: str
    parameters: Mapping[str, float]
    drive_unit: str
    drive_limit: float = math.inf
    laws: Mapping[str, str] = field(default_factory=dict)
    effects: tuple[Addition, ...] = ()
    stroke_m: float = 0.01
    form_file: str = ""

    @property
    def base(self) -> BaseForm:
        """The base form."""
        return base_form(self.form, self.form_file)

    def law(self, block: str) -> Law:
        """Return the law of the drive of `yield_force`, `c0` or another block of the form."""
        return law_of(block, self.parameters, self.laws.get(block, "polynomial"))

    def polynomial(self, name: str) -> FloatArray:
        """Return the four coefficients `<name>_a` .. `<name>_d`, constant first."""
        return np.array([self.parameters.get(f"{name}_{letter}", 0.0) for letter in "abcd"])

    def yield_force(self, drive: FloatArray | float) -> FloatArray:
        """Return F_y(u) [N] in steady state, with the shape of `drive`."""
        return self.law("yield_force")(drive)

    def viscosity(self, drive: FloatArray | float) -> FloatArray:
        """Return c0(u) [N s/m], with the shape of `drive`."""
        return self.law("c0")(drive)

    def base_steps(self) -> list[Step]:
        """Return the steps of the base form, its laws and the lag of the driver."""
        numbers, base = self.parameters, self.base
        steps = [_drive.coefficients(*(self.law(block) for block in base.blocks))]
        eta = numbers.get("eta", math.inf)
        if math.isfinite(eta):
            falling = numbers.get("eta_fall")
            steps.append(_drive.driver_lag(eta) if falling is None else _drive.driver_lag_apart(eta, falling))
        return [*steps, *base.steps(numbers)]

    def steps(self) -> list[Step]:
        """Return the steps of the damper with its effects; faults of sensors are not part of it."""
        added = [step for item in self.effects if not item.sensor for step in item.steps(item.values)]
        return [*self.base_steps(), *added]

    def chain(self, extra: Sequence[Step] = ()) -> Chain:
        """Return the chain of the steps of the damper and of `extra` steps."""
        return build_chain([*self.steps(), *extra])

    def force(
        self,
        displacement: FloatArray,
        velocity: FloatArray | float,
        acceleration: FloatArray | float,
        drive: FloatArray | float,
        dt: float,
    ) -> FloatArray:
        """Return the force [N], shape (n,), for a recorded motion.

        Parameters
        ----------
        displacement, velocity, acceleration, drive
            Shape (n,), or a number for a constant; m, m/s, m/s^2, A or V.
        dt
            Sampling interval [s].

        Raises
        ------
        UserError
            If the lengths differ, or the interval is not positive.
        """
        given = {"displacement": displacement, "velocity": velocity, "acceleration": acceleration, "drive": drive}
        x, v, a, u = _of_one_length(given)
        return run_chain(self.chain(), x, v, a, u, _positive(dt))[:, FORCE]

    def quasi_static_force(self, velocity: FloatArray | float, drive: FloatArray | float) -> FloatArray:
        """Return the post-yield force [N]: the hysteresis has yielded in the direction of motion, and there is no lag.

        Inverses of the damper use this force. `velocity` [m/s] and `drive` broadcast against each other. Springs are
        left out, because they need the displacement. With effects the force is simulated over the stroke of the tests
        at constant speed, the mean of both directions.
        """
        if any(not item.sensor for item in self.effects):
            return steady_force(self.chain(), velocity, drive, self.stroke_m, self.drive_limit)
        speed, u = np.broadcast_arrays(np.abs(np.asarray(velocity, dtype=np.float64)), np.asarray(drive, np.float64))
        base = self.base
        part = self.law(base.part)(u) if base.part else np.zeros_like(u)
        total = base.post_yield(self.parameters, Strength(speed, u, self.yield_force(u), self.viscosity(u), part))
        return np.asarray(np.sign(velocity) * total, dtype=np.float64)

    def unit(self, name: str) -> str:
        """Return the SI unit of a parameter."""
        return parameter_unit(name, self.drive_unit, self.base)


def _of_one_length(given: Mapping[str, FloatArray | float]) -> list[FloatArray]:
    """Return signals of shape (n,); the compiled loop does not check lengths and would read beyond the end of one."""
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in given.items()}
    count = max(array.size for array in arrays.values())
    for name, array in arrays.items():
        if array.ndim and array.shape != (count,):
            problem = f"has the shape {array.shape}, another signal has {count} samples"
            raise UserError(
                "force", name, problem, f"give an array of the shape ({count},), or a number for a constant"
            )
    return [array if array.ndim else np.full(count, float(array)) for array in arrays.values()]


def _positive(dt: float) -> float:
    if not 0.0 < dt < math.inf:
        raise UserError("force", "dt", f"is {dt:g}", "a sampling interval above 0 s expected")
    return dt


def parameter_unit(name: str, drive_unit: str, form: BaseForm | None = None) -> str:
    """Return the SI unit of a parameter of :class:`DamperModel` (or of :func:`thesis_parameters`).

    Parameters
    ----------
    name
        Name of the result, for messages.
    drive_unit
        `A` or `V`.
    form
        Form that the parameter belongs to; by default all forms of the library are searched.
    """
    stem, _, suffix = name.rpartition("_")
    forms = list(base_forms().values()) if form is None else [form]
    for item in forms:
        unit = item.unit(name)
        if unit is not None:
            return unit.replace("drive", drive_unit)
    blocks = _BLOCK_UNITS | {item.part: "N" for item in forms if item.part}
    if stem in blocks and suffix in (*"abcdef", "saturating", "scale"):
        return law_unit(blocks[stem], suffix, drive_unit)
    return {"eta": "1/s", "eta_fall": "1/s", "x0": "m", "gamma": "1/m^2", "beta": "1/m^2"}.get(name, "1")


def thesis_parameters(model: DamperModel, A: float = 1000.0) -> dict[str, float]:
    """Return alpha_a..alpha_d [N/m, N/m/A, ...], gamma, beta [1/m^n] and A of (2.2), (2.3) for a chosen A.

    x_y = z_max/A gives z_max, then z_max^n = A/(gamma + beta) gives the sum gamma + beta, and the share of gamma gives
    both. Any other A describes the same damper.

    Raises
    ------
    ValueError
        If the form has no Bouc-Wen hysteresis.
    """
    numbers = model.base.hysteresis
    if numbers is None:
        raise ValueError(f"form {model.form!r} has no gamma, beta and A")
    yield_displacement, share, exponent = numbers(model.parameters)
    z_max = yield_displacement * A
    total = A / z_max**exponent
    alpha = {
        f"alpha_{letter}": value / z_max for letter, value in zip("abcd", model.polynomial("yield_force"), strict=True)
    }
    return {**alpha, "gamma": share * total, "beta": (1.0 - share) * total, "A": A, "n": exponent}


def bouc_wen_limits(A: float, gamma: float, beta: float, n: float) -> tuple[float, float, float]:
    """Return z_max [m], the yield displacement [m] and the share of gamma from the parameters of the thesis."""
    z_max = (A / (gamma + beta)) ** (1.0 / n)
    return z_max, z_max / A, gamma / (gamma + beta)


def damper_from_parameter_set(parameters: ParameterSet) -> DamperModel:
    """Return the damper that a parameter set describes, in the notation of the thesis or of this module.

    Raises
    ------
    UserError
        If the model is unknown or a parameter is missing.
    """
    source = f"configs/dampers/{parameters.name}"
    for name, value in parameters.values.items():
        if value.size != 1:
            raise UserError(source, f"parameters.{name}", f"has {value.size} values", "give one number")
    given = {name: float(value.item()) for name, value in parameters.values.items()}
    known = base_forms()
    if parameters.model not in known:
        raise UserError(source, "model", f"{parameters.model!r} is not a base form", f"known: {', '.join(known)}")
    if "drive_limit" not in given:
        raise UserError(source, "parameters", "no drive_limit", "write {value: 4, unit: A}")
    drive_limit = given.pop("drive_limit")
    unit = parameters.units["drive_limit"]
    drive_unit = "V" if unit.endswith("V") else "A"
    try:
        numbers = _from_thesis_notation(given) if "A" in given else given
        model = DamperModel(parameters.model, numbers, drive_unit, drive_limit)
        model.steps()
    except KeyError as error:
        raise UserError(source, "parameters", f"no {error.args[0]}", "add it with its unit") from error
    return model


def _from_thesis_notation(given: Mapping[str, float]) -> dict[str, float]:
    numbers = {
        name: value
        for name, value in given.items()
        if not name.startswith("alpha_") and name not in ("A", "gamma", "beta", "n")
    }
    exponent = given.get("n", 2.0)
    z_max, yield_displacement, share = bouc_wen_limits(given["A"], given["gamma"], given["beta"], exponent)
    for letter in "abcd":
        if f"alpha_{letter}" in given:
            numbers[f"yield_force_{letter}"] = given[f"alpha_{letter}"] * z_max
    numbers.update(yield_displacement=yield_displacement, gamma_share=share, exponent=exponent)
    return numbers


def write_damper(artifact: ArtifactWriter, model: DamperModel, group: str = "damper") -> None:
    """Write a model to `group` of an artifact: a scalar dataset with its unit for each parameter.

    Effects go into `group/effects/<place>` in the same way.
    """
    for name, value in model.parameters.items():
        artifact.put(f"{group}/parameters/{name}", float(value), unit=model.unit(name))
    artifact.put_json(f"{group}/laws", dict(model.laws))
    artifact.attributes(
        group,
        form=model.form,
        form_file=model.form_file,
        drive_unit=model.drive_unit,
        drive_limit=float(model.drive_limit),
        stroke_m=float(model.stroke_m),
    )
    for place, item in enumerate(model.effects):
        where = f"{group}/effects/{place}"
        for name, value in item.values.items():
            artifact.put(f"{where}/parameters/{name}", float(value), unit=item.units.get(name, "1"))
        artifact.attributes(where, name=item.name, form=item.form, file=item.file, sensor=item.sensor)


def read_damper(
    artifact: Artifact, group: str = "damper", *, effect: Callable[[str, str, str], Addition] | None = None
) -> DamperModel:
    """Read what :func:`write_damper` wrote.

    Parameters
    ----------
    artifact
        Artifact that contains the damper.
    group
        Group inside the artifact.
    effect
        Function of (name, form, file) that returns the effect without its numbers; see
        :func:`mrpipe.effects.damper.read_damper`.

    Raises
    ------
    ValueError
        If the damper has effects and no `effect` is given.
    """
    notes = artifact.attributes(group)
    added = []
    for place in sorted(artifact.members(f"{group}/effects"), key=int):
        where = f"{group}/effects/{place}"
        if effect is None:
            raise ValueError("the damper has effects: read it with mrpipe.effects.damper.read_damper")
        marks = artifact.attributes(where)
        found = effect(str(marks["name"]), str(marks["form"]), str(marks["file"]))
        added.append(replace(found, values=_scalars(artifact, f"{where}/parameters")))
    return DamperModel(
        form=str(notes["form"]),
        parameters=_scalars(artifact, f"{group}/parameters"),
        drive_unit=str(notes["drive_unit"]),
        drive_limit=float(notes["drive_limit"]),
        laws=artifact.json(f"{group}/laws"),
        effects=tuple(added),
        stroke_m=float(notes["stroke_m"]),
        form_file=str(notes["form_file"]),
    )


def _scalars(artifact: Artifact, group: str) -> dict[str, float]:
    return {name: artifact.scalar(f"{group}/{name}") for name in artifact.members(group)}


def write_tested(artifact: ArtifactWriter, largest: Mapping[str, float]) -> None:
    """Write the largest |displacement| [m] and |velocity| [m/s] of the tests that a model was identified from."""
    for name, unit in _TESTED.items():
        artifact.put(f"tested/{name}", float(largest[name]), unit=unit)


def read_tested(artifact: Artifact) -> dict[str, float]:
    """Return the values that :func:`write_tested` wrote; empty if the artifact has none."""
    return {name: artifact.scalar(f"tested/{name}") for name in artifact.members("tested")}
