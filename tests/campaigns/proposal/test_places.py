"""Places of channels, in the words that headers of instrumented buildings and bridges use; the strings are invented."""

from __future__ import annotations

import pytest

from mrpipe.campaigns.proposal.places import PENTHOUSE, ROOF, place_of

pytestmark = pytest.mark.golden


@pytest.mark.parametrize(
    ("location", "level"),
    [
        ("6th Floor: East End", 6),
        ("3rd Floor - Col. C-5", 3),
        ("2nd Floor: 10 ft from East Wall", 2),
        ("6th Floor: Column B2", 6),
        ("Level 5 - NE corner, Grid 10", 5),
        ("Second Floor, North", 2),
        ("12/F", 12),
        ("Roof: South Wall", ROOF),
        ("Roof: Base of Penthouse", ROOF),
        ("Penthouse", PENTHOUSE),
        ("Bent 4: Top of Column", ROOF),
        ("Ground Floor: West Wall", 0),
        ("2nd Floor (Ground Level)", 0),
        ("Bent 4: South Column, Grnd Level", 0),
        ("Pier 3: Pile Cap", 0),
        ("Basement - NW corner", -1),
        ("2nd Sublevel", -2),
        ("Level B", -1),
        ("B2", -2),
        ("Below Isolators: Foundation", 0),
        ("Above Base Isolators: 1st Floor", 1),
        ("1st Floor (Above Isolators)", 1),
        ("Deck: Center of Span 2", None),
        ("Bent 3", None),
        ("Edwards Air Force Base", None),
        ("", None),
    ],
)
def test_the_level_of_a_place(location: str, level: int | None) -> None:
    assert place_of(location).level == level
    assert not place_of(location).is_soil


def test_foundations_are_below_basements() -> None:
    assert (place_of("Foundation Level").level or 0) < (place_of("Basement Level 2").level or 0) < 0


@pytest.mark.parametrize(
    "location",
    [
        "Free Field - 100 ft W of Bldg",
        "Freefield",
        "Free-Field: Ground Level",
        "Reference FF",
        "Downhole 30 m",
        "Geotech Array, -30 m",
        "Abutment 1",
        "South Embankment",
    ],
)
def test_places_in_the_soil_are_no_floors(location: str) -> None:
    place = place_of(location)
    assert place.is_soil and place.level is None and place.floor is None


def test_a_deck_at_an_abutment_moves_with_the_bridge() -> None:
    assert not place_of("Deck: Near West Abutment").is_soil
    assert place_of("Roof").floor == -1 and place_of("Basement").floor == 0 and place_of("4th Floor").floor == 4
