"""A parametric damper: a form, its numbers, and the chain of steps they make.

The hysteretic variable is normalised to its limit, so that the numbers are those which measurements determine: the
yield force F_y(u) = alpha(u) z_max [N], the yield displacement x_y = z_max/A [m], the share g = gamma/(gamma + beta).
With z_max = (A/(gamma + beta))^(1/n) the thesis' alpha, A, gamma, beta of (2.1) to (2.3) follow from these once one of
them is chosen (only three of the four can be told from measurements), see :func:`thesis_parameters`.

Parameters by form (SI; `u` is the drive in A or V; polynomial coefficients from the constant `_a` up to the cube `_d`,
those left out are 0):

| form | parameters |
| --- | --- |
| all | `c0_a`..`_d` (N s/m, N s/m/u, ...), `yield_force_a`..`_d` (N, N/u, ...), `eta` (1/s; left out: no lag) |
| `bouc-wen`, `dahl` | `yield_displacement` (m), `gamma_share`, `exponent` |
| `bingham` | `transition_velocity` (m/s; 0: a jump) |
| `modified-bouc-wen` | as bouc-wen, and `c1_a`, `c1_b`, `k0`, `k1` (N/m), `x0` (m) |
| `rounded-yield` | as bouc-wen, and `rounded_force_a`..`_d`, `velocity_scale` (m/s): + alpha_v(u) tanh(v/v0) |
| `power-yield` | as bouc-wen, and `reference_velocity` (m/s), `velocity_exponent`: yield force x (v/v_ref)^p |
| `saturating-dashpot` | `spring_rate` (1/m), `velocity_scale` (m/s): z' = q (v - v0 atanh z) |
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray, ParameterSet
from mrpipe.dampers import drive as _drive
from mrpipe.dampers import hysteresis as _hysteresis
from mrpipe.dampers import modified as _modified
from mrpipe.dampers import viscoplastic as _viscoplastic
from mrpipe.dampers.plant import FORCE, Chain, Step, build_chain, run_chain
from mrpipe.errors import UserError

KNOWN_FORMS = (
    "bouc-wen",
    "modified-bouc-wen",
    "bingham",
    "dahl",
    "rounded-yield",
    "power-yield",
    "saturating-dashpot",
)
"""Every form that a model can have."""

HYSTERETIC_FORMS = ("bouc-wen", "modified-bouc-wen", "dahl", "rounded-yield", "power-yield")
"""Forms that hold the Bouc-Wen hysteresis."""

_TESTED = {"displacement": "m", "velocity": "m/s"}


@dataclass(frozen=True)
class DamperModel:
    """A damper with its numbers.

    Attributes
    ----------
    form
        One of :data:`KNOWN_FORMS`.
    parameters
        Name -> value, SI, named as in the table of this module.
    drive_unit
        `A` or `V`.
    drive_limit
        Largest drive that the damper takes (and that the numbers hold for), in `drive_unit`.
    """

    form: str
    parameters: Mapping[str, float]
    drive_unit: str = "A"
    drive_limit: float = math.inf

    def polynomial(self, name: str) -> FloatArray:
        """Return the four coefficients `<name>_a` .. `<name>_d`, constant first."""
        return np.array([self.parameters.get(f"{name}_{letter}", 0.0) for letter in "abcd"])

    def yield_force(self, drive: FloatArray | float) -> FloatArray:
        """Return F_y(u) [N] at rest of all lags, of the shape of `drive`."""
        return _polynomial(drive, self.polynomial("yield_force"))

    def viscosity(self, drive: FloatArray | float) -> FloatArray:
        """Return c0(u) [N s/m], of the shape of `drive`."""
        return _polynomial(drive, self.polynomial("c0"))

    def steps(self) -> list[Step]:
        """Return the steps of the model, to be put in a chain with those of effects."""
        numbers = self.parameters
        steps = [_drive.polynomial_coefficients(self.polynomial("yield_force"), self.polynomial("c0"))]
        if math.isfinite(numbers.get("eta", math.inf)):
            steps.append(_drive.driver_lag(numbers["eta"]))
        if self.form == "bingham":
            steps.append(_viscoplastic.velocity_sign(numbers.get("transition_velocity", 0.0)))
        elif self.form == "saturating-dashpot":
            steps.append(_viscoplastic.saturating_dashpot(numbers["spring_rate"], numbers["velocity_scale"]))
        elif self.form == "modified-bouc-wen":
            steps.extend(
                _modified.series_dashpot(
                    *self._hysteresis(),
                    series_viscosity=(numbers["c1_a"], numbers.get("c1_b", 0.0)),
                    inner_stiffness=numbers.get("k0", 0.0),
                    outer_stiffness=numbers.get("k1", 0.0),
                    rest_displacement=numbers.get("x0", 0.0),
                )
            )
        else:
            steps.append(_hysteresis.hysteresis(*self._hysteresis()))
        if self.form == "power-yield":
            steps.append(_viscoplastic.power_of_velocity(numbers["reference_velocity"], numbers["velocity_exponent"]))
        if self.form == "rounded-yield":
            steps.append(_viscoplastic.rounded_yield(numbers["velocity_scale"], self.polynomial("rounded_force")))
        return steps

    def chain(self, extra: Sequence[Step] = ()) -> Chain:
        """Return the chain of the model's steps and `extra` ones (effects)."""
        return build_chain([*self.steps(), *extra])

    def force(
        self,
        displacement: FloatArray,
        velocity: FloatArray,
        acceleration: FloatArray,
        drive: FloatArray,
        dt: float,
    ) -> FloatArray:
        """Return the force [N], shape (n,), for a recorded motion.

        Parameters
        ----------
        displacement, velocity, acceleration, drive
            Shape (n,); m, m/s, m/s^2, A or V.
        dt
            Sampling interval [s].
        """
        return run_chain(self.chain(), displacement, velocity, acceleration, drive, dt)[:, FORCE]

    def quasi_static_force(self, velocity: FloatArray | float, drive: FloatArray | float) -> FloatArray:
        """Return the post-yield force [N]: the hysteresis fully yielded in the direction of motion, no lag.

        This is what inverses work with. `velocity` [m/s] and `drive` broadcast against each other. The springs of the
        modified Bouc-Wen model are left out, for they need the displacement.
        """
        speed = np.abs(np.asarray(velocity, dtype=np.float64))
        numbers = self.parameters
        viscous = self.viscosity(drive) * speed
        force = self.yield_force(drive)
        if self.form == "power-yield":
            force = force * (speed / numbers["reference_velocity"]) ** numbers["velocity_exponent"]
        elif self.form == "saturating-dashpot":
            force = force * np.tanh(speed / numbers["velocity_scale"])
        elif self.form == "bingham" and numbers.get("transition_velocity", 0.0) > 0.0:
            force = force * np.tanh(speed / numbers["transition_velocity"])
        elif self.form == "rounded-yield":
            rounded = _polynomial(drive, self.polynomial("rounded_force"))
            force = force + rounded * np.tanh(speed / numbers["velocity_scale"])
        total = force + viscous
        if self.form == "modified-bouc-wen":
            # below the speed at which the series dashpot carries the yield force it alone moves
            series = numbers["c1_a"] + numbers.get("c1_b", 0.0) * np.asarray(drive, dtype=np.float64)
            total = np.minimum(series * speed, series * total / (self.viscosity(drive) + series))
        return np.asarray(np.sign(velocity) * total, dtype=np.float64)

    def _hysteresis(self) -> tuple[float, float, float]:
        numbers = self.parameters
        if self.form == "dahl":
            return numbers["yield_displacement"], 1.0, 1.0
        return numbers["yield_displacement"], numbers.get("gamma_share", 0.5), numbers.get("exponent", 2.0)


def _polynomial(drive: FloatArray | float, coefficients: FloatArray) -> FloatArray:
    values = np.polynomial.polynomial.polyval(np.asarray(drive, dtype=np.float64), coefficients)
    return np.asarray(values, dtype=np.float64)


def parameter_unit(name: str, drive_unit: str) -> str:
    """Return the SI unit of a parameter of :class:`DamperModel` (or of :func:`thesis_parameters`)."""
    base = {"yield_force": "N", "rounded_force": "N", "c0": "N*s/m", "c1": "N*s/m", "alpha": "N/m"}
    stem, _, letter = name.rpartition("_")
    if stem in base and letter in ("a", "b", "c", "d"):
        power = "abcd".index(letter)
        return base[stem] + ("" if power == 0 else f"/{drive_unit}" + ("" if power == 1 else f"^{power}"))
    return {
        "eta": "1/s",
        "yield_displacement": "m",
        "transition_velocity": "m/s",
        "reference_velocity": "m/s",
        "velocity_scale": "m/s",
        "spring_rate": "1/m",
        "k0": "N/m",
        "k1": "N/m",
        "x0": "m",
        "gamma": "1/m^2",
        "beta": "1/m^2",
    }.get(name, "1")


def thesis_parameters(model: DamperModel, A: float = 1000.0) -> dict[str, float]:
    """Return alpha_a..alpha_d [N/m, N/m/A, ...], gamma, beta [1/m^n] and A of (2.2), (2.3) for a chosen A.

    x_y = z_max/A gives z_max, z_max^n = A/(gamma + beta) the sum and the share the two; any other A describes the same
    damper.

    Raises
    ------
    ValueError
        If the form holds no Bouc-Wen hysteresis.
    """
    if model.form not in HYSTERETIC_FORMS:
        raise ValueError(f"form {model.form!r} has no gamma, beta and A")
    yield_displacement, share, exponent = model._hysteresis()
    z_max = yield_displacement * A
    total = A / z_max**exponent
    alpha = {
        f"alpha_{letter}": value / z_max for letter, value in zip("abcd", model.polynomial("yield_force"), strict=True)
    }
    return {**alpha, "gamma": share * total, "beta": (1.0 - share) * total, "A": A, "n": exponent}


def bouc_wen_limits(A: float, gamma: float, beta: float, n: float) -> tuple[float, float, float]:
    """Return z_max [m], the yield displacement [m] and the share of gamma from the thesis' parameters."""
    z_max = (A / (gamma + beta)) ** (1.0 / n)
    return z_max, z_max / A, gamma / (gamma + beta)


def damper_from_parameter_set(parameters: ParameterSet) -> DamperModel:
    """Return the damper that a parameter set describes, in the thesis' notation or in that of this module.

    Raises
    ------
    UserError
        If the model is not known or a parameter is missing.
    """
    source = f"configs/dampers/{parameters.name}"
    given = {name: float(value) for name, value in parameters.values.items()}
    if parameters.model not in KNOWN_FORMS:
        raise UserError(source, "model", f"{parameters.model!r} is no damper form", f"known: {', '.join(KNOWN_FORMS)}")
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
    """Write a model to `group` of an artifact: a scalar dataset with its unit for each parameter."""
    for name, value in model.parameters.items():
        artifact.put(f"{group}/parameters/{name}", float(value), unit=parameter_unit(name, model.drive_unit))
    artifact.attributes(group, form=model.form, drive_unit=model.drive_unit, drive_limit=float(model.drive_limit))


def read_damper(artifact: Artifact, group: str = "damper") -> DamperModel:
    """Read what :func:`write_damper` wrote."""
    notes = artifact.attributes(group)
    names = artifact.members(f"{group}/parameters")
    return DamperModel(
        form=str(notes["form"]),
        parameters={name: artifact.scalar(f"{group}/parameters/{name}") for name in names},
        drive_unit=str(notes["drive_unit"]),
        drive_limit=float(notes["drive_limit"]),
    )


def write_tested(artifact: ArtifactWriter, largest: Mapping[str, float]) -> None:
    """Write the largest |displacement| [m] and |velocity| [m/s] of the tests that a model was identified from."""
    for name, unit in _TESTED.items():
        artifact.put(f"tested/{name}", float(largest[name]), unit=unit)


def read_tested(artifact: Artifact) -> dict[str, float]:
    """Return what :func:`write_tested` wrote; empty where nothing is known of the tests."""
    return {name: artifact.scalar(f"tested/{name}") for name in artifact.members("tested")}
