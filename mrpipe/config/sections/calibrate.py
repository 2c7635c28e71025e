"""Settings of `calibrate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pydantic import Field, create_model

from mrpipe.control.calibration_settings import CalibrationSettings, NeuralReferenceSettings, RegulatorSettings
from mrpipe.control.laws import law_names

__all__ = ["CalibrateSettings", "CalibrationSettings", "NeuralReferenceSettings", "RegulatorSettings"]


class _Fixed(CalibrationSettings):
    """Mode and damper for which the laws are calibrated, and the gains that are used."""

    damper: str = Field(
        "identified",
        description="Damper whose forces the gains are checked against: `identified`, a damper artifact (.h5) such as "
        "damper-traced.h5 of another run, or a set of configs/dampers or its YAML file.",
    )
    damper_floor: int = Field(1, ge=1, description="Floor that the damper acts on.")
    damper_across_storey: bool = Field(
        False,
        description="Whether the damper spans the storey below its floor; otherwise it is between floor and ground.",
    )
    expected_amplitude_m: float | None = Field(
        None,
        gt=0.0,
        description="Damper amplitude at which forces are judged and around which nnc is trained; null: half the "
        "largest displacement of the bench tests.",
    )
    friction_rounding_share: float = Field(
        1.0 / 6.0,
        ge=0.0,
        description="Speed over which the friction of fdns and nnc changes its sign, relative to the peak speed of "
        "the damper at the expected amplitude; 0: the jump of (4.18).",
    )
    together: bool = Field(
        True,
        description="With `structure.dampers`: whether the gains of all dampers are searched together for the largest "
        "damping of the target modes; otherwise each damper has the gains that it would have alone.",
    )
    map_points: int = Field(25, ge=5, le=200, description="Number of points along each axis of the damping maps.")
    neural: NeuralReferenceSettings = Field(NeuralReferenceSettings(), description="The neural reference controller.")
    regulator: RegulatorSettings = Field(RegulatorSettings(), description="Clipped LQG.")

    def given(self, law: str) -> dict[str, float]:
        """Return the gains that the user gives for a law, by name."""
        return dict(getattr(self, law.replace("-", "_"), {}))


if TYPE_CHECKING:

    class CalibrateSettings(_Fixed):
        """Mode and damper for which the laws are calibrated, and the gains that are used."""

else:
    CalibrateSettings = create_model(
        "CalibrateSettings",
        __base__=_Fixed,
        __doc__=_Fixed.__doc__,
        **{
            name.replace("-", "_"): (
                dict[str, float],
                Field({}, description=f"Your own gains for {name}, by name; gains that are left out are calibrated."),
            )
            for name in law_names()
            if not name.startswith("passive-")
        },
    )
