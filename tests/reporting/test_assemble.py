"""What the report says of the joins is true for periodic and for random tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.networks.assembly import CHANNELS, join
from mrpipe.reporting.assemble import TrainingSet, describe
from mrpipe.reporting.writer import Section
from tests.networks.rig import bench_test

pytestmark = pytest.mark.property


def test_steps_at_the_ends_of_random_tests_are_said() -> None:
    periodic = [bench_test(name, frequency, 1.0, cycles=4) for name, frequency in (("a", 1.0), ("b", 2.0))]
    shifted = replace(periodic[0], name="c", displacement_m=periodic[0].displacement_m + 0.004, excitation="random")
    for tests, continuous in ((periodic, True), ([*periodic, shifted], False)):
        history = join(tests, cycles=3, sampling_rate_hz=200.0)
        jumps = {name: history.largest_jump(name) for name in CHANNELS}
        section = Section("assemble", "assemble")
        describe(section, TrainingSet(history, history, jumps))
        captions = [item["caption"] for item in section.items if item["kind"] == "table"]
        assert ("The displacement is continuous. " in captions[0]) is continuous
        assert ("it has steps where a test with another motion" in captions[0]) is not continuous
        assert "tests with another motion are used completely" in section.items[0]["text"]
    assert np.isfinite(list(jumps.values())).all()
