"""Operation of a damper at its expected amplitude: forces, and for one of several dampers weights and warnings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mrpipe.control.calibration import balanced_weights
from mrpipe.control.calibration_settings import RegulatorSettings
from mrpipe.control.limits import LimitingModes, placement_warning
from mrpipe.control.lqg import Weights
from mrpipe.control.placed import PlacedCalibration, placed_validity
from mrpipe.control.placed_storage import damper_as_json
from mrpipe.dampers.model import DamperModel
from mrpipe.structures import Frame


@dataclass(frozen=True)
class PlacedOperation:
    """Operation of a calibrated damper at its expected amplitude.

    Attributes
    ----------
    summary
        The summary that `mrpipe calibrate --json` prints for the damper.
    weights
        Weights of the regulator of clipped LQG.
    warnings
        Reasons why the calibration may not hold, one sentence each.
    """

    summary: Mapping[str, Any]
    weights: Weights
    warnings: tuple[str, ...]


def forces_at(damper: DamperModel, amplitude_m: float, modes: LimitingModes) -> tuple[float, float]:
    """Return the forces at the peak speed of an amplitude [N]: without drive (the residual force) and the largest one.

    Parameters
    ----------
    damper
        Model of the damper.
    amplitude_m
        Amplitude of the damper [m].
    modes
        Modes of the target; the damper moves at the frequency of the free mode.
    """
    speed = amplitude_m * modes.omega_0
    residual, largest = (float(damper.quasi_static_force(speed, drive)) for drive in (0.0, damper.drive_limit))
    return residual, largest


def operation_of(
    frame: Frame,
    item: PlacedCalibration,
    model: DamperModel,
    amplitude_m: float,
    *,
    wanted_mode: int,
    rounding_share: float,
    regulator: RegulatorSettings,
) -> PlacedOperation:
    """Return the operation of a calibrated damper.

    Parameters
    ----------
    frame
        The structure.
    item
        The damper and its gains.
    model
        Model of the damper.
    amplitude_m
        Expected amplitude of the damper [m].
    wanted_mode
        Target mode of the settings; a warning says if the damper is calibrated for another one.
    rounding_share
        Speed over which friction changes its sign, as a share of the largest speed at the expected amplitude.
    regulator
        Settings of clipped LQG.
    """
    name, speed = item.damper.name, amplitude_m * item.modes.omega_0
    residual, largest = forces_at(model, amplitude_m, item.modes)
    warnings = []
    if item.damper.mode != wanted_mode:
        warnings.append(
            f"{name}: mode {wanted_mode} does not move this damper, so that it is calibrated for mode "
            f"{item.damper.mode}"
        )
    if hardly := placement_warning(frame, item.modes):
        warnings.append(f"{name}: {hardly}")
    demand, doubts = placed_validity(item, amplitude_m=amplitude_m, residual_force_n=residual, largest_force_n=largest)
    summary = damper_as_json(item, amplitude_m, residual, rounding_share * speed)
    return PlacedOperation(
        {**summary, "force_demand": demand and demand.as_json()},
        balanced_weights(frame, item.damper.position, item.modes, residual, **regulator.known()),
        (*warnings, *doubts),
    )
