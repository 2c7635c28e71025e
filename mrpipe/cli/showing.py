"""What `mrpipe show` prints: campaigns and artifacts as tables, run directories, JSON results and plain data files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrpipe.errors import UserError
from mrpipe.words import shell_word

if TYPE_CHECKING:
    from mrpipe.campaigns.header import CampaignHeader
    from mrpipe.campaigns.plausibility import Finding

MOST_CHANNELS = 8
MOST_ROWS = 400


def describe_any(path: Path) -> dict[str, Any]:
    """Return what is inside a campaign, an artifact, a run directory, a JSON result or a file of measurements.

    Raises
    ------
    UserError
        If it is none of these, or cannot be read; the message says what to do with it.
    """
    from mrpipe.campaigns.model import CAMPAIGN_FILE
    from mrpipe.reporting.contents import describe_file

    if path.is_dir():
        if (path / CAMPAIGN_FILE).is_file():
            return _describe_campaign(path / CAMPAIGN_FILE)
        if (path / "manifests").is_dir() or (path / "config.yaml").is_file():
            return _describe_run(path)
        return _refuse_folder(path)
    if path.suffix.lower() in {".yaml", ".yml"}:
        return _describe_campaign(path)
    if path.suffix.lower() == ".json":
        return _describe_json(path)
    if path.suffix.lower() in {".h5", ".hdf5"} and _is_artifact(path):
        return describe_file(path)
    return _describe_data(path)


def _describe_campaign(file: Path) -> dict[str, Any]:
    """Return what a campaign holds, the units of its file, and a finding for each unknown effect that it declares."""
    from mrpipe.campaigns.header import read_header
    from mrpipe.reporting.contents import describe_file

    content = describe_file(file)
    unknown = unknown_effects(read_header(file))
    content["findings"] += [item.line for item in unknown]
    content["plausibility"] += [item.as_dict() for item in unknown]
    return {**content, "units": _units_of(file)}


def unknown_effects(header: CampaignHeader) -> list[Finding]:
    """Return a warning for each declared effect that the library does not hold, with the names that are valid.

    The user's own effects belong to a configuration, so they are unknown here.
    """
    if not header.declared_effects:
        return []
    from mrpipe.artifacts.yaml_source import nearest
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.cli.checking import effects_of_rig

    known = effects_of_rig(header.rig)
    found = []
    for index, name in enumerate(header.declared_effects):
        if name in known:
            continue
        likely = nearest(name, known)
        likely = "" if likely.startswith("known") else f"{likely} "
        found.append(
            Finding(
                name="effect-unknown",
                severity="warning",
                sentence=f"declared_effects[{index}]: {name!r} is not an effect of a {header.rig} campaign",
                remedy=f"{likely}valid names: {', '.join(sorted(known))}, and the effect "
                "of your own file, if close_loop.effect_files of the configuration names it",
            )
        )
    return found


def _is_artifact(path: Path) -> bool:
    import h5py

    try:
        with h5py.File(path, "r") as handle:
            return "schema" in handle.attrs
    except OSError:
        return True  # the reader of artifacts says what is wrong


def _units_of(path: Path) -> dict[str, str]:
    """Return channel -> unit that the campaign file gives it, for the whole campaign or in the first test that does."""
    from mrpipe.artifacts.yaml_source import read_yaml

    content = read_yaml(path).content
    tests = content.get("tests")
    places = [content, *(tests if isinstance(tests, list) else [])]
    found: dict[str, str] = {}
    for place in places:
        channels = place.get("channels") if isinstance(place, Mapping) else None
        for name, entry in channels.items() if isinstance(channels, Mapping) else ():
            if isinstance(entry, Mapping) and "unit" in entry:
                found.setdefault(str(name), str(entry["unit"]))
    return found


def _refuse_folder(path: Path) -> dict[str, Any]:
    from mrpipe.campaigns.files import all_readers, ending_of

    known = all_readers()
    if any(ending_of(item) in known for item in path.iterdir() if item.is_file()):
        remedy = f"propose a campaign with `mrpipe init DIR --from {shell_word(path)}`"
        raise UserError(path, "", "holds data files, but no campaign.yaml", remedy)
    raise UserError(
        path, "", "is neither a campaign nor a run directory", "name a folder with campaign.yaml, or that of a run"
    )


def _describe_run(path: Path) -> dict[str, Any]:
    """Return the stages that ran in a run directory, with their outputs, warnings and times."""
    stages = []
    for file in sorted((path / "manifests").glob("[!.]*.json"), key=lambda item: item.stat().st_mtime):
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            stages.append(
                {
                    "stage": str(content["stage"]),
                    "seconds": float(content["seconds"]),
                    "skipped": str(content["skipped"]),
                    "warnings": len(content["warnings"]),
                    "outputs": [name for name in content["outputs"] if name.endswith((".h5", ".json", ".yaml", ".md"))],
                }
            )
        except (ValueError, KeyError, TypeError):
            stages.append({"stage": file.stem, "seconds": 0.0, "skipped": "damaged", "warnings": 0, "outputs": []})
    reports = [name for name in ("report.html", "report.md") if (path / name).is_file()]
    return {"kind": "run", "directory": str(path), "stages": stages, "reports": reports}


def _describe_json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, OSError, RecursionError) as error:
        raise UserError(path, "", f"is not JSON that can be read ({error})", "name another file") from None
    columns = [value for value in content.values() if _is_column(value)] if isinstance(content, dict) else []
    if len(columns) >= 2 or (isinstance(content, list) and content and isinstance(content[0], dict)):
        return _describe_data(path)
    return {"kind": "json", "file": str(path), "content": content}


def _is_column(value: Any) -> bool:
    return isinstance(value, list) and len(value) > 20 and isinstance(value[0], int | float)


def _describe_data(path: Path) -> dict[str, Any]:
    """Return the columns of a file of measurements and what their headers say."""
    import numpy as np

    from mrpipe.campaigns.proposal.columns import open_columns
    from mrpipe.campaigns.proposal.unreadable import why_no_columns

    file, columns = open_columns(path)
    if not columns:
        why = why_no_columns(file)
        few = why if why.startswith("has ") else "holds no column of numbers"
        raise UserError(path, "", few, "name a file of measurements")
    rows = [
        {
            "name": item.name,
            "quantity": item.header.quantity or item.header.unit_quantity,
            "unit": item.header.unit,
            "samples": int(item.values.size),
            "missing": int(np.isnan(item.values).sum()),
            "minimum": float(np.nanmin(item.values)),
            "maximum": float(np.nanmax(item.values)),
        }
        for item in columns
    ]
    hint = f"mrpipe init DIR --from {shell_word(path.resolve().parent)}"
    return {"kind": "data", "file": str(path), "columns": rows, "next": hint}


def print_any(description: Mapping[str, Any]) -> None:
    """Print what :func:`describe_any` returned."""
    printers = {
        "campaign": _print_campaign,
        "artifact": _print_artifact,
        "run": _print_run,
        "json": _print_json_result,
        "data": _print_data,
    }
    printers[str(description["kind"])](description)


def print_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table with aligned columns; numbers are aligned to the right."""
    table = [list(header), *([*row] for row in rows[:MOST_ROWS])]
    widths = [max(len(row[index]) for row in table) for index in range(len(header))]
    right = [all(_numeric(row[index]) for row in table[1:]) for index in range(len(header))]
    for position, row in enumerate(table):
        cells = [
            cell.rjust(width) if to_right else cell.ljust(width)
            for cell, width, to_right in zip(row, widths, right, strict=True)
        ]
        print("  " + "  ".join(cells).rstrip())
        if position == 0:
            print("  " + "  ".join("-" * width for width in widths))
    if len(rows) > MOST_ROWS:
        print(f"  ... {len(rows) - MOST_ROWS} more (--json lists all)")


def _numeric(text: str) -> bool:
    return text in ("", "-") or text.replace(".", "").replace("-", "").replace("e", "").replace("+", "").isdigit()


def _figure(value: float) -> str:
    text = f"{value:.4g}"
    return "0" if text in ("-0", "0") else text


def _print_campaign(description: Mapping[str, Any]) -> None:
    from mrpipe.units import conversion
    from mrpipe.words import noun

    tests = description["tests"]
    counts = ", ".join(f"{count} {role}" for role, count in description["roles"].items() if count)
    size = f"{len(tests)} {noun(len(tests), 'test')} ({counts}), {_figure(description['duration_s'])} s"
    print(f"campaign {description['campaign']}: {description['rig']}, {size}")
    if description["declared_effects"]:
        print(f"declared effects: {', '.join(description['declared_effects'])}")
    if "floor_masses_kg" in description:
        print(f"floor masses: {', '.join(_figure(mass) for mass in description['floor_masses_kg'])} kg")
    names = list(dict.fromkeys(name for test in tests for name in test["channels"]))
    shown = names[:MOST_CHANNELS]
    si = {name: next(t["channels"][name]["unit"] for t in tests if name in t["channels"]) for name in shown}
    units = {name: description["units"].get(name, si[name]) for name in shown}
    kinds = any(test.get("kind") for test in tests)
    counted = _findings_by_test(description)
    largest = {
        name: max(
            max(abs(t["channels"][name][key]) for key in ("minimum", "maximum")) for t in tests if name in t["channels"]
        )
        for name in shown
    }
    rows = []
    for test in tests:
        row = [test["name"], _kind_and_role(test) if kinds else test["role"]]
        row += [_figure(test["sampling_rate_hz"]), _figure(test["duration_s"])]
        for name in shown:
            channel = test["channels"].get(name)
            row.append("-" if channel is None else _range(channel, conversion(units[name]), name, largest[name]))
        rows.append([*row, ", ".join(counted.get(test["name"], [])) or "-"])
    header = [
        "test",
        "kind" if kinds else "role",
        "Hz",
        "s",
        *(f"{name} [{units[name]}]" for name in shown),
        "findings",
    ]
    print_table([_short_header(item) for item in header], rows)
    if len(names) > len(shown):
        print(f"  further channels: {', '.join(names[MOST_CHANNELS:])}")
    print("  (largest magnitude of each channel; a drive that changes is shown as its range)")
    for finding in description.get("plausibility") or []:
        print(f"{finding['severity']}: {_line(finding)}")
    judged = {_line(finding) for finding in description.get("plausibility") or []}
    for line in description.get("findings") or []:
        if line not in judged:
            print(f"note: {line}")
    if "plot" in description:
        print(f"plot: {description['plot']}")


def _kind_and_role(test: Mapping[str, Any]) -> str:
    kind = str(test.get("kind") or "-")
    return kind if test["role"] == "training" else f"{kind}, {test['role']}"


def _short_header(text: str) -> str:
    for word, short in (("floor_acceleration_", "a"), ("floor_displacement_", "x"), ("ground_acceleration", "ground")):
        text = text.replace(word, short)
    return text


def _line(finding: Mapping[str, Any]) -> str:
    parts = [f"test {finding['test']}" if finding["test"] else "", finding["channel"] or ""]
    place = ", ".join(part for part in parts if part)
    text = f"{finding['sentence']}; {finding['remedy']}"
    return f"{place}: {text}" if place else text


def _findings_by_test(description: Mapping[str, Any]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for item in description.get("plausibility") or []:
        if item["test"]:
            found.setdefault(item["test"], []).append(item["name"])
    judged = {_line(item) for item in description.get("plausibility") or []}
    for line in description.get("findings") or []:
        name = line.removeprefix("test ").partition(": ")[0]
        if line.startswith("test ") and line not in judged:
            found.setdefault(name, []).append("note")
    return found


def _range(channel: Mapping[str, Any], factor: float, name: str, largest: float) -> str:
    """Return the largest magnitude of a channel; of a drive its level, or its range where it changes."""
    low, high = channel["minimum"], channel["maximum"]
    if "drive" not in name:
        return _figure(max(abs(low), abs(high)) / factor)
    if high - low > 0.05 * largest:
        return f"{_figure(low / factor)} to {_figure(high / factor)}"
    level = 0.5 * (low + high)
    return _figure((level if abs(level) > 0.005 * largest else 0.0) / factor)


def _print_artifact(description: Mapping[str, Any]) -> None:
    for key, value in description.items():
        if key not in {"datasets", "kind"}:
            print(f"{key}: {value}")
    rows = []
    for row in description["datasets"]:
        shape = " x ".join(str(size) for size in row["shape"]) or "scalar"
        low, high = ("", "")
        if "minimum" in row:
            low, high = _figure(row["minimum"]), _figure(row["maximum"])
        rows.append([row["name"], shape, row["unit"] or "-", low, "" if low == high else high])
    print_table(["dataset", "shape", "unit", "minimum or value", "maximum"], rows)


def _print_run(description: Mapping[str, Any]) -> None:
    print(f"run directory {description['directory']}")
    rows = [
        [
            item["stage"],
            _figure(round(item["seconds"], 1)),
            str(item["warnings"]),
            f"skipped: {item['skipped']}" if item["skipped"] else ", ".join(item["outputs"]) or "-",
        ]
        for item in description["stages"]
    ]
    print_table(["stage", "s", "warnings", "outputs"], rows)
    for name in description["reports"]:
        print(f"report: {description['directory']}/{name}")
    print(f"next: mrpipe status {shell_word(description['directory'])}")


def _print_json_result(description: Mapping[str, Any]) -> None:
    from mrpipe.cli.output import print_summary

    content = description["content"]
    print_summary(description["file"], content if isinstance(content, dict) else {"content": content})


def _print_data(description: Mapping[str, Any]) -> None:
    print(f"data file {description['file']}: {description['columns'][0]['samples']} samples")
    gaps = any(row["missing"] for row in description["columns"])
    rows = [
        [row["name"], row["quantity"] or "?", row["unit"] or "?", _figure(row["minimum"]), _figure(row["maximum"])]
        + ([str(row["missing"])] if gaps else [])
        for row in description["columns"]
    ]
    print_table(["column", "quantity", "unit", "minimum", "maximum", *(["missing samples"] if gaps else [])], rows)
    print(f"next: propose a campaign with `{description['next']}`")
