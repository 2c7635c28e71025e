"""Simplified Bouc-Wen model with the exponent 2."""

from __future__ import annotations

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import GAMMA_SHARE, YIELD_DISPLACEMENT, bouc_wen_numbers, hysteresis
from mrpipe.dampers.parameters import Values
from mrpipe.dampers.plant import Step


def _steps(values: Values) -> list[Step]:
    return [hysteresis(*bouc_wen_numbers(values))]


FORM = BaseForm(
    name="bouc-wen",
    summary="Bouc-Wen hysteresis with exponent 2, parallel to a dashpot: (2.1) to (2.4)",
    source="Bouc 1967; Wen 1976, J. Eng. Mech. Div. ASCE 102, 249-263; Bhowmik 2011, section 2.2",
    parameters=(YIELD_DISPLACEMENT, GAMMA_SHARE),
    steps=_steps,
    hysteresis=bouc_wen_numbers,
)
