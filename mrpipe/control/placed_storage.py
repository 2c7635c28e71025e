"""Several dampers: from the settings to the dampers to calibrate, and the calibration in control.h5 and as JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mrpipe.artifacts import Artifact, ArtifactWriter, FloatArray
from mrpipe.artifacts.yaml_source import nearest
from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named, law_names
from mrpipe.control.limits import moving_modes, separated
from mrpipe.control.lqg import Weights
from mrpipe.control.placed import PlacedCalibration, PlacedDamper, refuse_network
from mrpipe.control.storage import Calibrated, finite
from mrpipe.control.together import TogetherDamping
from mrpipe.errors import UserError
from mrpipe.structures import Frame, natural_modes
from mrpipe.structures.options import DamperSettings
from mrpipe.structures.places import degree_of_freedom, device_position

GROUP = "dampers"
"""Entry of control.h5 that holds the calibration of several dampers."""


def damper_name(settings: DamperSettings, place: int) -> str:
    """Return the name of the damper at this place (from 0) of the list."""
    return settings.name or f"damper {place + 1}"


def require_law(entry: DamperSettings, where: str) -> None:
    """Refuse a damper whose law is unknown or needs a network.

    Raises
    ------
    UserError
        If it does; the message names the setting.
    """
    if entry.law not in law_names():
        raise UserError(where, "law", f"{entry.law!r} is not a control law", nearest(entry.law, law_names()))
    refuse_network(law_named(entry.law), where)


def placed_dampers(frame: Frame, entries: Sequence[DamperSettings], target_mode: int) -> list[PlacedDamper]:
    """Return the dampers that the settings describe.

    Parameters
    ----------
    frame
        The structure.
    entries
        Section `structure.dampers`.
    target_mode
        Target mode of a damper without one in the settings. If it does not move the damper, the next mode that does is
        used.

    Raises
    ------
    UserError
        If a law, a degree of freedom or a sensor is unknown, or two dampers have the same name.
    """
    result: list[PlacedDamper] = []
    for place, entry in enumerate(entries):
        where = f"structure.dampers[{place}]"
        require_law(entry, where)
        if "displacement" not in entry.sensors:
            raise UserError(where, "sensors", "lack the displacement of the damper", "add displacement")
        name = damper_name(entry, place)
        if any(item.name == name for item in result):
            raise UserError(where, f"name: {name}", "occurs more than once", "give different names")
        position = device_position(frame, *entry.between, where=f"{where}.between")
        result.append(
            PlacedDamper(
                name=name,
                position=position,
                law=entry.law,
                mode=entry.target_mode or _first_moving(frame, position, target_mode),
                gains=entry.gains,
                brace_n_m=entry.brace_stiffness_n_m or math.inf,
            )
        )
    return result


def _first_moving(frame: Frame, position: FloatArray, target_mode: int) -> int:
    """Return the target mode or, if this mode is in the other direction, the next mode that moves the damper."""
    found = natural_modes(frame)
    moving = moving_modes(position, separated(position, found.angular_frequencies, found.mode_shapes))
    return next((mode for mode in moving if mode >= target_mode), target_mode)


def accelerometers_of(frame: Frame, names: Sequence[str | int]) -> tuple[int, ...]:
    """Return the indices (from 0) of the degrees of freedom with an accelerometer; all of them if `names` is empty.

    Amplitudes of modes, as after a Craig-Bampton reduction, have no place for one.

    Raises
    ------
    UserError
        If a name is not that of a degree of freedom, occurs twice, or is that of an amplitude.
    """
    placed = frame.floors - frame.modal_coordinates
    if not names:
        return tuple(range(placed))
    where = "structure.accelerometers"
    places = tuple(degree_of_freedom(frame, name, where) for name in names)
    amplitude = next((place for place in places if place >= placed), None)
    if amplitude is not None:
        remedy = f"name one of {', '.join(frame.names[:placed][:12])}, or keep more (structure.reduction.keep)"
        raise UserError(where, frame.names[amplitude], "is the amplitude of a mode, which has no place", remedy)
    twice = next((place for place in places if places.count(place) > 1), None)
    if twice is not None:
        raise UserError(where, frame.names[twice], "is named more than once", "name each degree of freedom once")
    return places


@dataclass(frozen=True)
class KnownDamper:
    """Calibration of one damper in control.h5.

    Attributes
    ----------
    name, law
        Name and law of the damper.
    brace_n_m
        Stiffness of its brace [N/m]; infinite: rigid.
    omega_inf
        Frequency of its target mode with this damper locked and the others off [rad/s].
    calibrated
        Calibration in the form from which its controller is built.
    """

    name: str
    law: str
    brace_n_m: float
    omega_inf: float
    calibrated: Calibrated


def damper_as_json(
    item: PlacedCalibration, amplitude_m: float, residual_force_n: float, rounding_m_s: float
) -> dict[str, Any]:
    """Return what `mrpipe calibrate --json` prints for one of several dampers.

    Parameters
    ----------
    item
        The calibration of the damper.
    amplitude_m, residual_force_n, rounding_m_s
        Expected amplitude [m], force without drive at this amplitude [N], and speed over which friction changes its
        sign [m/s].
    """
    law = law_named(item.damper.law)
    return {
        "name": item.damper.name,
        "law": law.name,
        "position": item.damper.position.tolist(),
        "brace_stiffness_n_m": finite(item.damper.brace_n_m),
        "target_mode": item.damper.mode,
        "omega_0": item.modes.omega_0,
        "omega_inf": finite(item.modes.omega_inf),
        "static_stiffness_n_m": item.static_stiffness_n_m,
        "gains_alone": law.gains_as_json(item.alone),
        "gains": law.gains_as_json(item.together),
        "expected_amplitude_m": amplitude_m,
        "residual_force_n": residual_force_n,
        "friction_rounding_m_s": rounding_m_s,
    }


def together_as_json(frame: Frame, found: TogetherDamping, modes: Sequence[int]) -> dict[str, Any]:
    """Return frequencies and damping ratios of modes with all dampers, by exact complex eigenvalues."""
    omega = natural_modes(frame).angular_frequencies
    return {
        "modes": list(modes),
        "omega_free": [float(omega[mode - 1]) for mode in modes],
        "omega": np.abs(found.poles).tolist(),
        "damping_ratios": found.damping_ratios.tolist(),
        "stable": found.stable,
    }


def write_placed(
    artifact: ArtifactWriter,
    calibrated: Sequence[PlacedCalibration],
    weights: Sequence[Weights],
    summary: Mapping[str, Any],
) -> None:
    """Write all data from which the controllers are built; `summary` is that of the stage."""
    rows = [
        {
            **row,
            "u_0": item.modes.u_0,
            "top_0": item.modes.top_0,
            "all_gains": dict(item.together),
            "weights": asdict(weight),
        }
        for item, weight, row in zip(calibrated, weights, summary["dampers"], strict=True)
    ]
    artifact.put_json(GROUP, rows)
    artifact.put_json("together", summary["together"])


def read_placed(artifact: Artifact) -> list[KnownDamper]:
    """Read the data of :func:`write_placed`."""
    return [
        KnownDamper(
            name=row["name"],
            law=row["law"],
            brace_n_m=row["brace_stiffness_n_m"] or math.inf,
            omega_inf=row["omega_inf"] or math.inf,
            calibrated=Calibrated(
                position=np.array(row["position"]),
                omega_0=row["omega_0"],
                u_0=row["u_0"],
                top_0=row["top_0"],
                amplitude_m=row["expected_amplitude_m"],
                residual_force_n=row["residual_force_n"],
                friction_rounding_m_s=row["friction_rounding_m_s"],
                weights=Weights(**row["weights"]),
                gains={row["law"]: Gains(**row["all_gains"])},
                reference=None,
                path=str(artifact.path),
            ),
        )
        for row in artifact.json(GROUP)
    ]
