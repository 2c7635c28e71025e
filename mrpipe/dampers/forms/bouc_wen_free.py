"""Bouc-Wen model with a free exponent and a yield displacement that grows as a power of the yield force."""

from __future__ import annotations

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import EXPONENT, GAMMA_SHARE, YIELD_DISPLACEMENT, growing_hysteresis
from mrpipe.dampers.parameters import Parameter, Values, constant
from mrpipe.dampers.plant import Step


def _steps(values: Values) -> list[Step]:
    names = ("yield_displacement", "gamma_share", "exponent", "growth", "reference_force")
    return [growing_hysteresis(*(values[name] for name in names))]


FORM = BaseForm(
    name="bouc-wen-free",
    summary="Bouc-Wen hysteresis with a free exponent and x_y = x_ref (F_y(u)/F_ref)^p",
    source="Wen 1976, J. Eng. Mech. Div. ASCE 102, 249-263; p = 0 and p = 1 are the two common choices",
    parameters=(
        YIELD_DISPLACEMENT,
        GAMMA_SHARE,
        EXPONENT,
        Parameter(
            "growth",
            "1",
            "exponent with which the yield displacement grows with the yield force",
            "one",
            -0.5,
            2.0,
            (0.5,),
        ),
        constant("reference_force", "N", "yield force for which the yield displacement is given", "force"),
    ),
    steps=_steps,
    coupled=True,
    family="bouc-wen",
)
