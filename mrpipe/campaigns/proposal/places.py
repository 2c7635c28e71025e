"""Where in a structure a channel of a strong-motion record is: `6th Floor: East Wall`, `Roof`, `Bent 4: Grnd Level`.

The words are those of the Californian and American networks, whose records name the place of each channel in English. A
building of them counts the floor at street level as the first.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

ROOF, PENTHOUSE = 1000, 1001
_BELOW, _FOUNDATION = -1, -100
_ORDINALS = (
    *("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth", "eleventh"),
    *("twelfth", "thirteenth", "fourteenth", "fifteenth", "sixteenth", "seventeenth", "eighteenth", "nineteenth"),
    "twentieth",
)
_LEVEL = r"(?:floor|flr|fl|story|storey|level|lvl)"
_SEGMENT = re.compile(r"\s*[:;,()]\s*|\s+-+\s+")
_NUMBER = re.compile(rf"\b(\d+)(?:st|nd|rd|th)?[\s/.-]*(?:{_LEVEL}|f)\b|\b{_LEVEL}[\s.#-]*(\d+)\b")
_WORD_NUMBER = re.compile(rf"\b({'|'.join(_ORDINALS)})[\s-]+{_LEVEL}\b")
_BASEMENT = re.compile(
    r"\b(?:(\d)(?:st|nd|rd|th)?[\s-]+)?(?:sub-?level|basement|bsmt)(?:[\s-]*level)?(?:[\s-]+(\d))?\b"
    r"|^(?:level[\s-]+)?b-?(\d)(?:[\s-]+level)?$|^level[\s-]+b$|\b(sub-?basement)\b"
)
_IS_GROUND = re.compile(r"^(?:at\s+)?(?:ground|grnd|grade|street)(?:\s+(?:level|floor|flr))?$")
_GROUND = re.compile(r"\b(?:ground|grnd|grade|street[\s-]+level)\b")
_FOUNDATIONS = re.compile(r"\b(?:foundations?|fdn|footings?)\b")
_BASE = re.compile(r"\b(?:(?<!force )(?<!naval )base|bottom|piles?|pilecap|caisson)\b")
_ROOF, _PENTHOUSE = re.compile(r"\broof(?:top)?\b"), re.compile(r"\bpent-?house\b")
_TOP, _DECK = re.compile(r"\btop\b"), re.compile(r"\b(?:deck|span|girder)\b")
_ISOLATOR, _UNDER = re.compile(r"\bisolat\w*"), re.compile(r"\b(?:below|under|beneath|bottom)\b")
_SOIL = re.compile(r"\bfree[\s-]*fi?e?ld\b|\bff\b|\b(?:down-?hole|bore-?hole|depth|geotech\w*)\b")
_SUPPORT = re.compile(r"\babut\w*|\bembankment")


@dataclass(frozen=True)
class Place:
    """Place of a channel.

    Attributes
    ----------
    level
        Number of the floor; 0 at the ground and negative below it, :data:`ROOF` and :data:`PENTHOUSE` above all floors;
        None where the words do not say.
    is_soil
        Whether the channel is in the soil near the structure, or at a place that moves with it, such as an abutment.
    """

    level: int | None = None
    is_soil: bool = False

    @property
    def floor(self) -> int | None:
        """Floor as headers of other files state it: 0 for the ground, -1 for the top."""
        if self.level is None:
            return None
        return -1 if self.level >= ROOF else max(self.level, 0)


def place_of(location: str) -> Place:
    """Return the place that the words of a header state.

    The first part that names a level decides (`Roof: Base of Penthouse` is the roof). A later part overrules a number
    if it is nothing but the ground (`2nd Floor (Ground Level)`). Distances and numbers of columns or bents are not
    levels.
    """
    text = location.casefold()
    if _SOIL.search(text):
        return Place(is_soil=True)
    number: int | None = None
    weak: int | None = None
    for part in filter(None, _SEGMENT.split(text)):
        firm, found, guessed = _levels(part)
        if firm is not None and (number is None or _IS_GROUND.match(part)):
            return Place(firm)
        number = found if number is None else number
        weak = guessed if weak is None else weak
    level = weak if number is None else number
    return Place(level, is_soil=level is None and bool(_SUPPORT.search(text)) and not _DECK.search(text))


def _levels(part: str) -> tuple[int | None, int | None, int | None]:
    """Return the level that a part names as ground or roof, that of its number, and that of words that say less."""
    if _ISOLATOR.search(part):
        # the floor above the isolators moves, although its name may contain the word base
        return (0, None, None) if _UNDER.search(part) else (None, _number(part), None)
    if basement := _BASEMENT.search(part):
        depth = next((int(digit) for digit in basement.groups()[:3] if digit), 2 if basement[4] else 1)
        return _BELOW * depth, None, None
    for pattern, level in ((_FOUNDATIONS, _FOUNDATION), (_PENTHOUSE, PENTHOUSE), (_ROOF, ROOF), (_GROUND, 0)):
        if pattern.search(part):
            return level, None, None
    weak = 0 if _BASE.search(part) else ROOF if _TOP.search(part) else None
    return None, _number(part), weak


def _number(part: str) -> int | None:
    if word := _WORD_NUMBER.search(part):
        return _ORDINALS.index(word[1]) + 1
    found = _NUMBER.search(part)
    return int(found[1] or found[2]) if found else None
