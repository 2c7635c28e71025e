"""Campaigns that are proposed from records of buildings; layouts of instrumented buildings, values invented."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.proposal.columns import Column, Layout
from mrpipe.campaigns.proposal.propose import propose_campaigns
from mrpipe.campaigns.proposal.records import lay_out_record
from mrpipe.campaigns.proposal.words import Header

pytestmark = pytest.mark.planted


def layout(*names: str) -> Layout:
    """Return the layout of a record whose channels have these names; those with Up are vertical."""
    columns = [Column(name, Header("acceleration", "m/s^2", "acceleration"), np.arange(3.0)) for name in names]
    file = DataFile(Path("a.zip"), names, dict.fromkeys, accelerations={name: ": Up" not in name for name in names})
    return lay_out_record(columns, file)


def numbers(found: Layout) -> dict[str, str]:
    """Return channel -> number of its column."""
    return {name: guess.column.partition(":")[0] for name, guess in found.channels.items()}


def test_sensors_of_a_building_are_numbered_from_the_lowest_level_up() -> None:
    found = layout(
        "1: Up, Basement",
        "2: 360 Deg, Ground Floor",
        "3: 360 Deg, Basement",
        "4: 360 Deg, Roof: East Wall",
        "5: 360 Deg, Roof: West Wall",
        "6: 360 Deg, 4th Floor: Col. C-12",
        "7: 360 Deg, 2nd Floor: 10 ft from Col. A-5",
        "8: 90 Deg, Roof: Center",
        "9: 360 Deg, Free Field - 100 ft W of Bldg",
    )
    assert numbers(found) == {
        "ground_acceleration": "3",
        "floor_acceleration_1_x1": "7",
        "floor_acceleration_2_x1": "6",
        "floor_acceleration_3_x1": "4",
        "floor_acceleration_3_x2": "5",
    }
    doubts = {guess.unsure for name, guess in found.channels.items() if name != "ground_acceleration"}
    assert len(doubts) == 1 and all(part in doubts.copy().pop() for part in ("have no sensor; ", "several sensors"))
    [note] = found.notes
    assert note.startswith("1 horizontal channel in another direction than 360 Deg (8: 90 Deg, Roof: Center)")


def test_one_sensor_on_each_floor_needs_no_doubt() -> None:
    found = layout(
        "1: N, Foundation", "2: N, 3rd Floor", "3: 360 Deg, Second Floor", "4: 0 Deg, Roof", "5: N, Penthouse"
    )
    assert list(numbers(found).values()) == ["1", "3", "2", "4", "5"], "directions that are the same are one"
    assert not any(guess.unsure for guess in found.channels.values()) and not found.notes


def test_the_first_floor_is_the_ground_where_nothing_lies_below_it() -> None:
    found = layout("1: N, 1st Floor", "2: N, 2nd Floor", "3: N, Roof", "4: N, Free Field: 200 ft N")
    assert numbers(found) == {"ground_acceleration": "1", "floor_acceleration_1": "2", "floor_acceleration_2": "3"}
    assert "the 1st floor is at the ground" in found.channels["ground_acceleration"].unsure
    isolated = layout("1: N, Foundation: Below Isolators", "2: N, 1st Floor: Above Isolators", "3: N, Roof")
    assert list(numbers(isolated).values()) == ["1", "2", "3"]
    alone = layout("1: N, 2nd Floor", "2: N, Roof")
    assert "ground_acceleration" not in alone.channels


def test_a_channel_that_shortens_all_others_is_named(tmp_path: Path) -> None:
    def channel(number: int, place: str, second: int, count: int) -> str:
        rows = ("  1.000000  2.000000" * 4 + "\n") * (count // 8)
        head = f"Start time:  4/26/21, 17:09:{second:02d}.0 UTC (GPS)\nChan {number}: N     Location: {place}\n"
        return f"{head}{count} points of accel data equally spaced at .010 sec, in cm/sec2. (8f10.6)\n{rows}"

    for second, count, words in (
        (14, 2000, "3: N, Free Field starts last and 1: N, 1st Floor ends"),
        (10, 800, "3: N"),
    ):
        parts = [
            channel(1, "1st Floor", 10, 1600),
            channel(2, "Roof", 10, 1600),
            channel(3, "Free Field", second, count),
        ]
        (tmp_path / "a.V2").write_text("".join(parts))
        [found] = propose_campaigns(tmp_path, "building", None, tmp_path)
        [line] = [item for item in found.unsure if "share" in item]
        assert words in line and "leave such a channel out" in line
    (tmp_path / "a.V2").write_text("".join(channel(n, p, 10, 1600) for n, p in ((1, "1st Floor"), (2, "Roof"))))
    assert not any("share" in item for item in propose_campaigns(tmp_path, "building", None, tmp_path)[0].unsure)


def test_the_direction_of_the_structure_counts_and_not_that_of_the_soil() -> None:
    soil = [f"{n}: 90 Deg, Free Field" for n in (3, 4, 5)]
    found = layout("1: 360 Deg, 1st Floor", "2: 360 Deg, Roof", *soil)
    assert numbers(found) == {"ground_acceleration": "1", "floor_acceleration_1": "2"}
