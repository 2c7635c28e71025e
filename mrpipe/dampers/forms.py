"""The ladder of model forms: their blocks, and how guesses and bounds follow from stroke and speed."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers import modified as _modified
from mrpipe.dampers.form import Form, NonlinearParameter, Scales, Values, bernstein
from mrpipe.dampers.hysteresis import hysteresis_series
from mrpipe.dampers.motion import Motion
from mrpipe.dampers.viscoplastic import dashpot_series


# --- blocks ---------------------------------------------------------------------------------------------------------
def _hysteretic(values: Values, motion: Motion) -> FloatArray:
    return hysteresis_series(
        motion.displacement,
        motion.starts,
        values["yield_displacement"],
        values.get("gamma_share", 0.5),
        values.get("exponent", 2.0),
    )


def _bouc_wen_blocks(values: Values, motion: Motion) -> dict[str, FloatArray]:
    return {"yield_force": _hysteretic(values, motion), "c0": motion.velocity}


def _dahl_blocks(values: Values, motion: Motion) -> dict[str, FloatArray]:
    zeta = hysteresis_series(motion.displacement, motion.starts, values["yield_displacement"], 1.0, 1.0)
    return {"yield_force": zeta, "c0": motion.velocity}


def _bingham_blocks(_values: Values, motion: Motion) -> dict[str, FloatArray]:
    return {"yield_force": np.sign(motion.velocity), "c0": motion.velocity}


def _rounded_blocks(values: Values, motion: Motion) -> dict[str, FloatArray]:
    rounded = np.tanh(motion.velocity / values["velocity_scale"])
    return {"yield_force": _hysteretic(values, motion), "c0": motion.velocity, "rounded_force": rounded}


def _power_blocks(values: Values, motion: Motion) -> dict[str, FloatArray]:
    speed = np.abs(motion.velocity) / values["reference_velocity"]
    rising = _hysteretic(values, motion) * speed ** values["velocity_exponent"]
    return {"yield_force": rising, "c0": motion.velocity}


def _dashpot_blocks(values: Values, motion: Motion) -> dict[str, FloatArray]:
    z = dashpot_series(motion.velocity, motion.starts, motion.dt, values["spring_rate"], values["velocity_scale"])
    return {"yield_force": z, "c0": motion.velocity}


# --- nonlinear parameters -------------------------------------------------------------------------------------------
def _yield_displacement(scales: Scales) -> NonlinearParameter:
    stroke = scales.stroke
    return NonlinearParameter(
        "yield_displacement", (0.05 * stroke, 0.15 * stroke, 0.015 * stroke), 1e-3 * stroke, 2.0 * stroke
    )


def _gamma_share() -> NonlinearParameter:
    return NonlinearParameter("gamma_share", (0.5,), 0.05, 1.5, logarithmic=False)


def _velocity_scale(scales: Scales) -> NonlinearParameter:
    speed = scales.peak_speed
    return NonlinearParameter("velocity_scale", (0.1 * speed, 0.3 * speed, 0.03 * speed), 2e-3 * speed, 3.0 * speed)


def _bouc_wen(scales: Scales) -> tuple[NonlinearParameter, ...]:
    return _yield_displacement(scales), _gamma_share()


def _free_exponent(scales: Scales) -> tuple[NonlinearParameter, ...]:
    return *_bouc_wen(scales), NonlinearParameter("exponent", (1.9,), 1.0, 8.0)


def _rounded(scales: Scales) -> tuple[NonlinearParameter, ...]:
    return *_bouc_wen(scales), _velocity_scale(scales)


def _power(scales: Scales) -> tuple[NonlinearParameter, ...]:
    return *_bouc_wen(scales), NonlinearParameter("velocity_exponent", (0.15, 0.4), 1e-3, 1.5)


def _dashpot(scales: Scales) -> tuple[NonlinearParameter, ...]:
    rate = 1.0 / scales.stroke
    return NonlinearParameter("spring_rate", (20.0 * rate, 5.0 * rate, 80.0 * rate), 0.3 * rate, 2000.0 * rate), (
        _velocity_scale(scales)
    )


def _rounded_orders(scales: Scales) -> dict[str, int]:
    return {
        "yield_force": scales.yield_order,
        "c0": scales.viscosity_order,
        "rounded_force": scales.yield_order,
    }


# --- modified Bouc-Wen: nothing but k1 is linear --------------------------------------------------------------------
def _modified_parameters(scales: Scales) -> tuple[NonlinearParameter, ...]:
    force, speed = scales.peak_force, scales.peak_speed
    yields = [
        NonlinearParameter(
            f"yield_force_at_{k}", ((0.1 + 0.8 * k / max(scales.yield_order, 1)) * force,), 1e-4 * force, 5 * force
        )
        for k in range(scales.yield_order + 1)
    ]
    viscous = [
        NonlinearParameter(f"c0_at_{k}", (0.1 * force / speed,), 1e-4 * force / speed, 5 * force / speed)
        for k in range(scales.viscosity_order + 1)
    ]
    series = [
        NonlinearParameter(f"c1_at_{k}", (30.0 * force / speed,), 0.3 * force / speed, 3e4 * force / speed)
        for k in range(scales.viscosity_order + 1)
    ]
    spring = NonlinearParameter(
        "k0", (0.02 * force / scales.stroke,), 1e-6 * force / scales.stroke, force / scales.stroke
    )
    return *_bouc_wen(scales), spring, *yields, *viscous, *series


def _modified_known(values: Values, motion: Motion, drive: FloatArray, scales: Scales) -> FloatArray:
    share = drive / scales.drive_limit

    def polynomial(name: str, order: int) -> FloatArray:
        parts = zip(bernstein(share, order), range(order + 1), strict=True)
        return np.ascontiguousarray(sum(basis * values[f"{name}_at_{k}"] for basis, k in parts))

    return _modified.force_series(
        motion,
        polynomial("yield_force", scales.yield_order),
        polynomial("c0", scales.viscosity_order),
        polynomial("c1", scales.viscosity_order),
        values["k0"],
        (values["yield_displacement"], values["gamma_share"], 2.0),
    )


def _square(_scales: Scales) -> dict[str, float]:
    return {"exponent": 2.0}


def _power_fixed(scales: Scales) -> dict[str, float]:
    return {"exponent": 2.0, "reference_velocity": scales.peak_speed}


def _no_parameters(_scales: Scales) -> tuple[NonlinearParameter, ...]:
    return ()


def _dahl(scales: Scales) -> tuple[NonlinearParameter, ...]:
    return (_yield_displacement(scales),)


def _spring_block(_values: Values, motion: Motion) -> dict[str, FloatArray]:
    return {"k1": motion.displacement}


def _spring_order(_scales: Scales) -> dict[str, int]:
    return {"k1": 0}


_ALL = (
    Form("bouc-wen", "simplified Bouc-Wen (2.1) to (2.4), n = 2", "bouc-wen", _bouc_wen, _bouc_wen_blocks, _square),
    Form("bouc-wen-n", "Bouc-Wen with a free exponent n", "bouc-wen", _free_exponent, _bouc_wen_blocks),
    Form("dahl", "Dahl's friction: elastic before it slips", "dahl", _dahl, _dahl_blocks),
    Form("bingham", "Bingham (6.1): a jump at zero velocity", "bingham", _no_parameters, _bingham_blocks),
    Form(
        "rounded-yield",
        "Bouc-Wen and alpha_v(u) tanh(v/v0)",
        "rounded-yield",
        _rounded,
        _rounded_blocks,
        _square,
        _rounded_orders,
    ),
    Form(
        "power-yield",
        "Bouc-Wen, its yield force a power of speed",
        "power-yield",
        _power,
        _power_blocks,
        _power_fixed,
    ),
    Form(
        "saturating-dashpot",
        "spring in series with a saturating dashpot",
        "saturating-dashpot",
        _dashpot,
        _dashpot_blocks,
        motion_limit=60_000,
    ),
    Form(
        "modified-bouc-wen",
        "modified Bouc-Wen (P4, Spencer et al.)",
        "modified-bouc-wen",
        _modified_parameters,
        _spring_block,
        _square,
        _spring_order,
        _modified_known,
        motion_limit=15_000,
    ),
)

FORMS: Mapping[str, Form] = MappingProxyType({form.name: form for form in _ALL})
"""Name -> form."""
