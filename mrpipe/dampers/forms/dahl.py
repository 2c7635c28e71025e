"""Dahl's friction model."""

from __future__ import annotations

from mrpipe.dampers.form import BaseForm
from mrpipe.dampers.hysteresis import YIELD_DISPLACEMENT, hysteresis
from mrpipe.dampers.parameters import Values
from mrpipe.dampers.plant import Step


def _numbers(values: Values) -> tuple[float, float, float]:
    return values["yield_displacement"], 1.0, 1.0


def _steps(values: Values) -> list[Step]:
    return [hysteresis(*_numbers(values))]


FORM = BaseForm(
    name="dahl",
    summary="Dahl friction: the force approaches its limit exponentially in displacement",
    source="Dahl 1968, TOR-158(3107-18); Ikhouane and Dyke 2007, Smart Mater. Struct. 16 (viscous Dahl model)",
    parameters=(YIELD_DISPLACEMENT,),
    steps=_steps,
    hysteresis=_numbers,
)
