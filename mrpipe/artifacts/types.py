"""Type aliases that the whole package shares."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


class Progress(Protocol):
    """Called with the progress of a long computation, so that domain code does not depend on a terminal."""

    def __call__(self, fraction: float, text: str = "") -> None:
        """Report `fraction` (0 to 1) done, with a short `text`."""


def no_progress(fraction: float, text: str = "") -> None:
    """Ignore the report: the default of every `progress` argument."""
