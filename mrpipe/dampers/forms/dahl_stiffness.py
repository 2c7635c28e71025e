"""Dahl's friction model with a constant initial stiffness."""

from __future__ import annotations

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import INITIAL_STIFFNESS, growing_hysteresis
from mrpipe.dampers.parameters import Values
from mrpipe.dampers.plant import Step


def _steps(values: Values) -> list[Step]:
    return [growing_hysteresis(1.0 / values["initial_stiffness"], 1.0, 1.0, 1.0, 1.0)]


FORM = BaseForm(
    name="dahl-stiffness",
    summary="Dahl friction with a constant initial stiffness k: x_y = F_y(u)/k",
    source="Dahl 1968, TOR-158(3107-18): sigma is a property of the contact, the limit depends on the load",
    parameters=(INITIAL_STIFFNESS,),
    steps=_steps,
    coupled=True,
    family="dahl",
)
