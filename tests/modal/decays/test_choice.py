"""Choice of the damping ratio of each mode."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.modal.decays.choice import choose_damping
from mrpipe.modal.decays.decay import DecayResult, Estimate


@pytest.mark.property
def test_a_damping_ratio_that_the_records_hardly_determine_is_stated() -> None:
    sweep = (Estimate.of(0.01, 0.0002), Estimate.of(0.01, 0.001))
    chosen, sources, findings = choose_damping(sweep, {}, "sweep", "sweep")
    assert chosen == sweep and sources == ("sweep", "sweep")
    assert len(findings) == 1
    assert findings[0].startswith("mode 2: ") and "+-20 %" in findings[0]


@pytest.mark.property
@pytest.mark.parametrize("other", ["sweep", "ambient"])
def test_a_contradiction_names_the_tests_of_the_fit(other: str) -> None:
    """Where no sweep was recorded, the message had named one."""
    own, none = Estimate.of(0.001, 0.0001), np.zeros(0)
    decay = DecayResult("decay", 1, own, own, own, 8.0, none, none, none, none, none, none, filtered=False)
    findings = choose_damping((Estimate.of(0.012, 0.0002),), {1: decay}, "decay", other)[2]
    assert f"mode 1: damping is 0.001 by decay, 0.012 by {other}" in findings
