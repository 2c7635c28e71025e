"""The design problem of a run: its loop, the laws that are compared, and the uncertain quantities."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.control.gains import Gains
from mrpipe.control.law import GainRange, Plant
from mrpipe.control.laws import all_laws
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import UserError
from mrpipe.law_design.kept import LawUnderDesign
from mrpipe.law_design.options import DesignSettings
from mrpipe.law_design.search import FreeGain
from mrpipe.law_design.uncertainty import Draw
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.loop import Response
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.steady_state import Run
from mrpipe.simulation.windows import QUANTITIES

SMALLEST_SHARE = 0.02
"""If a gain may be zero, the search over logarithms ends at this share of its largest value."""


@dataclass(frozen=True)
class LoopOf:
    """Function that returns the loop of a law.

    Attributes
    ----------
    rig
        Structure, damper, controllers and options. The controllers are those for the nominal damper.
    seed
        Seed of the sensor noise, which is the same in all runs, so that gains are compared under the same conditions.
    """

    rig: Rig
    seed: int

    def __call__(self, law: str, gains: Gains) -> Run:
        """Return the function that runs the loop of a law under an excitation."""
        controller = self.rig.controller(law, gains)
        chain = self.rig.damper.chain()

        def run(excitation: Excitation) -> Response:
            return self.rig.run(controller, excitation, chain=chain, rng=np.random.default_rng(self.seed))

        return run

    def at_rate(self, factor: float) -> LoopOf:
        """Return the loop with the plant rate times a factor."""
        options = self.rig.options
        rate = factor * options.plant_rate_hz
        options = replace(options, plant_rate_hz=rate, record_rate_hz=min(options.record_rate_hz, rate))
        return replace(self, rig=replace(self.rig, options=options))

    def drawn(self, item: Draw) -> LoopOf:
        """Return the loop with a drawn structure and damper; the controllers stay those of the nominal ones."""
        damper = scaled_force(item.damper, item.force_factor)
        return replace(self, rig=replace(self.rig, frame=item.frame, damper=damper))


def scaled_force(damper: DamperModel, factor: float) -> DamperModel:
    """Return the damper with all force coefficients of base form and effects times a factor."""
    parameters = {
        name: value * factor if damper.unit(name).startswith("N") else value
        for name, value in damper.parameters.items()
    }
    effects = [
        replace(
            item,
            values={
                name: value * factor if item.units.get(name, "").startswith("N") else value
                for name, value in item.values.items()
            },
        )
        for item in damper.effects
    ]
    return replace(damper, parameters=parameters, effects=tuple(effects))


def require_known(settings: DesignSettings) -> None:
    """Refuse fixed gains that do not exist, a quantity that is not computed, and an empty band.

    Raises
    ------
    UserError
        If there is one; the message names its setting.
    """
    known = all_laws()
    for name, gains in settings.fixed_gains.items():
        if name not in known:
            raise UserError("design.fixed_gains", name, "is not a control law", f"one of {', '.join(known)}")
        known[name].require_gains(gains, f"design.fixed_gains.{name}")
    require_quantities(settings.weights)
    if settings.band_rad_s is not None:
        require_band(settings.band_rad_s)


def require_quantities(names: Iterable[str]) -> None:
    """Refuse a quantity that is not computed; the UserError names the setting `design.weights`."""
    for name in names:
        if name not in QUANTITIES:
            raise UserError("design.weights", name, "is not a quantity", f"one of {', '.join(QUANTITIES)}")


def require_band(band_rad_s: tuple[float, float]) -> None:
    """Refuse a band that is not positive and rising; the UserError names the setting of the design."""
    if not 0.0 < band_rad_s[0] < band_rad_s[1]:
        problem = f"is {band_rad_s[0]:g} to {band_rad_s[1]:g}"
        raise UserError("design.band_rad_s", "", problem, "give a positive rising band, the lowest frequency first")


def laws_in_the_race(
    settings: DesignSettings, plant: Plant, calibrated: Mapping[str, Gains]
) -> tuple[list[LawUnderDesign], list[LawUnderDesign], dict[str, str]]:
    """Return the laws under design, laws with fixed gains again with all gains free, and why laws are left out.

    Parameters
    ----------
    settings
        Settings of the design.
    plant
        Gives the bounds of the gains.
    calibrated
        Law -> calibrated gains.

    Raises
    ------
    UserError
        If a law or a gain does not exist.
    """
    require_known(settings)
    known = all_laws()
    entries, free_entries, left_out = [], [], {}
    for name in settings.laws or known:
        law = known[name]
        if law.calibrated and name not in calibrated:
            left_out[name] = "it is not calibrated"
            continue
        start = calibrated.get(name, Gains())
        fixed = settings.fixed_gains.get(name, {})
        free = tuple(_free(gain, plant) for gain in law.gains if gain.name not in fixed)
        entries.append(LawUnderDesign(name, start.changed(**fixed), free, name))
        if fixed and settings.also_free:
            every = tuple(_free(gain, plant) for gain in law.gains)
            free_entries.append(LawUnderDesign(name, start.changed(**fixed), every, f"{name}, unrestricted"))
    return entries, free_entries, left_out


def _free(gain: GainRange, plant: Plant) -> FreeGain:
    """Return the range of a gain without zero, because zero has no logarithm."""
    low, high = gain.bounds(plant)
    largest = max(abs(low), abs(high))
    sign = math.copysign(1.0, high if abs(high) >= abs(low) else low)
    smallest = max(min(abs(low), abs(high)), SMALLEST_SHARE * largest)
    return FreeGain(gain.name, *sorted((sign * smallest, sign * largest)))
