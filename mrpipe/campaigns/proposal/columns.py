"""Which column of a file is which channel, from its header or, if the header names no quantity, from its samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.columns import DataFile
from mrpipe.campaigns.plausibility.reference import mean_frequency
from mrpipe.campaigns.proposal.places import place_of
from mrpipe.campaigns.proposal.samples import has_few_levels, motion_and_force
from mrpipe.campaigns.proposal.words import Header, read_header, read_path, split_words
from mrpipe.errors import UserError
from mrpipe.words import counted, listed

MOST_COLUMNS = 200
FEWEST_SAMPLES = 20
"""A column with at most as many samples is not a record."""
_BESIDE = "no sensor at the base was found; this one is near the structure and may move differently"
_DRIVE_GUESSED = "no unit in the header; guessed from the numbers"


@dataclass(frozen=True)
class Column:
    """A column of numbers: its name, what its header says, and its samples, shape (n,)."""

    name: str
    header: Header
    values: FloatArray


@dataclass(frozen=True)
class Guess:
    """A proposed channel.

    Attributes
    ----------
    column
        Name of the column; empty where `value` is proposed.
    unit
        Proposed unit.
    unsure
        What to check, empty where header and samples agree.
    set_point
        Whether a drive is a command.
    value
        Constant, for a drive that no column holds.
    size
        Amplitude from which the unit was guessed, None where the header gives the unit.
    """

    column: str
    unit: str
    unsure: str = ""
    set_point: bool = False
    value: float | None = None
    size: float | None = None


@dataclass(frozen=True)
class Layout:
    """The channels of a file, the columns that are not used, and what the user should know about them."""

    channels: dict[str, Guess] = field(default_factory=dict)
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def rig(self) -> str:
        """Rig that the channels belong to."""
        return "shear-frame" if any(name.startswith("floor_") for name in self.channels) else "damper-bench"


def columns_of(file: DataFile) -> list[Column]:
    """Return the columns of numbers of a file, of all lengths; matrices are split into their columns."""
    found: list[Column] = []
    stated = {**_unit_rows(file), **file.units}
    separator = separator_of(file)
    for name in file.names[:MOST_COLUMNS]:
        for column in (name, *(f"{name}[:,{index}]" for index in range(_width(file, name)))):
            try:
                values = file.column(column, "")
            except UserError:
                continue
            if np.isfinite(values).sum() > FEWEST_SAMPLES:
                known = name in file.accelerations
                header = _of_a_record(name) if known else read_path(name, separator, stated.get(name, ""))
                found.append(Column(column, header, values))
    return found


def separator_of(file: DataFile) -> str:
    """Return the sign between a group and a channel in the names of a file's columns, empty where it has no groups."""
    if file.separator:
        return file.separator
    paths = [name for name in file.names if "/" in name]
    return "/" if paths else "" if file.table else "."


def _of_a_record(name: str) -> Header:
    """Return what the name of a channel of a strong-motion record says (`7: 90 Deg, Roof: East`); SI is known."""
    _, _, place = name.partition(":")
    said = place_of(place.partition(",")[2])
    return Header("acceleration", "m/s^2", "acceleration", said.floor, support=said.is_soil)


def _width(file: DataFile, name: str) -> int:
    if file.table:
        return 0
    try:
        shape = np.shape(file.fetch(name))
    except Exception:
        return 0
    return shape[1] if len(shape) == 2 and 1 < shape[1] <= 64 else 0


def _unit_rows(file: DataFile) -> dict[str, str]:
    """Return column name -> word of another header line, which may be a unit."""
    rows: dict[str, str] = {}
    for row in file.headers:
        for name, word in zip(file.names, row, strict=False):
            if word and word != name and read_header(f"x [{word.strip('[](){} ')}]").unit:
                rows.setdefault(name, word)
    return rows


def lay_out_bench(columns: list[Column], file: DataFile) -> Layout:
    """Propose the channels of a bench test."""
    channels: dict[str, Guess] = {}
    left = [item for item in columns if np.ptp(item.values) > 0.0 or item.header.quantity or item.header.unit]
    taken: set[str] = set()

    def take(channel: str, column: Column | None, guess: Guess) -> None:
        channels[channel] = guess
        if column is not None:
            taken.add(column.name)

    time = _by_header(left, "time", taken) or (None if file.time_s is not None else _clock(left))
    if time is not None:
        take("time", time, _time_guess(time))
    for channel in ("force", "displacement", "velocity", "acceleration"):
        column = _by_header(left, channel, taken)
        if column is not None:
            take(channel, column, _guess(column, channel))
    drive = _by_header(left, "current", taken) or _by_header(left, "voltage", taken) or _called_u(left, taken)
    if drive is not None:
        quantity = drive.header.unit_quantity or ("voltage" if _is_u(drive) else drive.header.quantity)
        unit = drive.header.unit or ("V" if quantity == "voltage" else _drive_unit(drive.values))
        unsure = "" if drive.header.unit else _DRIVE_GUESSED
        size = None if drive.header.unit or quantity == "voltage" else float(np.nanmax(np.abs(drive.values)))
        take("drive", drive, Guess(drive.name, unit, unsure, set_point=drive.header.command, size=size))
    rest = [item for item in left if item.name not in taken and not item.header.quantity]
    _by_samples(channels, taken, [item for item in rest if not item.header.unit])
    unused = tuple(item.name for item in columns if item.name not in taken)
    return Layout(_with_twins(channels, columns), unused)


def _with_twins(channels: Mapping[str, Guess], columns: Sequence[Column]) -> dict[str, Guess]:
    """Return the channels, with a doubt on each whose header stands above another column as well."""
    found = {}
    for channel, guess in channels.items():
        twins = [item.name for item in columns if guess.column and item.name.rpartition("#")[0] == guess.column]
        doubt = f"the header is that of {counted(len(twins) + 1, 'column')}; the other is {listed(twins)}"
        found[channel] = replace(guess, unsure="; ".join(filter(None, (guess.unsure, doubt)))) if twins else guess
    return found


def lay_out_frame(columns: list[Column], file: DataFile) -> Layout:
    """Propose the channels of a frame test; floors are numbered by the numbers in the headers, or in order."""
    channels: dict[str, Guess] = {}
    taken: set[str] = set()
    time = _by_header(columns, "time", taken) or (None if file.time_s is not None else _clock(columns))
    if time is not None:
        channels["time"] = _time_guess(time)
        taken.add(time.name)
    for quantity in ("acceleration", "displacement", "velocity"):
        group = [item for item in columns if item.name not in taken and _says(item, quantity)]
        ground = _ground(group)
        if ground is not None and quantity != "velocity":
            guess = _guess(ground, quantity)
            unsure = guess.unsure or (_BESIDE if ground.header.support else "")
            channels[f"ground_{quantity}"] = replace(guess, unsure=unsure)
            taken.add(ground.name)
        # a second sensor on the ground does not measure a floor
        floors = [item for item in group if not (_on_the_ground(item) or item.header.damper)]
        _number_floors(channels, taken, floors, quantity)
    for channel, quantity in (("damper_force", "force"), ("damper_displacement", "displacement")):
        column = next((item for item in columns if item.name not in taken and _says(item, quantity)), None)
        if column is not None and (column.header.damper or channel == "damper_force"):
            name = "desired_force" if column.header.command and quantity == "force" else channel
            channels[name] = _guess(column, quantity)
            taken.add(column.name)
    drive = _by_header(columns, "current", taken) or _by_header(columns, "voltage", taken)
    if drive is not None and drive.header.unit:
        channels["drive"] = Guess(drive.name, drive.header.unit, set_point=drive.header.command)
        taken.add(drive.name)
    used = {guess.column for guess in channels.values()}
    return Layout(channels, tuple(item.name for item in columns if item.name not in used))


def _on_the_ground(column: Column) -> bool:
    return column.header.floor == 0 or column.header.support


def _ground(group: Sequence[Column]) -> Column | None:
    """Return the column of the motion that excites the structure: at its base, else on the soil near it."""
    return next((item for item in group if item.header.floor == 0), None) or next(
        (item for item in group if item.header.support), None
    )


def floor_columns(columns: list[Column]) -> int:
    """Return how many columns look like channels of floors."""
    floors = {item.header.floor for item in columns if _says(item, "acceleration") or _says(item, "displacement")}
    return len({floor for floor in floors if floor is not None and floor != 0})


def _says(column: Column, quantity: str) -> bool:
    header = column.header
    return header.quantity == quantity or (not header.quantity and header.unit_quantity == quantity)


def _number_floors(channels: dict[str, Guess], taken: set[str], floors: list[Column], quantity: str) -> None:
    if not floors:
        return
    numbered = [item for item in floors if item.header.floor and item.header.floor > 0]
    numbers = [item.header.floor for item in numbered]
    top = [item for item in floors if item.header.floor == -1]
    sure = len(numbered) + len(top) == len(floors) and len(set(numbers)) == len(numbers)
    ordered = sorted(numbered, key=lambda item: item.header.floor or 0) + top if sure else floors
    expected = list(range(1, len(ordered) + 1))
    for number, column in zip(expected, ordered, strict=True):
        guess = _guess(column, quantity)
        if not sure or (numbers and sorted(n for n in numbers if n) != expected[: len(numbers)]):
            guess = replace(
                guess, unsure=guess.unsure or "the number of this floor is guessed from the order of columns"
            )
        channels[f"floor_{quantity}_{number}"] = guess
        taken.add(column.name)


def _by_header(columns: list[Column], quantity: str, taken: set[str]) -> Column | None:
    """Return the best column whose header names a quantity: with a fitting unit first, measured before commanded."""
    found = [item for item in columns if item.name not in taken and _says(item, quantity)]
    found.sort(key=lambda item: (item.header.command, item.header.unit_quantity != quantity, _is_u(item)))
    return found[0] if found else None


def _is_u(column: Column) -> bool:
    """Whether the header is the letter u without a unit, the symbol of a displacement and of a voltage."""
    return not column.header.unit and split_words(column.name)[-1:] == ["u"]


def _called_u(columns: list[Column], taken: set[str]) -> Column | None:
    """Return the column u that is left where another one is the displacement: it is the voltage of the drive."""
    return next((item for item in columns if item.name not in taken and _is_u(item)), None)


def _clock(columns: list[Column]) -> Column | None:
    """Return the column that increases evenly, as a clock does."""
    for item in columns:
        steps = np.diff(item.values)
        if item.header.quantity in ("", "time") and np.all(steps > 0.0) and np.std(steps) < 0.2 * np.mean(steps):
            return item
    return None


def _time_guess(column: Column) -> Guess:
    if column.header.unit_quantity == "time":
        return Guess(column.name, column.header.unit)
    step = float(np.median(np.diff(column.values)))
    for unit, factor in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if 15.0 <= 1.0 / max(step * factor, 1e-12) <= 2e5:
            return Guess(
                column.name, unit, "" if unit == "s" else f"no unit in the header; {unit} gives a plausible rate"
            )
    return Guess(column.name, "s", "no unit in the header, and no unit gives a plausible rate")


def _guess(column: Column, quantity: str) -> Guess:
    """Return the channel of a column whose quantity is known."""
    header = column.header
    if header.unit_quantity == quantity:
        return Guess(column.name, header.unit)
    size = amplitude(column.values)
    unit, why = unit_by_size(size, quantity)
    if header.unit:
        why = f"the header gives {header.unit}, which is not a unit of {quantity}: give scale and unit of the sensor"
    return Guess(column.name, unit, why, size=size)


def amplitude(values: FloatArray) -> float:
    """Return half the range of samples that may hold NaN."""
    return 0.5 * float(np.nanmax(values) - np.nanmin(values))


def unit_by_size(size: float, quantity: str) -> tuple[str, str]:
    """Return the likeliest unit of a quantity for samples of this amplitude, and why it is unsure."""
    limits = {
        "displacement": (("m", 0.3), ("mm", 1e9)),
        "velocity": (("m/s", 2.0), ("mm/s", 1e9)),
        "acceleration": (("g", 0.5), ("m/s^2", 300.0), ("mm/s^2", 1e9)),
        "force": (("kN", 5.0), ("N", 1e9)),
    }[quantity]
    unit = next(unit for unit, limit in limits if size < limit or limit == 1e9)
    return unit, f"no unit in the header; {unit} is guessed from an amplitude of {size:.3g}"


def _drive_unit(values: FloatArray) -> str:
    return "mA" if float(np.nanmax(np.abs(values))) > 30.0 else "A"


def share_units(layouts: Sequence[Layout]) -> list[Layout]:
    """Return the layouts of the files of a folder, with one unit for a column whose header names none.

    The amplitude of one test does not show the unit: 20 of 80 mA could be 20 A, and a slow test of 4 N could be one of
    4 kN. Files with the same column therefore share the unit of the test with the largest amplitude.
    """
    largest: dict[tuple[str, str], Guess] = {}
    for layout in layouts:
        for channel, guess in layout.channels.items():
            best = largest.setdefault((channel, guess.column), guess)
            if guess.size is not None and guess.size > (best.size or 0.0):
                largest[channel, guess.column] = guess
    return [
        replace(
            layout,
            channels={
                channel: guess if guess.size is None else largest[channel, guess.column]
                for channel, guess in layout.channels.items()
            },
        )
        for layout in layouts
    ]


def _by_samples(channels: dict[str, Guess], taken: set[str], columns: list[Column]) -> None:
    """Propose displacement, force and drive among columns whose headers name no quantity.

    A drive is constant or has few levels. Of the others, displacement and force are the two of which one follows the
    derivative of the other best, because the force of a damper follows the velocity. Of these two, the displacement has
    the lower mean frequency, because a damper distorts its force. Where one more column changes, it is the drive.
    """
    why = "the header names no quantity; guessed from the samples"
    constant = [item for item in columns if has_few_levels(item.values)]
    moving = [item for item in columns if item not in constant]
    if "drive" not in channels and constant:
        size = float(np.nanmax(np.abs(constant[0].values)))
        channels["drive"] = Guess(constant[0].name, _drive_unit(constant[0].values), why, size=size)
        taken.add(constant[0].name)
    moving.sort(key=lambda item: mean_frequency(np.nan_to_num(item.values), 1.0))
    if len(moving) > 2 and not {"displacement", "force"} & set(channels):
        pair = [moving[place] for place in motion_and_force([item.values for item in moving])]
        others = [item for item in moving if item not in pair]
        moving = pair
        if "drive" not in channels and len(others) == 1:
            size = float(np.nanmax(np.abs(others[0].values)))
            channels["drive"] = Guess(others[0].name, _drive_unit(others[0].values), why, size=size)
            taken.add(others[0].name)
    for channel in ("displacement", "force"):
        if channel not in channels and moving:
            column = moving.pop(0) if channel == "displacement" else moving.pop()
            size = amplitude(column.values)
            channels[channel] = Guess(column.name, unit_by_size(size, channel)[0], why, size=size)
            taken.add(column.name)


def open_columns(path: Path) -> tuple[DataFile, list[Column]]:
    """Open a file and return it with its columns of numbers."""
    from mrpipe.campaigns.files import open_data_file

    file = open_data_file(path)
    return file, columns_of(file)
