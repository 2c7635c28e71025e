"""Choice of the damping ratio of each mode."""

from __future__ import annotations

import pytest

from mrpipe.modal.decays.choice import choose_damping
from mrpipe.modal.decays.decay import Estimate


@pytest.mark.property
def test_a_damping_ratio_that_the_records_hardly_determine_is_stated() -> None:
    sweep = (Estimate.of(0.01, 0.0002), Estimate.of(0.01, 0.001))
    chosen, sources, findings = choose_damping(sweep, {}, "sweep", "sweep")
    assert chosen == sweep and sources == ("sweep", "sweep")
    assert len(findings) == 1
    assert findings[0].startswith("mode 2: ") and "+-20 %" in findings[0]
