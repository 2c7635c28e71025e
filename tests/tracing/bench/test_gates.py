"""What is required before anything is traced."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mrpipe.tracing.bench.gates import never_yields
from mrpipe.tracing.rules import ValidationRules
from tests.tracing.bench.fits import plain_fit

pytestmark = pytest.mark.planted


def test_a_damper_that_stays_elastic_in_all_tests_is_recognised() -> None:
    found = plain_fit("")
    assert not never_yields(found, ValidationRules())
    recordings = found.problem.recordings
    small = replace(recordings, displacement=recordings.displacement / 500.0, velocity=recordings.velocity / 500.0)
    assert never_yields(replace(found, problem=replace(found.problem, recordings=small)), ValidationRules())
