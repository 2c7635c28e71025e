"""Inputs of a structure: ground motion in two directions, shaker forces, wind forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.simulation.excitation import Excitation, Place
from mrpipe.structures import Frame
from mrpipe.structures.places import degree_of_freedom


@dataclass(frozen=True)
class Inputs:
    """Inputs of a structure, each with a column.

    Attributes
    ----------
    influence
        Displacement of each degree of freedom per metre of the ground, shape (n, m); zeros for a force.
    loads
        Force on each degree of freedom by one unit of the input, shape (n, m).
    """

    influence: FloatArray
    loads: FloatArray

    @property
    def count(self) -> int:
        """Number of inputs m."""
        return int(self.loads.shape[1])

    def direct(self, frame: Frame) -> FloatArray:
        """Return the absolute acceleration of a structure at rest by one unit of each input, shape (n, m).

        It is zero for motion of the ground, which a structure at rest does not follow.
        """
        return np.asarray(np.linalg.solve(frame.mass, self.loads + frame.mass @ self.influence))

    def pushed(self, frame: Frame) -> FloatArray:
        """Return the part of each input that is a force in the direction of the ground motion, shape (m,)."""
        return np.asarray((self.loads + frame.mass @ self.influence).T @ frame.ground_influence)


def inputs_of(frame: Frame, excitation: Excitation) -> Inputs:
    """Return the inputs of an excitation; the first is the base acceleration, also where it is zero."""
    influence = [frame.ground_influence]
    loads = [-frame.ground_masses_of(frame.ground_influence)]
    for place in excitation.places:
        influence.append(np.zeros(frame.floors) if place.force else place.shape)
        loads.append(place.shape if place.force else -frame.ground_masses_of(place.shape))
    return Inputs(np.column_stack(influence), np.column_stack(loads))


def force_shape(frame: Frame, shares: Mapping[str | int, float], where: str) -> list[Place]:
    """Return a place for each degree of freedom with a force, in the order given.

    Raises
    ------
    UserError
        If a degree of freedom does not exist.
    """
    return [
        Place(f"force at {name}", share * np.eye(frame.floors)[degree_of_freedom(frame, name, where)], True)
        for name, share in shares.items()
    ]


def acting_as_forces(excitation: Excitation, frame: Frame, shares: Mapping[str | int, float], where: str) -> Excitation:
    """Return the same histories as forces [N] on degrees of freedom instead of a base acceleration.

    Parameters
    ----------
    excitation
        Excitation with one history, which acts everywhere with its share, or with one for each degree of freedom.
    frame, shares
        Structure, and degree of freedom -> factor on its history.
    where
        Setting that gives the shares, for messages.

    Raises
    ------
    UserError
        If a degree of freedom does not exist, or the numbers of histories and of degrees of freedom differ.
    """
    places = force_shape(frame, shares, where)
    columns = int(excitation.at(np.zeros(1))[0].size)
    if columns == 1:
        shape = np.sum([place.shape for place in places], axis=0)
        places = [Place(", ".join(place.name for place in places), np.asarray(shape), True)]
    elif columns != len(places):
        raise UserError(
            where,
            "",
            f"names {len(places)} degrees of freedom, but the file holds {columns} histories",
            "give one history for all, or one for each degree of freedom in the same order",
        )
    details = {
        key.replace("base_", "force_").replace("_m_s2", "_n"): value for key, value in excitation.details.items()
    }
    return replace(excitation, places=tuple(places), shakes_ground=False, details=details)


def in_two_directions(excitation: Excitation, frame: Frame, where: str) -> Excitation:
    """Return an excitation of two histories with the second one along `influence_y`.

    Raises
    ------
    UserError
        If the structure has no second direction.
    """
    if frame.influence_y is None:
        raise UserError(
            where,
            "",
            "holds two components, but the structure has one direction",
            "give structure.influence_y, or name one channel in simulate.excitation.file_channels",
        )
    return replace(excitation, places=(Place("ground y", frame.influence_y, False),))


def ground_amplitude(details: Mapping[str, Any], purpose: str) -> float:
    """Return the amplitude of the base acceleration [m/s^2] for a response over frequency.

    Parameters
    ----------
    details
        Details of the excitation.
    purpose
        Purpose of the amplitude, for the message.

    Raises
    ------
    UserError
        If the excitation is a force, or its kind has no amplitude.
    """
    if "also" in details:
        raise UserError(
            "simulate.excitation",
            "also",
            f"{purpose} is measured under motion of the ground alone",
            "leave also out, or study everything together with simulate",
        )
    if "base_amplitude_m_s2" in details:
        return float(details["base_amplitude_m_s2"])
    if any(key.startswith("force_") or key == "peak_n" for key in details):
        raise UserError(
            "simulate.excitation",
            "force_at",
            f"{purpose} is measured under motion of the ground, but the settings give a force",
            "leave force_at out; mrpipe simulate runs under the force, and design.motions takes its history",
        )
    raise UserError(
        "simulate.excitation", "kind", f"{details.get('kind')} has no amplitude", f"set kind: harmonic for {purpose}"
    )
