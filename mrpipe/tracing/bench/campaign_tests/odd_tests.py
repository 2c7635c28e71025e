"""Tests that contradict the others or contain a fault; they are named before anything is fitted, and left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrpipe.campaigns.plausibility import Finding, TestArrays, compare_tests
from mrpipe.errors import UserError
from mrpipe.signals.prepared import PreparedTest
from mrpipe.tracing.rules import ValidationRules

SAME_RECORD = "same-record"
"""Name of the finding for tests with the same samples: the second one is not independent."""

DEAD_CHANNEL = "dead-channel"
"""Name of the finding for a channel with the same value in all samples of a test."""


@dataclass(frozen=True)
class SortedTests:
    """The tests of a campaign after the comparison of the tests with each other.

    Attributes
    ----------
    tests
        Tests that are used: without faulty training tests, and without validation tests that repeat another record.
    findings
        Findings of the comparison.
    left_out
        Names of the tests that are not used.
    """

    tests: tuple[PreparedTest, ...]
    findings: tuple[Finding, ...]
    left_out: tuple[str, ...]

    @property
    def faults(self) -> dict[str, Finding]:
        """Return name -> first finding, for validation tests that are used in spite of a finding."""
        used = {test.name for test in self.tests if test.role == "validation"}
        found: dict[str, Finding] = {}
        for item in self.findings:
            if item.test in used:
                found.setdefault(item.test, item)
        return found

    @property
    def sentence(self) -> str:
        """Say which tests are left out and why; empty if none is."""
        reasons = {item.test: item.sentence for item in reversed(self.findings)}
        return "; ".join(f"test {name} is left out: {reasons[name]}" for name in self.left_out)

    def as_json(self) -> list[dict[str, Any]]:
        """Return the findings as JSON."""
        return [{**item.as_dict(), "left_out": item.test in self.left_out} for item in self.findings]


def sort_tests(tests: Sequence[PreparedTest], rules: ValidationRules | None = None) -> SortedTests:
    """Compare the tests with each other, and leave faulty ones out of the fit.

    A faulty validation test is kept: its error is reported, and the verdict names it. A validation test with the
    samples of another test is left out, because the fit may have used these samples.

    Raises
    ------
    UserError
        If a channel has a constant value in every test.
    """
    fewest_training = (rules or ValidationRules()).fewest_training
    findings = compare_tests([_arrays(test) for test in tests])
    _not_all_dead(tests, findings)
    named = {item.test: item for item in reversed(findings) if item.test}
    out = [
        test.name
        for test in tests
        if test.name in named and (test.role != "validation" or named[test.name].name == SAME_RECORD)
    ]
    kept = [test for test in tests if test.name not in out]
    for validation, fewest in ((False, fewest_training), (True, 1)):
        if sum((test.role == "validation") == validation for test in kept) < fewest:
            out = [
                name for name in out if any(t.name == name and (t.role == "validation") != validation for t in tests)
            ]
            kept = [test for test in tests if test.name not in out]
    return SortedTests(tuple(kept), findings, tuple(out))


def _not_all_dead(tests: Sequence[PreparedTest], findings: Sequence[Finding]) -> None:
    for channel in ("displacement", "force"):
        dead = {item.test for item in findings if item.name == DEAD_CHANNEL and item.channel == channel}
        if all(test.name in dead for test in tests):
            raise UserError(
                "campaign",
                f"channels.{channel}",
                f"has the same value in all samples of each of the {len(tests)} tests",
                "check the sensor, its cable and the column that campaign.yaml names",
            )


def _arrays(test: PreparedTest) -> TestArrays:
    return TestArrays(
        name=test.name,
        time_s=np.asarray(test.time_s),
        displacement_m=test.displacement_raw_m + test.displacement_offset_m,
        drive=test.drive,
        force_n=test.force_raw_n + test.force_offset_n,
        role=test.role,
    )
