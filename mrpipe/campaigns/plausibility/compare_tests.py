"""Comparison of the tests of a damper bench campaign with each other."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from mrpipe.campaigns.plausibility.channels import find_spikes, is_dead
from mrpipe.campaigns.plausibility.duplicates import find_overlaps
from mrpipe.campaigns.plausibility.finding import Finding, TestArrays
from mrpipe.campaigns.plausibility.odd_tests import find_odd_tests
from mrpipe.campaigns.plausibility.stuck import find_stuck_displacement, find_stuck_force
from mrpipe.campaigns.plausibility.whole_campaign import find_exchanged_columns, find_unrelated_force
from mrpipe.words import in_percent


def compare_tests(tests: Sequence[TestArrays]) -> tuple[Finding, ...]:
    """Return all findings by which a test contradicts the others or is faulty itself.

    The findings are named `dead-channel`, `stuck-channel`, `spikes`, `same-record`, `sign-reversed`, `unit-decades`,
    `at-rest`, `channels-exchanged`, `force-unrelated`, `gain-differs` and `delay-differs`. Tests with a dead
    channel, a stuck channel or spikes are left out of the comparison of forces, because their fault is known already.

    Parameters
    ----------
    tests
        Tests of one damper in SI; the drive of all of them in the same unit.

    Raises
    ------
    ValueError
        If the channels of a test differ in length.
    """
    for test in tests:
        sizes = {test.time_s.size, test.displacement_m.size, test.drive.size, test.force_n.size}
        if len(sizes) != 1:
            raise ValueError(f"test {test.name}: channels differ in length")
    single = {test.name: list(chain(_dead(test), _stuck(test), _spikes(test))) for test in tests}
    sound = [test for test in tests if not any(item.severity == "error" for item in single[test.name])]
    found = [item for items in single.values() for item in items]
    found += same_records(tests)
    unrelated = find_unrelated_force(sound)
    if unrelated:
        return (*found, *unrelated)
    return (*found, *find_odd_tests(sound), *find_exchanged_columns(sound))


def _channels(test: TestArrays) -> dict[str, np.ndarray]:
    return {"displacement": test.displacement_m, "force": test.force_n}


def _dead(test: TestArrays) -> list[Finding]:
    return [
        Finding(
            name="dead-channel",
            severity="error",
            test=test.name,
            channel=name,
            sentence=f"has the same value in all {values.size} samples ({values[0]:.4g} in SI)",
            remedy="check sensor, cable and column, or leave the test out",
            numbers={"value_si": float(values[0]), "samples": float(values.size)},
        )
        for name, values in _channels(test).items()
        if values.size and is_dead(values)
    ]


def _stuck(test: TestArrays) -> list[Finding]:
    findings = []
    for name, values in _channels(test).items():
        if name == "displacement":
            stuck = find_stuck_displacement(values, test.force_n)
        else:
            stuck = find_stuck_force(values, test.displacement_m, test.drive)
        if stuck is None:
            continue
        duration = stuck.samples / test.rate_hz
        begin = float(test.time_s[stuck.first] - test.time_s[0])
        findings.append(
            Finding(
                name="stuck-channel",
                severity="error",
                test=test.name,
                channel=name,
                sentence=f"repeats one value for {stuck.samples} samples ({duration:.3g} s) from {begin:.4g} s on "
                "while the rig moves",
                remedy="exclude these samples with segments_s, or leave the test out",
                numbers={"begin_s": begin, "duration_s": duration, "stretches": float(stuck.count)},
            )
        )
    return findings


def _spikes(test: TestArrays) -> list[Finding]:
    findings = []
    for name, values in _channels(test).items():
        spikes = find_spikes(values)
        if not spikes.size:
            continue
        largest = int(spikes[np.argmax(np.abs(values[spikes]))])
        alone = spikes.size == 1
        time = float(test.time_s[largest] - test.time_s[0])
        findings.append(
            Finding(
                name="spikes",
                severity="error",
                test=test.name,
                channel=name,
                sentence=f"has {'1 sample' if alone else f'{spikes.size} samples'} far from "
                f"{'its' if alone else 'their'} neighbours, the largest {values[largest]:.4g} (SI) at {time:.4g} s",
                remedy="correct these samples in the file, or cut them off with segments_s",
                numbers={"samples": float(spikes.size), "largest_si": float(values[largest]), "time_s": time},
            )
        )
    return findings


def same_records(tests: Sequence[TestArrays]) -> list[Finding]:
    """Return pairs of tests that hold the same samples; across training and validation this is an error."""
    roles = {test.name: test.role for test in tests}
    findings = []
    for overlap in find_overlaps([(test.name, _channels(test)) for test in tests]):
        pair = {roles[overlap.first], roles[overlap.second]}
        leak = "validation" in pair and len(pair) > 1
        consequence = (
            "the validation error would be that of samples the model was fitted to"
            if leak
            else "they would count as independent tests, and the noise would be underestimated"
        )
        findings.append(
            Finding(
                name="same-record",
                severity="error" if leak else "warning",
                test=overlap.second,
                sentence=(
                    f"holds {in_percent(overlap.share, digits=3)} of the samples of test {overlap.first} "
                    f"({consequence})"
                ),
                remedy="name another file or other segments_s, or remove one of the two tests",
                numbers={"share": overlap.share},
            )
        )
    return findings
