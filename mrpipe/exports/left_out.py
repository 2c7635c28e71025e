"""Effects that an exported model does not contain, one sentence each, for warnings, README and JSON file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mrpipe.artifacts import Artifact
from mrpipe.artifacts.plain import plain
from mrpipe.structures.options import DamperSettings
from mrpipe.structures.over_amplitude import depends_on_amplitude
from mrpipe.words import listed

KEPT = ("name", "form", "place", "parameters", "confidence", "physics", "source")
"""Keys of an effect of close-loop that the JSON file of an export repeats."""


def effects_as_data(summary: Mapping[str, Any], where: str) -> list[dict[str, Any]]:
    """Return the effects of :func:`effects_left_out` with their parameters, for the JSON file of the export."""
    found = (item for item in summary.get("effects", ()) if item.get("corrected_in") == where)
    return [plain({key: item[key] for key in KEPT if key in item}) for item in found]


def effects_left_out(summary: Mapping[str, Any], where: str, remedy: str) -> list[str]:
    """Return a sentence that names the effects which close-loop found and the export does not contain.

    Parameters
    ----------
    summary
        Summary of close-loop.
    where
        `structure` or `plant`: where the effects are corrected.
    remedy
        Sentence on what the user can do.
    """
    names = [
        f"{item['name']} ({item['place']})" if item.get("place") else str(item["name"])
        for item in effects_as_data(summary, where)
    ]
    if not names:
        return []
    return [f"close-loop found {listed(names)}, which this export does not contain: {remedy}"]


def frame_left_out(frame: Artifact, amplitude_m: float, tracing: Mapping[str, Any]) -> list[str]:
    """Return what a linear frame lacks of the identified structure.

    Parameters
    ----------
    frame
        frame.h5 of `identify-frame`.
    amplitude_m
        Amplitude at which the frame is taken [m]; 0: constant modes.
    tracing
        Summary of close-loop; empty if there is none.
    """
    found = effects_left_out(
        tracing, "structure", "the frame is linear; the JSON file of `export frame` has their parameters"
    )
    if amplitude_m == 0.0 and depends_on_amplitude(frame):
        found.append(
            "the modes depend on the amplitude of the motion, and this frame has constant modes: set "
            "simulate.frame_amplitude_m to the amplitude that you expect"
        )
    return found


def dampers_left_out(dampers: Sequence[DamperSettings]) -> list[str]:
    """Return a sentence that names the dampers of `structure.dampers`, which a linear frame does not contain.

    Parameters
    ----------
    dampers
        Settings of the section `structure.dampers`.
    """
    if not dampers:
        return []
    places = ", ".join(
        f"{item.name or f'damper {place}'} ({item.between[0]} to {item.between[1]}, law {item.law})"
        for place, item in enumerate(dampers, start=1)
    )
    return [
        f"structure.dampers are not in this export, which is the structure without dampers: {places}; "
        "a controlled damper is not a linear element"
    ]
