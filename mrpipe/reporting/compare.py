"""Differences between two runs in settings, data and results.

Only the resolved configuration and the manifests of the stages are compared. No artifact is opened.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeGuard

WALL_CLOCK = frozenset({"seconds", "predicted_seconds", "real_time_factor"})
"""Keys of a summary that depend on the computer and are not compared."""
_NAMING_KEYS = ("name", "law", "form", "test", "id")
_IDENTITY = ("sha256", "campaign")
_FILES = "content of files."
_EXTERNAL = ("campaign:", "public data")
_CAMPAIGN_READERS = {
    "campaign:bench": ("prepare", "close-loop"),
    "campaign:frame": ("identify-frame",),
    "campaign:closed-loop": (),
}


@dataclass(frozen=True)
class KeptStage:
    """Stored results of one stage of a run.

    Attributes
    ----------
    inputs
        Input -> SHA-256; None for an optional input that was absent.
    settings
        Dotted name -> value of the settings that the stage read.
    code
        Module -> hash of its source.
    summary
        Summary that the stage printed.
    not_built
        Why the stage was skipped or failed; empty if it was built.
    """

    inputs: Mapping[str, str | None] = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    code: Mapping[str, str] = field(default_factory=dict)
    summary: Mapping[str, Any] = field(default_factory=dict)
    not_built: str = ""


@dataclass(frozen=True)
class KeptRun:
    """Contents of a run directory without its artifacts.

    Attributes
    ----------
    directory
        Run directory.
    settings
        Dotted name -> value of the resolved configuration.
    stages
        Stage -> what is kept of it, in the order of the run.
    """

    directory: Path
    settings: Mapping[str, Any]
    stages: Mapping[str, KeptStage]

    @property
    def built(self) -> dict[str, KeptStage]:
        """Stages that were built."""
        return {name: stage for name, stage in self.stages.items() if not stage.not_built}


def compare_runs(first: KeptRun, second: KeptRun, tolerance: float) -> dict[str, Any]:
    """Return every difference between two runs.

    Parameters
    ----------
    first, second
        The runs.
    tolerance
        Numbers of the results that differ by less than this share of the larger magnitude count as equal.

    Returns
    -------
    `runs`, `tolerance`, `settings`, `data`, `stages`, `verdicts` and `results`, as plain Python.
    """
    return {
        "runs": [str(first.directory), str(second.directory)],
        "tolerance": tolerance,
        "settings": setting_differences(first, second),
        "data": data_differences(first, second),
        "stages": stage_differences(first, second),
        "verdicts": [_verdict(first), _verdict(second)],
        "results": result_differences(first, second, tolerance),
    }


# --- settings and stages ---------------------------------------------------------------------------------------------
def setting_differences(first: KeptRun, second: KeptRun) -> list[dict[str, Any]]:
    """Return a row for each setting that differs: `setting`, `first`, `second`, `stages`.

    `stages` lists the stages that were built in both runs, and with different values of the setting. A stage that was
    built before the configuration was changed keeps its own value; such a difference is listed as well.
    """
    common = [name for name in first.built if name in second.built]
    by_stage: dict[str, list[str]] = {}
    values: dict[str, tuple[Any, Any]] = {}
    for stage in common:
        pair = first.built[stage].settings, second.built[stage].settings
        for name in _union(*pair):
            if name.startswith(_FILES) or pair[0].get(name) == pair[1].get(name):
                continue
            by_stage.setdefault(name, []).append(stage)
            values.setdefault(name, (pair[0].get(name), pair[1].get(name)))
    for name in _union(first.settings, second.settings):
        if first.settings.get(name) != second.settings.get(name):
            values[name] = first.settings.get(name), second.settings.get(name)
    order = {name: place for place, name in enumerate(_union(first.settings, second.settings))}
    return [
        {"setting": name, "first": values[name][0], "second": values[name][1], "stages": by_stage.get(name, [])}
        for name in sorted(values, key=lambda name: (order.get(name, len(order)), name))
    ]


def stage_differences(first: KeptRun, second: KeptRun) -> dict[str, Any]:
    """Return which stages were built in both runs or in one, why others were not, and whose code differs."""
    both = [name for name in first.built if name in second.built]
    return {
        "both": both,
        "only_first": [name for name in first.built if name not in second.built],
        "only_second": [name for name in second.built if name not in first.built],
        "not_built": [
            {"run": str(run.directory), "stage": name, "reason": stage.not_built}
            for run in (first, second)
            for name, stage in run.stages.items()
            if stage.not_built
        ],
        "code_differs": [name for name in both if first.built[name].code != second.built[name].code],
    }


# --- data ------------------------------------------------------------------------------------------------------------
def data_differences(first: KeptRun, second: KeptRun) -> list[dict[str, Any]]:
    """Return a row for each campaign, public data set or file named by a setting whose content or name differs.

    A row has `input`, `first` and `second`: mappings with `campaign` (its name), `path` and `sha256`, or None where the
    run does not read the input.
    """
    found = _data_of(first), _data_of(second)
    rows = []
    for name in _union(*found):
        pair = found[0].get(name), found[1].get(name)
        if pair[0] is None or pair[1] is None or any(pair[0][key] != pair[1][key] for key in _IDENTITY):
            rows.append({"input": name, "first": pair[0], "second": pair[1]})
    return rows


def _data_of(run: KeptRun) -> dict[str, dict[str, Any]]:
    """Return input -> name, path and digests of what a run reads from outside."""
    digests: dict[str, list[str]] = {}
    for stage in run.built.values():
        files = {name: value for name, value in stage.settings.items() if name.startswith(_FILES)}
        external = {name: value for name, value in stage.inputs.items() if name.startswith(_EXTERNAL)}
        for name, value in {**external, **files}.items():
            known = digests.setdefault(name, [])
            if value is not None and value not in known:
                known.append(str(value))
    return {
        name: {
            "campaign": _campaign_name(run, name),
            "path": run.settings.get("campaigns." + name.partition(":")[2].replace("-", "_")),
            # two stages of one run may have read two states of a campaign
            "sha256": " and ".join(sorted(values)),
        }
        for name, values in digests.items()
        if values
    }


def _campaign_name(run: KeptRun, name: str) -> str | None:
    for stage in _CAMPAIGN_READERS.get(name, ()):
        if stage in run.built and "campaign" in run.built[stage].summary:
            return str(run.built[stage].summary["campaign"])
    return None


# --- results ---------------------------------------------------------------------------------------------------------
def result_differences(first: KeptRun, second: KeptRun, tolerance: float) -> list[dict[str, Any]]:
    """Return a row for each entry of a summary that differs, for stages that were built in both runs.

    A row has `stage`, `key` (dotted), `first`, `second`, `relative_difference` (of `second` to `first`; None for texts,
    for entries of one run and where `first` is zero) and `present` (`both`, `first` or `second`). Rows are in the order
    of the stages. Within a stage, entries of both runs come first, and single values before the entries of tables.
    """
    rows = []
    for stage in first.built:
        if stage not in second.built:
            continue
        values = flat_results(first.built[stage].summary), flat_results(second.built[stage].summary)
        found = [
            {"stage": stage, "key": ".".join(key), **row}
            for key in sorted(_union(*values), key=lambda key: (not (key in values[0] and key in values[1]), len(key)))
            if (row := _result_row(key, *values, tolerance)) is not None
        ]
        rows += found
    return rows


def _result_row(
    key: tuple[str, ...],
    first: Mapping[tuple[str, ...], Any],
    second: Mapping[tuple[str, ...], Any],
    tolerance: float,
) -> dict[str, Any] | None:
    before, after = first.get(key), second.get(key)
    present = "both" if key in first and key in second else "first" if key in first else "second"
    relative = None
    if _is_number(before) and _is_number(after):
        if abs(after - before) <= tolerance * max(abs(before), abs(after)):
            return None
        relative = (after - before) / abs(before) if before else None
    elif before == after and present == "both":
        return None
    return {"first": before, "second": after, "relative_difference": relative, "present": present}


def flat_results(summary: Any) -> dict[tuple[str, ...], Any]:
    """Return the entries of a summary by the parts of their dotted keys, without those that measure the computer.

    Rows of a table are named by their `name`, `law`, `form`, `test` or `id` where this is unique, else counted from 0.
    """
    return dict(_entries(summary, ()))


def _entries(value: Any, key: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    if key and key[-1] in WALL_CLOCK:
        return
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _entries(inner, (*key, str(name)))
    elif isinstance(value, list):
        for name, inner in zip(_row_names(value), value, strict=True):
            yield from _entries(inner, (*key, name))
    else:
        yield key, value


def _row_names(rows: Sequence[Any]) -> list[str]:
    if rows and all(isinstance(row, Mapping) for row in rows):
        for key in _NAMING_KEYS:
            names = [str(row.get(key, "")) for row in rows]
            if all(names) and len(set(names)) == len(names):
                return names
    return [str(place) for place in range(len(rows))]


def _verdict(run: KeptRun) -> dict[str, Any] | None:
    """Return what the tracing of a run found, or None where it was not built."""
    stage = run.built.get("close-loop")
    if stage is None:
        return None
    found = stage.summary
    return {
        "verdict": found.get("verdict"),
        "verdict_class": found.get("verdict_class"),
        "effects": [effect.get("name") for effect in found.get("effects") or []],
        "before_nrmse": (found.get("before") or {}).get("nrmse"),
        "after_nrmse": (found.get("after") or {}).get("nrmse"),
    }


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _union(*mappings: Iterable[Any]) -> list[Any]:
    """Return the keys of several mappings, each once, in order."""
    return list(dict.fromkeys(key for mapping in mappings for key in mapping))
