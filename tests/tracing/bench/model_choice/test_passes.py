"""Progress of a search that is repeated."""

from __future__ import annotations

import pytest

from mrpipe.tracing.bench.model_choice.passes import LAST_STEP, in_passes

pytestmark = pytest.mark.property


def test_progress_never_goes_back_and_numbers_the_passes() -> None:
    seen: list[tuple[float, str]] = []
    report = in_passes(lambda share, text="": seen.append((share, text)))
    for _ in range(4):
        for fraction, text in ((0.1, "base forms"), (0.25, "effects"), (0.7, "fit")):
            report(fraction, text)
    shares = [share for share, _ in seen]
    assert shares == sorted(shares) and shares[0] > 0.0 and shares[-1] < LAST_STEP
    assert [text for _, text in seen][:4] == ["base forms", "effects", "fit", "base forms (pass 2)"]
    assert seen[-1][1] == "fit (pass 4)"
