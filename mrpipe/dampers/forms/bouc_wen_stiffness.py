"""Bouc-Wen model with constant initial stiffness: the yield displacement is proportional to the yield force."""

from __future__ import annotations

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import GAMMA_SHARE, INITIAL_STIFFNESS, growing_hysteresis
from mrpipe.dampers.parameters import Values
from mrpipe.dampers.plant import Step


def _steps(values: Values) -> list[Step]:
    share, exponent = values.get("gamma_share", 0.5), values.get("exponent", 2.0)
    # x_y = F_y/k: the yield displacement at 1 N, growing in proportion to the yield force
    return [growing_hysteresis(1.0 / values["initial_stiffness"], share, exponent, 1.0, 1.0)]


FORM = BaseForm(
    name="bouc-wen-stiffness",
    summary="Bouc-Wen hysteresis with exponent 2 and a constant initial stiffness k: x_y = F_y(u)/k",
    source="Spencer, Dyke, Sain, Carlson 1997, J. Eng. Mech. 123, 230-238 (A and z the same for all voltages)",
    parameters=(
        INITIAL_STIFFNESS,
        GAMMA_SHARE,
    ),
    steps=_steps,
    coupled=True,
    family="bouc-wen",
)
