"""All claims of the requested chapters."""

from __future__ import annotations

from mrpipe.artifacts import Progress, no_progress
from mrpipe.structures import frame_from_parameter_set
from mrpipe.thesis.chapter2 import chapter_2
from mrpipe.thesis.chapter3 import chapter_3
from mrpipe.thesis.chapter4 import chapter_4
from mrpipe.thesis.chapter5 import chapter_5
from mrpipe.thesis.chapter6 import chapter_6
from mrpipe.thesis.claim import Claim
from mrpipe.thesis.options import ReproduceSettings


def collect_claims(options: ReproduceSettings, progress: Progress = no_progress) -> list[Claim]:
    """Return the claims in the order of the chapters.

    Raises
    ------
    UserError
        If the frame's parameter set is not there.
    """
    frame = frame_from_parameter_set(options.frame)
    claims: list[Claim] = []
    for chapter in sorted(set(options.chapters)):
        progress(0.1 * chapter, f"chapter {chapter}")
        if chapter == 2:
            claims += chapter_2()
        elif chapter == 3:
            claims += chapter_3(frame)
        elif chapter == 4:
            claims += chapter_4(frame)
        elif chapter == 5:
            claims += chapter_5(frame, options.duration_s, progress)
        elif chapter == 6:
            claims += chapter_6(frame)
    return claims
