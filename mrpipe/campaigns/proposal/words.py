"""What the header of a column says: quantity, unit, floor, and whether it is a command.

Words are compared without accents and case, in English, German, French, Spanish, Portuguese, Italian and Polish.
"""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass, replace

from mrpipe import units
from mrpipe.errors import UserError

WORDS: dict[str, tuple[str, ...]] = {
    "time": ("t", "time", "zeit", "temps", "tiempo", "tempo", "czas", "timestamp", "stamp", "seconds", "sec"),
    "displacement": (
        *("x", "d", "s", "u", "disp", "displacement", "weg", "stroke", "lvdt", "position", "pos", "travel", "hub"),
        *("auslenkung", "verschiebung", "deplacement", "desplazamiento", "deslocamento", "spostamento", "laser"),
        *("przemieszczenie", "kolbenweg", "elongation", "piston", "course", "recorrido", "corsa"),
    ),
    "velocity": (
        *("v", "vel", "velocity", "geschwindigkeit", "vitesse", "velocidad", "velocidade", "velocita", "speed"),
        *("predkosc", "xdot"),
    ),
    "acceleration": (
        *("a", "acc", "accel", "acceleration", "beschleunigung", "beschl", "aceleracion", "aceleracao", "xddot"),
        *("accelerazione", "przyspieszenie", "accelerometer", "acce"),
    ),
    "force": (
        *("f", "force", "kraft", "load", "last", "fuerza", "forca", "forza", "sila", "loadcell", "kraftmessdose"),
        *("effort", "dampferkraft", "damperforce"),
    ),
    "current": (
        *("i", "current", "strom", "courant", "corriente", "corrente", "prad", "amps", "ampere", "coil", "spulenstrom"),
        *("amp",),
    ),
    "voltage": ("voltage", "volt", "volts", "spannung", "tension", "voltaje", "tensao", "tensione", "napiecie", "u"),
}
"""Quantity -> words that name it; longer words also count as beginnings of words."""

GROUND = {
    *("ground", "base", "table", "shaker", "shaking", "tisch", "boden", "fundament", "sol", "suelo", "mesa", "input"),
    *("terreno", "basis", "rutteltisch", "excitation", "g", "grnd", "basement", "bsmt", "footing", "foundation"),
}
SUPPORTS = {"abutment", "abut", "freefield", "embankment"}
"""Places that move with the soil, unless the header names the deck too (`Deck: Near West Abutment`)."""
DECK = {"deck", "span", "girder"}
TOP = {"top", "roof", "dach", "techo", "tetto", "toit"}
COMMAND = {
    *("command", "cmd", "soll", "set", "setpoint", "ref", "reference", "target", "nominal", "consigne", "desired"),
    *("demand", "sollwert", "commande", "consigna"),
}
DAMPER = {"damper", "dampfer", "mr", "amortisseur", "amortiguador", "smorzatore", "tlumik"}

_TAIL = re.compile(r"(?:\s+in\s+|[/_\s])([A-Za-zµμ²³^/0-9*]{1,8})$")
_LETTERS = {"α": "a", "β": "b", "δ": "d", "ł": "l", "ø": "o", "ß": "ss", "²": "2", "³": "3"}


@dataclass(frozen=True)
class Header:
    """Quantity, unit and place that a header states.

    Attributes
    ----------
    quantity
        Key of :data:`WORDS`, empty where it does not say.
    unit
        Unit as written, empty where it does not say.
    unit_quantity
        Quantity that the unit measures, empty where there is no unit.
    floor
        Floor of a frame; 0 for the ground, -1 for the top, None where it does not say.
    command, damper
        Whether it names a command, and a damper.
    support
        Whether it names a place that moves with the soil and is not the base of the structure.
    """

    quantity: str = ""
    unit: str = ""
    unit_quantity: str = ""
    floor: int | None = None
    command: bool = False
    damper: bool = False
    support: bool = False


def read_header(text: str, unit_row: str = "") -> Header:
    """Return what a header says; `unit_row` is the word below it in a line of units, if there is one."""
    unit, rest = _unit_of(text)
    if not unit and unit_row:
        unit, _ = _unit_of(f"x [{unit_row.strip('[](){} ')}]")
    words = split_words(rest)
    measured = unit_quantity(unit) if unit else ""
    quantity = _quantity(words, measured)
    return Header(
        quantity=quantity,
        unit=unit,
        unit_quantity=measured,
        floor=_floor(words),
        command=any(word in COMMAND for word in words),
        damper=any(word in DAMPER for word in words),
        support=bool(SUPPORTS & set(words)) and not (GROUND | DECK) & set(words),
    )


def read_path(name: str, separator: str, unit_row: str = "") -> Header:
    """Return what the name of a channel in a group says (`run 1/force`); an empty separator means that there is none.

    The channel comes before its group. A single letter of the group names no quantity, because `v_rand/temp` is no
    velocity.
    """
    whole = read_header(name, unit_row)
    group, _, channel = name.rpartition(separator) if separator else ("", "", name)
    # with a unit, the separator may be that of the unit: `Weg/mm`
    if not group or whole.unit:
        return whole
    inner = read_header(channel).quantity
    return replace(whole, quantity=inner or _quantity([word for word in split_words(name) if len(word) > 2], ""))


def split_words(text: str) -> list[str]:
    """Return the words and numbers of a text in lower case without accents; `accFloor2` gives three."""
    text = re.sub(r"([a-z])([A-Z])", r"\1 \2", text)
    text = "".join(_LETTERS.get(letter, letter) for letter in text)
    plain = unicodedata.normalize("NFKD", text.casefold())
    plain = "".join(letter for letter in plain if not unicodedata.combining(letter))
    return re.findall(r"[a-z]+|\d+", plain)


def unit_quantity(unit: str) -> str:
    """Return the quantity that a unit measures, empty where none of a test's channels has it."""
    for quantity in ("time", "displacement", "velocity", "acceleration", "force", "current", "voltage"):
        try:
            if units.same_dimension(unit, quantity):
                return quantity
        except UserError:
            return ""
    return ""


def _unit_of(text: str) -> tuple[str, str]:
    """Return the unit in a header and the header without it."""
    for found in reversed(units.bracketed_units(text)):
        if unit_quantity(found.unit):
            return found.unit, text[: found.start] + text[found.end :]
    tail = _TAIL.search(text.strip())
    # `a_g` is the acceleration of the ground, not one in g
    if tail and tail[0] != "_g" and unit_quantity(tail[1]) and tail.start() > 0:
        return tail[1], text.strip()[: tail.start()]
    return "", text


def _quantity(words: list[str], measured: str) -> str:
    """Return the quantity that words name; where several do, that which the unit measures."""
    named = [quantity for quantity, known in WORDS.items() if any(_is_one_of(word, known) for word in words)]
    # a single letter says less than a word
    strong = [
        quantity
        for quantity, known in WORDS.items()
        if any(len(word) > 2 and _is_one_of(word, known) for word in words)
    ]
    for candidates in (strong, named):
        if measured in candidates:
            return measured
        if candidates:
            return candidates[0]
    return ""


def _is_one_of(word: str, known: tuple[str, ...]) -> bool:
    return word in known or any(len(item) > 3 and (word.startswith(item) or word.endswith(item)) for item in known)


def _floor(words: list[str]) -> int | None:
    numbers = [int(word) for word in words if word.isdigit() and 0 < int(word) < 200]
    if any(word in GROUND and len(word) > 1 for word in words) or words[-1:] == ["g"]:
        return 0
    if any(word in TOP for word in words):
        return -1
    return numbers[-1] if numbers else None
