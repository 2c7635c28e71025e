"""Bouc-Wen model whose yield force is a power of the speed."""

from __future__ import annotations

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.form import BaseForm, Strength, rounded_sum
from mrpipe.dampers.hysteresis import GAMMA_SHARE, YIELD_DISPLACEMENT, bouc_wen_numbers, hysteresis
from mrpipe.dampers.parameters import Parameter, Values, constant
from mrpipe.dampers.plant import Step
from mrpipe.dampers.viscoplastic import power_of_velocity


def _steps(values: Values) -> list[Step]:
    rising = power_of_velocity(values["reference_velocity"], values["velocity_exponent"])
    return [hysteresis(*bouc_wen_numbers(values)), rising]


def _post_yield(values: Values, at: Strength) -> FloatArray:
    return rounded_sum((at.speed / values["reference_velocity"]) ** values["velocity_exponent"], at)


FORM = BaseForm(
    name="power-yield",
    summary="Bouc-Wen hysteresis, its yield force F_y (|v|/v_ref)^p",
    source="Herschel and Bulkley 1926, Kolloid-Z. 39, 291-300; Wang and Gordaninejad 1999 (MR dampers)",
    parameters=(
        YIELD_DISPLACEMENT,
        GAMMA_SHARE,
        Parameter("velocity_exponent", "1", "power of the speed", "one", 1e-3, 1.2, (0.15, 0.4)),
        constant("reference_velocity", "m/s", "speed for which the yield force is given", "speed"),
    ),
    steps=_steps,
    post_yield=_post_yield,
    family="rate-dependent-yield",
    hysteresis=bouc_wen_numbers,
)
