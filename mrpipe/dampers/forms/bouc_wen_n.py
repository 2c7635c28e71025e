"""Simplified Bouc-Wen model with a free exponent."""

from __future__ import annotations

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import EXPONENT, GAMMA_SHARE, YIELD_DISPLACEMENT, bouc_wen_numbers, hysteresis
from mrpipe.dampers.parameters import Values
from mrpipe.dampers.plant import Step


def _steps(values: Values) -> list[Step]:
    return [hysteresis(*bouc_wen_numbers(values))]


FORM = BaseForm(
    name="bouc-wen-n",
    summary="Bouc-Wen hysteresis with a free exponent n, parallel to a dashpot",
    source="Wen 1976, J. Eng. Mech. Div. ASCE 102, 249-263",
    parameters=(YIELD_DISPLACEMENT, GAMMA_SHARE, EXPONENT),
    steps=_steps,
    family="bouc-wen",
    hysteresis=bouc_wen_numbers,
)
