"""Calibration of several dampers: each alone, then all together by exact complex eigenvalues."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control import exact
from mrpipe.control.calibration import (
    Calibration,
    CalibrationOptions,
    LawCalibration,
    calibrate_law,
    plant_of,
)
from mrpipe.control.factors import LARGEST_FACTOR, best_factors
from mrpipe.control.gains import Gains
from mrpipe.control.law import Law
from mrpipe.control.laws import law_named
from mrpipe.control.limits import LimitingModes, critical_friction
from mrpipe.control.lqg import Weights
from mrpipe.control.together import LinearDevice, TogetherDamping, damping_together, linear_device
from mrpipe.control.validity import ForceDemand, force_demands, validity_warnings
from mrpipe.errors import UserError
from mrpipe.structures import Frame

CENTRAL_LAW = "lqg"
"""Law whose dampers share one regulator, so that no gains are calibrated here."""


@dataclass(frozen=True)
class PlacedDamper:
    """A damper in a structure, with its control law.

    Attributes
    ----------
    name
        Name of the damper in tables.
    position
        Connectivity vector w, shape (n,).
    law
        Name of its law.
    mode
        Target mode, from 1.
    gains
        Gains that the user gives; the other gains are calibrated.
    brace_n_m
        Stiffness of the brace in series with it [N/m]; infinite: rigid.
    """

    name: str
    position: FloatArray
    law: str
    mode: int = 1
    gains: Mapping[str, float] | None = None
    brace_n_m: float = math.inf


@dataclass(frozen=True)
class PlacedCalibration:
    """Calibrated gains of one damper.

    Attributes
    ----------
    damper
        The damper that was calibrated.
    modes
        Limiting modes of its target mode with a rigid brace, without the other dampers.
    static_stiffness_n_m
        Static stiffness of the structure at the damper [N/m].
    alone, together
        Gains with the largest damping of the target mode: with this damper alone, and with all dampers.
    law
        Calibration of the law without a brace; None for a law without gains.
    weights
        Weights of the laws that are optimal regulators.
    """

    damper: PlacedDamper
    modes: LimitingModes
    static_stiffness_n_m: float
    alone: Gains
    together: Gains
    law: LawCalibration | None
    weights: Weights

    def device(self, gains: Gains) -> LinearDevice | None:
        """Return the linear equivalent at these gains; None if the law has none."""
        damper = self.damper
        return linear_device(law_named(damper.law), gains, damper.position, self.modes.omega_0, 1.0, damper.brace_n_m)


def calibrate_placed(
    frame: Frame, dampers: Sequence[PlacedDamper], options: CalibrationOptions, *, together: bool = True
) -> list[PlacedCalibration]:
    """Calibrate every damper alone, and then all of them together.

    For all dampers together, the gains are multiplied by factors that maximise the damping ratio of the target mode.
    With several target modes, the factors maximise the smallest improvement over the gains of the single dampers, among
    the modes that are not critically damped.
    Nonlinear laws are replaced by their equivalents, and the inherent damping of the structure is neglected, as in the
    calibration of one damper.

    Parameters
    ----------
    frame
        The structure.
    dampers
        The dampers that are calibrated.
    options
        Source of the gains and further options; the target mode is that of each damper.
    together
        Whether the gains are searched for all dampers together.

    Raises
    ------
    UserError
        If a damper cannot be calibrated.
    """
    alone = [_alone(frame, damper, options) for damper in dampers]
    if not together or options.source != "exact":
        return alone
    places = [place for place, item in enumerate(alone) if _is_tunable(item)]
    if len(alone) < 2 or not places:
        return alone
    bare = exact.undamped(frame)
    modes = sorted({item.damper.mode for item in alone})

    def devices(factors: FloatArray) -> list[LinearDevice]:
        gains = [item.alone for item in alone]
        for place, factor in zip(places, factors, strict=True):
            gains[place] = law_named(alone[place].damper.law).scaled(gains[place], float(factor))
        found = (item.device(values) for item, values in zip(alone, gains, strict=True))
        return [item for item in found if item is not None]

    def ratios(factors: FloatArray) -> FloatArray:
        return damping_together(bare, devices(factors), modes).effective_ratios

    reference = np.maximum(ratios(np.ones(len(places))), 1e-6)
    largest = np.array([_largest_factor(alone[place], alone[place].alone) for place in places])
    factors = best_factors(ratios, reference, largest)
    result = list(alone)
    for place, factor in zip(places, factors, strict=True):
        item = alone[place]
        result[place] = replace(item, together=law_named(item.damper.law).scaled(item.alone, float(factor)))
    return result


def modes_together(
    frame: Frame, calibrated: Sequence[PlacedCalibration], modes: Sequence[int], *, alone: bool = False
) -> TogetherDamping:
    """Return the target modes with all dampers that have a linear equivalent, at their gains `together` or `alone`."""
    found = [item.device(item.alone if alone else item.together) for item in calibrated]
    return damping_together(frame, [item for item in found if item is not None], modes)


def refuse_network(law: Law, where: str) -> None:
    """Refuse a law that needs a network.

    Raises
    ------
    UserError
        If it needs one; `where` names the damper.
    """
    if "network" in law.needs:
        problem = f"law {law.name} needs a network, which is trained for one damper"
        raise UserError(where, "law", problem, "choose another law")


def _alone(frame: Frame, damper: PlacedDamper, options: CalibrationOptions) -> PlacedCalibration:
    law = law_named(damper.law)
    where = f"structure.dampers: {damper.name}"
    refuse_network(law, where)
    own = replace(options, mode=damper.mode, overrides={law.name: dict(damper.gains or {})})
    if law.observer is None:
        own = replace(own, weights=own.weights or Weights())  # they have no effect
    calibrated = None
    gains = Gains()
    try:
        law.check_given(damper.gains or {})
        plant = plant_of(frame, damper.position, own)
        if law.calibrated and law.name != CENTRAL_LAW:
            calibrated = calibrate_law(plant, law, own)
            gains = calibrated.gains
    except UserError as error:
        # the settings of this damper are at fault, not those of the section calibrate
        key = f"gains.{error.where}" if error.source == f"calibrate.{law.name}" else error.where
        raise UserError(where, key, error.problem, error.remedy) from error
    found = PlacedCalibration(damper, plant.modes, plant.static_stiffness_n_m, gains, gains, calibrated, plant.weights)
    own_route = math.isinf(damper.brace_n_m) and not damper.gains
    if own_route or not _is_tunable(found) or options.source != "exact":
        return found

    # the calibration of a single law does not account for a brace or for gains that the user gives
    def ratio(factors: FloatArray) -> FloatArray:
        device = found.device(law.scaled(gains, float(factors[0])))
        return damping_together(plant.bare, [device] if device else [], [damper.mode]).effective_ratios

    factors = best_factors(ratio, np.ones(1), np.array([_largest_factor(found, gains)]))
    best = law.scaled(gains, float(factors[0]))
    return replace(found, alone=best, together=best)


def _is_tunable(item: PlacedCalibration) -> bool:
    """Return whether the law has an equivalent and a tuned gain that the user has not given."""
    law: Law = law_named(item.damper.law)
    given = item.damper.gains or {}
    return bool(law.tuned_gain) and law.tuned_gain not in given and item.device(item.alone) is not None


def _largest_factor(item: PlacedCalibration, gains: Gains) -> float:
    """Return the largest factor on the tuned gain of a damper.

    Friction with negative stiffness must not hold the structure at its extremum, which its equivalent does not show.
    """
    if law_named(item.damper.law).tuned_gain != "alpha_n_m":
        return LARGEST_FACTOR
    return min(LARGEST_FACTOR, max(1.0, critical_friction(item.modes) / gains.alpha_n_m))


def placed_validity(
    item: PlacedCalibration, *, amplitude_m: float, residual_force_n: float, largest_force_n: float
) -> tuple[ForceDemand | None, list[str]]:
    """Return the force that the law of a damper needs, and warnings, one sentence each.

    Arguments as in :func:`mrpipe.control.validity.force_demands`. The force is None where the law defines none.
    """
    if item.law is None:
        return None, []
    law = item.damper.law
    calibration = Calibration(
        item.modes,
        item.static_stiffness_n_m,
        {law: replace(item.law, gains=item.together)},
        np.zeros(0),
        item.damper.position,
    )
    demands = force_demands(
        calibration, amplitude_m=amplitude_m, residual_force_n=residual_force_n, largest_force_n=largest_force_n
    )
    return demands.get(law), [f"{item.damper.name}: {line}" for line in validity_warnings(calibration, demands)]
