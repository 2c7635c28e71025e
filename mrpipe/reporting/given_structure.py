"""Section of the report: a structure that the configuration gives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.reporting import modal as figures
from mrpipe.reporting.sink import Sink
from mrpipe.structures import Frame
from mrpipe.words import in_percent

_LARGEST_TABLE = 12


def describe(sink: Sink, frame: Frame, summary: Mapping[str, Any]) -> None:
    """Write the section on a structure whose matrices are given."""
    sink.text(f"The structure has {frame.floors} degrees of freedom. It was given, not identified.")
    if summary["full_degrees_of_freedom"] != frame.floors:
        sink.text(
            f"It was reduced from {summary['full_degrees_of_freedom']} degrees of freedom. The largest error of the "
            f"response to ground motion up to {summary['reduction_band_high_hz']:.3g} Hz is "
            f"{in_percent(summary['reduction_error'], digits=3)} of the largest response."
        )
    rows = {
        "mode": summary["mode_numbers"],
        "frequency [Hz]": summary["frequencies_hz"],
        "damping ratio": summary["damping_ratios"],
        "MAC with the full structure": summary["mac"],
    }
    sink.table("modes", pd.DataFrame(rows), "Modes.")
    if frame.floors > _LARGEST_TABLE:
        return
    figures.matrix_tables(sink, frame)
    names, shapes = summary["degrees_of_freedom"], np.asarray(summary["mode_shapes"])
    sink.figure(
        "mode-shapes",
        figures.mode_shapes(shapes, summary["frequencies_hz"], summary["heights_m"], names),
        figures.shapes_caption(names),
    )
