"""The layout that `mrpipe init` makes for a rig of one's own."""

from __future__ import annotations

from pathlib import Path

from mrpipe.artifacts import atomic_write_text
from mrpipe.errors import UserError

_CAMPAIGN = """\
# A measured campaign of a damper on a test bench. Fill in and put the files beside this one.
campaign: my-rig
rig: damper-bench                 # damper-bench | shear-frame
sampling_rate_hz: 1000            # may be left out where a time channel tells
channels:                         # quantity -> where it is in the files, and its unit
  time:         {column: t, unit: s}
  displacement: {column: x, unit: mm}
  # acceleration: {column: a, unit: m/s^2}        # optional
  drive:        {column: i, unit: A}              # coil current in A, or the voltage in V
  force:        {column: F, unit: N}
tests:                            # .csv, .mat, .h5, .json or .uff
  - {name: train-1Hz, file: train-1Hz.csv, role: training}
  - {name: valid-1Hz, file: valid-1Hz.csv, role: validation}
"""
_CONFIG = """\
# Every setting that is not named here has its default: `mrpipe check --explain` lists them all.
name: my-rig
description: Damper of our own, measured on our bench.
stages: [prepare, assemble, sweep, train-forward, train-inverse, identify-damper, close-loop, report]
campaigns:
  bench: ../data/my-rig
  frame: null
  closed_loop: null
"""
_README = """\
# A damper project
data/my-rig/campaign.yaml tells mrpipe what was measured, configs/my-rig.yaml
what to do with it; runs/ holds the results.

    mrpipe check configs/my-rig.yaml
    mrpipe show data/my-rig
    mrpipe run configs/my-rig.yaml
"""


def lay_out(directory: Path) -> list[Path]:
    """Write the layout; existing files are left alone.

    Raises
    ------
    UserError
        If the directory is a file, or holds such a project already.
    """
    files = {
        "README.md": _README,
        "configs/my-rig.yaml": _CONFIG,
        "data/my-rig/campaign.yaml": _CAMPAIGN,
        "runs/README.md": "Run directories: one a configuration, made by mrpipe.\n",
    }
    if directory.exists() and not directory.is_dir():
        raise UserError(directory, "", "is a file", "give a directory")
    there = [name for name in files if (directory / name).exists()]
    if there:
        raise UserError(directory, there[0], "exists already", "give an empty or new directory")
    for name, text in files.items():
        atomic_write_text(directory / name, text)
    return [directory / name for name in files]
