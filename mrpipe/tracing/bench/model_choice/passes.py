"""Progress of a search that is repeated an unknown number of times, with other filters, rates or weights."""

from __future__ import annotations

from mrpipe.artifacts import Progress

LAST_STEP = 0.85
"""Numerical technique: share that is reached when no further pass follows."""


def in_passes(progress: Progress) -> Progress:
    """Return a progress that never goes back: each pass takes half of the share that remains up to the last step.

    Parameters
    ----------
    progress
        Called with the share of the work that is done (0 to 1) and a text, which gives the number of the pass from the
        second one on.
    """
    number, last = 1, 0.0

    def report(fraction: float, text: str = "") -> None:
        nonlocal number, last
        if fraction < last:
            number += 1
        last = fraction
        begin = LAST_STEP * (1.0 - 0.5 ** (number - 1))
        share = begin + (LAST_STEP - begin) * 0.5 * min(fraction / LAST_STEP, 1.0)
        progress(share, text if number == 1 else f"{text} (pass {number})")

    return report
