"""Compile exported C code and run its self test."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

STRICT = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")


def compiler() -> str:
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None:
        pytest.skip("no C compiler here")
    return found


def self_test(folder: Path, name: str, macro: str) -> None:
    """Build an export in both precisions; each build must agree with the test vectors of the folder."""
    for number, flags in enumerate(((), (f"-D{macro}_SINGLE", "-Wdouble-promotion"))):
        command = [compiler(), *STRICT, *flags, f"{name}.c", "self_test.c", "-o", f"test{number}", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        done = subprocess.run([str(folder / f"test{number}")], capture_output=True, text=True)
        assert done.returncode == 0, f"{folder.name}, {flags}: {done.stdout}"
