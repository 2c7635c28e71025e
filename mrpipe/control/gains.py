"""Gains of a control law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Literal

NAMES = ("c_n_s_m", "k_n_m", "alpha_n_m")
"""Gains with a fixed place in the compiled controller: viscosity, stiffness, friction with negative stiffness."""

GainsSource = Literal["calibrated", "design"]
"""Source of the gains of the laws: the stage `calibrate`, or the search of the stage `design`."""


class Gains(Mapping[str, float]):
    """Gains of a law by name. A name ends in its unit. A gain that is not given is 0.

    The three common gains are attributes: f = c v + k x (4.14), and f = sign(v) alpha X - alpha x (4.18) with (4.20). A
    law may declare further gains, such as a weight.
    """

    __slots__ = ("_values",)

    def __init__(self, c_n_s_m: float = 0.0, k_n_m: float = 0.0, alpha_n_m: float = 0.0, **others: float) -> None:
        values = {"c_n_s_m": c_n_s_m, "k_n_m": k_n_m, "alpha_n_m": alpha_n_m, **others}
        self._values = {name: float(value) for name, value in values.items() if name in NAMES or value != 0.0}

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return f"Gains({', '.join(f'{name}={value:g}' for name, value in self._values.items() if value)})"

    def __hash__(self) -> int:
        return hash(tuple(sorted(self._values.items())))

    @property
    def c_n_s_m(self) -> float:
        """Viscosity c [N s/m]."""
        return self._values["c_n_s_m"]

    @property
    def k_n_m(self) -> float:
        """Stiffness k [N/m]."""
        return self._values["k_n_m"]

    @property
    def alpha_n_m(self) -> float:
        """Friction with negative stiffness alpha [N/m]."""
        return self._values["alpha_n_m"]

    def changed(self, **values: float) -> Gains:
        """Return the gains with the given ones replaced."""
        return Gains(**{**self._values, **values})
