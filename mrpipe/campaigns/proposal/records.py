"""The channels of a strong-motion record of a building or bridge: one direction, its ground, and its floors."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.proposal.columns import Column, Guess, Layout
from mrpipe.campaigns.proposal.places import ROOF, Place, place_of
from mrpipe.words import counted, some

_BESIDE = "no sensor at the base was found; this one is near the structure and may move differently"
_FIRST_FLOOR = "no sensor below it was found; in an American building the 1st floor is at the ground"
_BY_ORDER = "the number of this floor is guessed from the order of columns"
_BY_LEVEL = "the levels with sensors are numbered from the lowest one up, because some levels have no sensor"
_SEVERAL = "some levels have several sensors: the ends x1, x2, ... of the names number the sensors of a level"
_COMPASS = {"n": 0, "north": 0, "e": 90, "east": 90, "s": 180, "south": 180, "w": 270, "west": 270}
_DEGREES = re.compile(r"^(\d{1,3})\s*(?:deg\w*)?\.?$")


def lay_out_record(columns: Sequence[Column], file: DataFile) -> Layout:
    """Propose the channels of a record: those of the direction that most sensors of the structure have.

    The lowest channel is the ground. Without one in the structure the free field is, or the 1st floor of a building.
    Further channels on the ground and in the soil are not floors.

    Parameters
    ----------
    columns
        Columns of the record.
    file
        The record; `accelerations` says which channels are horizontal.
    """
    places = {item.name: place_of(_location(item.name)) for item in columns}
    directions = {item.name: _direction(item.name) for item in columns if file.accelerations.get(item.name)}
    main = _main_direction(directions, places)
    chosen = [item for item in columns if directions.get(item.name) in ("", main)]
    ground, doubt = _ground(chosen, places)
    channels = {"ground_acceleration": _guess(ground, doubt)} if ground else {}
    floors = [item for item in chosen if item is not ground and not _at_ground(places[item.name])]
    channels |= _floors(floors, places)
    used = {guess.column for guess in channels.values()}
    across = [
        name for name, direction in directions.items() if direction not in ("", main) and not places[name].is_soil
    ]
    notes = (_across_note(across, _stated_direction(chosen[0].name)),) if across and channels else ()
    return Layout(channels, tuple(item.name for item in columns if item.name not in used), notes)


def _location(name: str) -> str:
    return name.partition(":")[2].partition(",")[2]


def _stated_direction(name: str) -> str:
    return name.partition(":")[2].partition(",")[0].strip()


def _direction(name: str) -> str:
    """Return the direction of a channel, as an angle where it is one: `E`, `090` and `90 Deg` are the same."""
    text = _stated_direction(name).casefold()
    degrees = _DEGREES.match(text)
    angle = int(degrees[1]) % 360 if degrees else _COMPASS.get(text)
    return text if angle is None else f"{angle} deg"


def _main_direction(directions: dict[str, str], places: dict[str, Place]) -> str:
    """Return the direction of most channels of the structure; those in the soil count where there are no others."""
    stated = [(name, direction) for name, direction in directions.items() if direction]
    counts = Counter(direction for name, direction in stated if not places[name].is_soil)
    counts = counts or Counter(direction for _, direction in stated)
    return counts.most_common(1)[0][0] if counts else ""


def _at_ground(place: Place) -> bool:
    return place.is_soil or (place.level is not None and place.level <= 0)


def _ground(chosen: Sequence[Column], places: dict[str, Place]) -> tuple[Column | None, str]:
    """Return the channel of the motion that excites the structure, and what is unsure about it."""
    known = [(place.level, item) for item in chosen if (place := places[item.name]).level is not None]
    levels = sorted({level for level, _ in known if level is not None})
    if levels and levels[0] <= 0:
        return next(item for level, item in known if level == levels[0]), ""
    if len(levels) > 1 and levels[0] == 1:
        return next(item for level, item in known if level == 1), _FIRST_FLOOR
    return next((item for item in chosen if places[item.name].is_soil), None), _BESIDE


def _floors(floors: Sequence[Column], places: dict[str, Place]) -> dict[str, Guess]:
    """Return the channels of the floors, from the lowest level up; in the order of columns where a level is unknown.

    Sensors of one level belong to one floor. Several sensors on a level show that floors turn, so that all names get an
    end that numbers the sensors of a level.
    """
    by_level: dict[int, list[Column]] = {}
    for item in floors:
        level = places[item.name].level
        if level is None:
            return {
                f"floor_acceleration_{number}": _guess(each, _BY_ORDER) for number, each in enumerate(floors, start=1)
            }
        by_level.setdefault(level, []).append(item)
    levels = sorted(by_level)
    numbered = [level for level in levels if level < ROOF]
    # the lowest floor above the ground is the 1st, or the 2nd where the 1st is at the ground
    whole = any(numbered == list(range(first, first + len(numbered))) for first in (1, 2))
    several = any(len(items) > 1 for items in by_level.values())
    doubt = "; ".join(filter(None, ("" if whole else _BY_LEVEL, _SEVERAL if several else "")))
    return {
        f"floor_acceleration_{number}" + (f"_x{place}" if several else ""): _guess(item, doubt)
        for number, level in enumerate(levels, start=1)
        for place, item in enumerate(by_level[level], start=1)
    }


def _guess(column: Column, doubt: str) -> Guess:
    return Guess(column.name, "m/s^2", doubt)


def _across_note(names: Sequence[str], main: str) -> str:
    which = f"{counted(len(names), 'horizontal channel')} in another direction than {main} ({some(names)})"
    verb = "are" if len(names) > 1 else "is"
    return f"{which} {verb} not used; for the modes in that direction, write a second campaign with its channels"
