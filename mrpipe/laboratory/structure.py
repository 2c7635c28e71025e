"""True structure: frame, undeclared effects, and exact time step.

The exact step repeats that of :mod:`mrpipe.signals.discretisation` on purpose: the laboratory shares no code with the
identification, so that an error of the one cannot hide in the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import expm

from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.errors import UserError
from mrpipe.laboratory import structure_kernel as kernel
from mrpipe.laboratory.effects import Form, Number, Planted
from mrpipe.structures import Frame, shear_frame

BRACE, ROCKING, CONTROLLER_DELAY = 20, 21, 22
STOREY_HEIGHT_M = 0.37
_BRACE_MASS_KG = 0.4
_ROCKING_INERTIA_SHARE = 0.2


def _form(effect: str, form: str, code: int, strongest: float, *numbers: tuple[str, str, float, float, float]) -> Form:
    return Form(effect, form, code, tuple(Number(*item) for item in numbers), strongest)


# fmt: off
FRAME_FORMS: tuple[Form, ...] = (
    _form(
        "joint-friction", "dahl", kernel.JOINT_FRICTION_DAHL, 500.0,
        ("force", "N", 0.5, 0.1, 3.0), ("presliding", "m", 2e-4, 5e-5, 5e-4),
    ),
    _form(
        "joint-friction", "smooth", kernel.JOINT_FRICTION_SMOOTH, 500.0,
        ("force", "N", 0.5, 0.1, 3.0), ("rounding_speed", "m/s", 0.002, 0.001, 0.005),
        ("stribeck_speed", "m/s", 0.02, 0.01, 0.05),
    ),
    _form(
        "cubic-stiffness", "power", kernel.CUBIC_ODD, 1e12,
        ("stiffness", "N/m^power", 8e6, 1e6, 3e7), ("power", "1", 2.8, 2.6, 3.4),
    ),
    _form(
        "cubic-stiffness", "root", kernel.CUBIC_ROOT, 1e8,
        ("stiffness", "N/m", 4000.0, 1000.0, 10000.0), ("length", "m", 0.01, 0.006, 0.02),
    ),
    _form(
        "impact", "hertz", kernel.IMPACT_HERTZ, 1e10,
        ("stiffness", "N/m^1.5", 5e6, 1e6, 2e7), ("clearance", "m", 0.006, 0.004, 0.01), ("floor", "1", 1.0, 1.0, 1.0),
        ("damping", "s/m", 0.5, 0.1, 1.0),
    ),
    _form(
        "impact", "rubber", kernel.IMPACT_RUBBER, 1e9,
        ("stiffness", "N/m", 2e4, 5e3, 1e5), ("clearance", "m", 0.006, 0.004, 0.01), ("floor", "1", 1.0, 1.0, 1.0),
        ("damping", "s/m", 0.8, 0.1, 1.5),
    ),
    _form("brace-flexibility", "spring", BRACE, 2e-3, ("compliance", "m/N", 2e-5, 5e-6, 1e-4)),
    _form(
        "base-rocking", "uplift", ROCKING, 1e-3,
        ("compliance", "rad/(N*m)", 2e-5, 5e-6, 6e-5), ("uplift_angle", "rad", 2e-3, 5e-4, 5e-3),
    ),
    _form("controller-delay", "dead-time", CONTROLLER_DELAY, 0.2, ("time", "s", 0.015, 0.005, 0.04)),
)
# fmt: on
FRAME_EFFECT_NAMES = tuple(dict.fromkeys(form.effect for form in FRAME_FORMS))


@dataclass(frozen=True)
class TrueStructure:
    """Frame with its undeclared effects.

    Attributes
    ----------
    frame
        Linear part of the structure.
    effects
        Planted effects of the structure (and the controller's delay).
    """

    frame: Frame
    effects: tuple[Planted, ...] = ()

    def with_effects(self, effects: Sequence[Planted]) -> TrueStructure:
        """Return the structure with other effects."""
        return replace(self, effects=tuple(effects))

    def find(self, code: int) -> Planted | None:
        """Return the effect of a code, if it is planted."""
        return next((item for item in self.effects if item.form.code == code), None)

    @property
    def control_delay_s(self) -> float:
        """Delay of the command of the controller [s]."""
        effect = self.find(CONTROLLER_DELAY)
        return 0.0 if effect is None else effect.strength


def find_frame_form(effect: str, form: str = "", *, source: str = "laboratory.frame.hidden_effects") -> Form:
    """Return a form of a structural effect (the first one if no form is named).

    Raises
    ------
    UserError
        If no form has this name.
    """
    found = [item for item in FRAME_FORMS if item.effect == effect and form in ("", item.form)]
    if not found:
        raise UserError(
            source, f"{effect} {form}".strip(), "no such effect of a frame", f"known: {', '.join(FRAME_EFFECT_NAMES)}"
        )
    return found[0]


def draw_frame_effect(
    rng: np.random.Generator, names: tuple[str, ...] = FRAME_EFFECT_NAMES, share: float | None = None
) -> Planted:
    """Draw an undeclared effect of the structure: name, form and parameters."""
    name = names[int(rng.integers(len(names)))]
    forms = [form for form in FRAME_FORMS if form.effect == name]
    form = forms[int(rng.integers(len(forms)))]
    values = {
        number.name: float(np.exp(rng.uniform(np.log(number.low), np.log(number.high)))) for number in form.numbers
    }
    return Planted(form, values, share)


def random_frame(rng: np.random.Generator, floors: int) -> Frame:
    """Return a shear frame of 3 to 8 floors with drawn masses, storeys and damping ratios."""
    masses = 6.0 * np.exp(0.25 * rng.standard_normal(floors))
    storeys = 1e4 * np.exp(0.2 * rng.standard_normal(floors)) * np.linspace(1.2, 0.8, floors)
    ratios = rng.uniform(0.002, 0.012, floors)
    return shear_frame(masses, storeys, ratios, name=f"random frame of {floors} floors")


@dataclass(frozen=True)
class Assembled:
    """Structure in the form that the kernel reads."""

    A: FloatArray
    B: FloatArray
    Ad: FloatArray
    B0: FloatArray
    B1: FloatArray
    w: FloatArray
    drift_rows: FloatArray
    floors: int
    storey_codes: IntArray
    storey_values: FloatArray


def exact_step(A: FloatArray, B: FloatArray, h: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Ad, B0, B1 of z+ = Ad z + B0 u + B1 u+ for inputs linear within the step."""
    n, m = B.shape
    # exponential of the states augmented by u' = s, s' = 0 (Van Loan)
    block = np.zeros((n + 2 * m, n + 2 * m))
    block[:n, :n], block[:n, n : n + m] = A, B
    block[n : n + m, n + m :] = np.eye(m)
    step = expm(block * h)
    level, slope = step[:n, n : n + m], step[:n, n + m :] / h
    return step[:n, :n].copy(), np.ascontiguousarray(level - slope), np.ascontiguousarray(slope)


def assemble(structure: TrueStructure, h: float, *, added_mass_kg: float = 0.0) -> Assembled:
    """Return the structure on a fine clock of step `h` [s].

    Degrees of freedom are the floors (relative to the ground), then a brace node and a rocking angle if these effects
    are planted. `added_mass_kg` moves with the damper's rod.
    """
    frame = structure.frame
    n = frame.floors
    M, C, K = frame.mass.copy(), frame.damping.copy(), frame.stiffness.copy()
    load_of_ground = np.diag(M).copy() if np.count_nonzero(M - np.diag(np.diag(M))) == 0 else M @ np.ones(n)
    w = np.zeros(n)
    w[0] = 1.0
    drift_rows = np.eye(n) - np.eye(n, k=-1)
    M[0, 0] += added_mass_kg
    storeys = [item for item in structure.effects if item.form.code < BRACE]
    codes = [item.form.code for item in storeys]
    values = [[item.number(index) for index in range(len(item.form.numbers))] for item in storeys]
    brace = structure.find(BRACE)
    if brace is not None:
        M, C, K, load_of_ground, drift_rows = _grown(M, C, K, load_of_ground, drift_rows)
        stiffness = 1.0 / max(brace.strength, 1e-7)
        ends = np.zeros(M.shape[0])
        ends[0], ends[-1] = 1.0, -1.0
        K += stiffness * np.outer(ends, ends)
        C += 0.05 * np.sqrt(stiffness * _BRACE_MASS_KG) * np.outer(ends, ends)
        M[-1, -1] = load_of_ground[-1] = _BRACE_MASS_KG
        w = np.zeros(M.shape[0])
        w[-1] = 1.0
    rocking = structure.find(ROCKING)
    if rocking is not None:
        M, C, K, load_of_ground, drift_rows = _grown(M, C, K, load_of_ground, drift_rows)
        w = np.append(w, 0.0)
        heights = np.zeros(M.shape[0] - 1)
        heights[:n] = STOREY_HEIGHT_M * np.arange(1, n + 1)
        stiffness = 1.0 / max(rocking.strength, 1e-9)
        inertia = _ROCKING_INERTIA_SHARE * float(np.sum(np.diag(frame.mass) * heights[:n] ** 2))
        # the deformation of the columns is the motion of the floors minus that due to the rotation of the base
        for matrix in (K, C):
            inner = matrix[:-1, :-1]
            matrix[:-1, -1] = matrix[-1, :-1] = -inner @ heights
            matrix[-1, -1] = heights @ inner @ heights
        K[-1, -1] += stiffness
        C[-1, -1] += 0.02 * np.sqrt(stiffness * inertia)
        M[-1, -1] = inertia
        drift_rows[:, -1] = -STOREY_HEIGHT_M
        codes.append(kernel.ROCKING_UPLIFT)
        values.append([0.3 * stiffness, rocking.number(1)])
    inverse = np.linalg.inv(M)
    size = M.shape[0]
    A = np.zeros((2 * size, 2 * size))
    A[:size, size:] = np.eye(size)
    A[size:, :size], A[size:, size:] = -inverse @ K, -inverse @ C
    B = np.zeros((2 * size, size + 1))
    B[size:, 0] = -inverse @ load_of_ground
    B[size:, 1:] = inverse
    table = np.zeros((len(codes), 8))
    for row, numbers in enumerate(values):
        table[row, : len(numbers)] = numbers
    return Assembled(
        A, B, *exact_step(A, B, h), w, np.ascontiguousarray(drift_rows), n, np.array(codes, dtype=np.int64), table
    )


def _grown(
    M: FloatArray, C: FloatArray, K: FloatArray, load: FloatArray, drift_rows: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return all matrices with one additional degree of freedom whose entries are zero."""
    larger = [np.pad(matrix, ((0, 1), (0, 1))) for matrix in (M, C, K)]
    return larger[0], larger[1], larger[2], np.append(load, 0.0), np.pad(drift_rows, ((0, 0), (0, 1)))
