"""The project that `mrpipe init` creates: configuration, campaigns to complete or proposed from files, and a README."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mrpipe.artifacts import atomic_write_text
from mrpipe.errors import UserError

if TYPE_CHECKING:
    from mrpipe.campaigns.proposal import Proposal
    from mrpipe.campaigns.proposal.propose import Rig

_BENCH = """\
# A measured campaign of a damper on a test bench. Complete it and put the files into this folder.
campaign: {name}
rig: damper-bench
sampling_rate_hz: 1000            # not needed where a time channel gives the clock
channels:                         # quantity -> column in the files, and its unit
  time:         {{column: t, unit: s}}
  displacement: {{column: x, unit: mm}}
  # acceleration: {{column: a, unit: m/s^2}}        # optional
  drive:        {{column: i, unit: A}}              # coil current in A, or the voltage in V
  force:        {{column: F, unit: N}}
tests:                            # formats: see docs/campaigns.md
  - {{name: train-1Hz, file: train-1Hz.csv, role: training}}
  - {{name: valid-1Hz, file: valid-1Hz.csv, role: validation}}
"""
_FRAME = """\
# A measured campaign of a structure. Complete it and put the files into this folder.
campaign: {name}
rig: shear-frame
sampling_rate_hz: 200             # not needed where a time channel gives the clock
# frame: {{floor_masses_kg: [6.0, 6.0, 6.0]}}   # masses of the floors, lowest first, where they are known
channels:                         # quantity -> column in the files, and its unit
  time:                 {{column: t, unit: s}}
  ground_acceleration:  {{column: ag, unit: m/s^2}}
  floor_acceleration_1: {{column: a1, unit: m/s^2}}   # absolute, as accelerometers measure
  floor_acceleration_2: {{column: a2, unit: m/s^2}}
  floor_acceleration_3: {{column: a3, unit: m/s^2}}
tests:                            # kind: sweep, free-decay, random or closed-loop
  - {{name: sweep-1, file: sweep-1.csv, kind: sweep}}
  - {{name: decay-1, file: decay-1.csv, kind: free-decay, mode: 1}}
"""
STAGES = {
    "bench": "[prepare, assemble, sweep, train-forward, train-inverse, identify-damper, close-loop, report]",
    "frame": "[identify-frame, close-loop, report]",
    "both": (
        "[prepare, assemble, sweep, train-forward, train-inverse, identify-damper, identify-frame, calibrate,\n"
        "  simulate-passive-off, simulate-passive-on, simulate-vd, simulate-fdns, close-loop, report]"
    ),
}
"""Rig -> stages of the configuration."""

_WHAT = {
    "bench": "Damper measured on a test bench.",
    "frame": "Structure measured with sweeps, free decays or random excitation.",
    "both": "Damper measured on a test bench, and the structure that it is to protect.",
}
_CONFIG = """\
# Every setting that is not named here has its default: `mrpipe check --explain` lists them all.
name: {name}
description: {what}
{note}stages: {stages}
campaigns:
  bench: {bench}
  frame: {frame}
  closed_loop: {closed_loop}
"""
_ONE_DRIVE = (
    "# train-inverse is left out, because the training tests have one drive only; it needs tests at two or more.\n"
)
_README = """\
# {name}
{campaigns} what was measured, `configs/{name}.yaml` what mrpipe does with
it, and `runs/` will hold the results.

    mrpipe check configs/{name}.yaml
    mrpipe show {first}
    mrpipe run configs/{name}.yaml
"""


@dataclass(frozen=True)
class Project:
    """A project on disk: its name, the files written, the campaigns (folders within the project) and proposals."""

    name: str
    written: tuple[Path, ...]
    campaigns: tuple[str, ...]
    proposals: tuple[Proposal, ...] = ()


def lay_out(directory: Path, rig: Rig | None = None, source: Path | None = None) -> Project:
    """Write a project; existing files are left alone.

    Parameters
    ----------
    directory
        Made if missing; its name becomes that of the project.
    rig
        Rig of the campaigns; the default is a bench, or with `source` what its files hold.
    source
        Folder of measured files from which campaigns are proposed; None writes campaigns to complete.

    Raises
    ------
    UserError
        If the directory is a file or holds such a project already, or `source` holds nothing that can be read.
    """
    from mrpipe.campaigns.model import CAMPAIGN_FILE

    if directory.exists() and not directory.is_dir():
        raise UserError(directory, "", "is a file", "give a directory")
    name = slug(directory.resolve().name) or "my-rig"
    proposals: list[Proposal] = []
    if source is None:
        kinds = [rig] if rig in ("bench", "frame") else ["bench", "frame"] if rig == "both" else ["bench"]
        names = [name] if len(kinds) == 1 else [f"{name}-{kind}" for kind in kinds]
        templates = {"bench": _BENCH, "frame": _FRAME}
        texts = [templates[str(kind)].format(name=item) for kind, item in zip(kinds, names, strict=True)]
    else:
        proposals = _proposals(source, directory, rig)
        kinds = [item.rig for item in proposals]
        base = slug(source.resolve().name) or name
        names = [base] if len(kinds) == 1 else [f"{base}-{kind}" for kind in kinds]
        texts = [item.text for item in proposals]
    folders = dict(zip([str(kind) for kind in kinds], names, strict=True))
    files = {
        "README.md": _readme(name, names),
        f"configs/{name}.yaml": _config(name, folders, proposals),
        **{f"data/{item}/{CAMPAIGN_FILE}": text for item, text in zip(names, texts, strict=True)},
        "runs/README.md": "Run directories, one for each configuration; mrpipe writes them.\n",
    }
    there = [item for item in files if (directory / item).exists()]
    if there:
        raise UserError(directory, there[0], "exists already", "give an empty or new directory")
    for item, text in files.items():
        atomic_write_text(directory / item, text)
    written = tuple(directory / item for item in files)
    return Project(name, written, tuple(f"data/{item}" for item in names), tuple(proposals))


def _proposals(source: Path, directory: Path, rig: Rig | None) -> list[Proposal]:
    from mrpipe.campaigns.proposal import propose_campaigns

    if not source.is_dir():
        raise UserError("--from", str(source), "is not a folder", "name the folder that holds the measured files")
    name = slug(source.resolve().name) or "campaign"
    # all campaigns lie equally deep, so the way back to the files is the same
    return propose_campaigns(source, name, rig, directory / "data" / name)


def slug(text: str) -> str:
    """Return a name for files and keys: letters, digits, dots, dashes and underscores."""
    return re.sub(r"[^\w.-]+", "-", text).strip("-._")[:60]


def _readme(name: str, campaigns: Sequence[str]) -> str:
    from mrpipe.campaigns.model import CAMPAIGN_FILE
    from mrpipe.words import listed

    files = [f"`data/{item}/{CAMPAIGN_FILE}`" for item in campaigns]
    says = f"{listed(files)} {'says' if len(campaigns) == 1 else 'say'}"
    return _README.format(name=name, campaigns=says, first=f"data/{campaigns[0]}")


def _config(name: str, folders: dict[str, str], proposals: Sequence[Proposal]) -> str:
    kind = "both" if len(folders) > 1 else next(iter(folders))
    frame = f"../data/{folders['frame']}" if "frame" in folders else "null"
    stages, note = STAGES[kind], ""
    if kind == "bench" and proposals and not proposals[0].drive_varies:
        stages, note = stages.replace("train-inverse, ", ""), _ONE_DRIVE
    closed_loop = any(role == "closed-loop" for item in proposals for _, role in item.tests)
    return _CONFIG.format(
        name=name,
        what=_WHAT[kind],
        stages=stages,
        note=note,
        bench=f"../data/{folders['bench']}" if "bench" in folders else "null",
        frame=frame,
        closed_loop=frame if closed_loop else "null",
    )
