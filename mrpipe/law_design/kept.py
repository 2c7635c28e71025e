"""Results of laws under design, stored on disk so that an interrupted design continues where it ended."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mrpipe.artifacts import atomic_write_text
from mrpipe.control.gains import Gains
from mrpipe.law_design.objective import Evaluation
from mrpipe.law_design.search import FreeGain
from mrpipe.simulation.response_curve import ResponseCurve
from mrpipe.simulation.windows import QUANTITIES


@dataclass(frozen=True)
class LawUnderDesign:
    """A law with the gains that are searched.

    Attributes
    ----------
    law
        Name of the law.
    start
        Calibrated gains; the fixed ones keep their values.
    free
        Gains to search; none: the law is only evaluated.
    label
        Key of the result, such as `vdns` or `vdns (free stiffness)`.
    """

    law: str
    start: Gains
    free: tuple[FreeGain, ...]
    label: str


@dataclass(frozen=True)
class Designed:
    """Result of the study for one law.

    Attributes
    ----------
    entry
        The law under design.
    best, calibrated
        Evaluation at the best gains and at the calibrated ones, with accurate response curves.
    tried
        All gains that the search evaluated, with coarse response curves.
    """

    entry: LawUnderDesign
    best: Evaluation
    calibrated: Evaluation
    tried: tuple[Evaluation, ...]


@dataclass(frozen=True)
class Kept:
    """Results of laws in a folder.

    Attributes
    ----------
    folder
        One file per law; None: nothing is kept.
    problem
        Everything that the results depend on, as text: a result for another problem is not used.
    """

    folder: Path | None = None
    problem: str = ""

    def read(self, entry: LawUnderDesign) -> Designed | None:
        """Return what is kept for a law, or None."""
        path = self._path(entry)
        if path is None or not path.is_file():
            return None
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            best, calibrated = _evaluation(content["best"]), _evaluation(content["calibrated"])
            return Designed(entry, best, calibrated, tuple(_evaluation(item) for item in content["tried"]))
        except (ValueError, KeyError, TypeError, OSError):
            # a damaged file is computed again
            return None

    def write(self, found: Designed) -> None:
        """Keep the result of a law."""
        path = self._path(found.entry)
        if path is None:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        content = {
            "best": _as_plain(found.best),
            "calibrated": _as_plain(found.calibrated),
            "tried": [_as_plain(item) for item in found.tried],
        }
        atomic_write_text(path, json.dumps(content))

    def clear(self) -> None:
        """Remove all files, because the design is complete."""
        if self.folder is not None and self.folder.is_dir():
            for path in self.folder.glob("*.json"):
                path.unlink()
            self.folder.rmdir()

    def _path(self, entry: LawUnderDesign) -> Path | None:
        if self.folder is None:
            return None
        text = f"{self.problem}|{entry.label}|{sorted(entry.start.items())}|{entry.free}"
        return self.folder / f"{entry.law}-{hashlib.sha256(text.encode()).hexdigest()[:16]}.json"


def _as_plain(item: Evaluation) -> dict[str, Any]:
    return {
        "law": item.law,
        "gains": dict(item.gains),
        "value": item.value,
        "motions": {name: dict(values) for name, values in item.motions.items()},
        "curves": [
            {
                "base_amplitude_m_s2": curve.base_amplitude_m_s2,
                "frequency_rad_s": curve.frequency_rad_s.tolist(),
                "values": curve.values.tolist(),
                "errors": curve.errors.tolist(),
                "steady": curve.steady.tolist(),
            }
            for curve in item.curves
        ],
    }


def _evaluation(content: Mapping[str, Any]) -> Evaluation:
    curves = tuple(
        ResponseCurve(
            float(curve["base_amplitude_m_s2"]),
            np.array(curve["frequency_rad_s"], dtype=np.float64),
            np.array(curve["values"], dtype=np.float64),
            np.array(curve["errors"], dtype=np.float64),
            np.array(curve["steady"], dtype=np.bool_),
        )
        for curve in content["curves"]
    )
    if any(curve.values.shape != (len(curve.frequency_rad_s), len(QUANTITIES)) for curve in curves):
        raise ValueError("the result has other quantities")
    value = float(content["value"])
    if math.isnan(value):
        raise ValueError("the value of a design is not a number")
    return Evaluation(content["law"], Gains(**content["gains"]), curves, content["motions"], value)
