"""Offsets that differ between tests are found; a steady zero is not reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.verdict.offsets import offset_between_tests
from tests.tracing.bench.fits import fit_of, plain_fit
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted
EFFECT = damper_effects()["offset"]


def test_the_spread_of_shifted_zeros_comes_out() -> None:
    shifts = np.random.default_rng(4).normal(0.0, 6.0, 16)
    tests = [
        replace(test, force_n=test.force_n + shift, force_raw_n=test.force_raw_n + shift)
        for test, shift in zip(campaign(""), shifts, strict=False)
    ]
    found = offset_between_tests(fit_of(tests), EFFECT)
    assert found is not None
    training = [shift for test, shift in zip(tests, shifts, strict=False) if test.role != "validation"]
    assert found.spread_n == pytest.approx(float(np.std(training, ddof=1)), rel=0.1)
    assert found.as_named_effect().parameters["spread"].unit == "N"


def test_a_steady_zero_is_not_reported() -> None:
    assert offset_between_tests(plain_fit(""), EFFECT) is None
    assert offset_between_tests(plain_fit(""), None) is None
