"""Blind campaigns for tests and benchmarks: a rig drawn from a seed, with undeclared effects and a sealed truth."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from mrpipe.campaigns import write_campaign
from mrpipe.errors import UserError
from mrpipe.laboratory.bench import CHANNELS, BenchRecord, record_bench
from mrpipe.laboratory.damper import damper_from_set, draw_damper
from mrpipe.laboratory.effects import EFFECT_NAMES, Planted, draw_hidden_effect
from mrpipe.laboratory.motion import BenchTest
from mrpipe.laboratory.options import BenchRig
from mrpipe.laboratory.plans import tests_of
from mrpipe.laboratory.sealing import campaign_directory, write_sealed

_DRAWS = 12


def write_bench(
    final: Path, record: BenchRecord, rig: BenchRig, *, plan: str = "", data_format: Literal["h5", "csv"] = "h5"
) -> Path:
    """Write a recorded bench campaign atomically, with its sealed truth next to it, and return its directory."""
    declared = [item.name for item in record.damper.effects if item.declared]
    with campaign_directory(final) as folder:
        write_campaign(
            folder,
            campaign="virtual-bench",
            rig="damper-bench",
            sampling_rate_hz=rig.sampling_rate_hz,
            channels=CHANNELS,
            tests=record.tests,
            extra={"declared_effects": declared, "about": {"plan": plan}},
            data_format=data_format,
        )
        write_sealed(final, record.truth)
    return final


def record_blind(
    final: Path,
    seed: int,
    *,
    names: Sequence[str] = EFFECT_NAMES,
    share: float | tuple[float, float] = 0.05,
    count: int = 1,
    plan: str = "compact",
    tests: Sequence[BenchTest] | None = None,
    rig: BenchRig | None = None,
    vary: float = 0.1,
    damper: str = "set-c",
    declared: Sequence[Planted] = (),
) -> Path:
    """Record a bench campaign with `count` undeclared effects drawn from a seed.

    Parameters
    ----------
    final
        Directory of the campaign; the truth goes to `<final>.truth/sealed.json`.
    seed
        Seed of all random numbers.
    names
        Effects to draw from (`unfamiliar` for shapes of no family), without repetition.
    share
        Ratio of the RMS of each effect to the RMS of the force; a pair is a range.
    count
        Number of effects; 0: a rig without effects.
    plan, tests
        Name of a plan, and list of tests that replaces it.
    rig
        Machine and sensors.
    vary
        Log-normal spread of the parameters of the damper around its parameter set.
    damper
        The true damper.
    declared
        Effects that campaign.yaml names.

    Raises
    ------
    UserError
        If no drawn effect can have the share on these tests.
    """
    rng = np.random.default_rng([seed, 977])
    rig = rig or BenchRig()
    orders = list(tests) if tests is not None else tests_of(plan)
    base = draw_damper(rng, damper_from_set(damper), vary) if vary > 0.0 else damper_from_set(damper)
    problem: UserError | None = None
    for _ in range(_DRAWS):
        planted = _draw(rng, tuple(names), share, count)
        try:
            record = record_bench(base.with_effects([*declared, *planted]), orders, rig, rng)
        except UserError as error:
            # this draw's own numbers do not reach the share on these tests
            problem = error
            continue
        return write_bench(final, record, rig, plan=plan if tests is None else "listed")
    assert problem is not None
    raise problem


def _draw(
    rng: np.random.Generator, names: tuple[str, ...], share: float | tuple[float, float], count: int
) -> list[Planted]:
    planted: list[Planted] = []
    for _ in range(count):
        left = tuple(name for name in names if name not in [item.name for item in planted])
        planted.append(draw_hidden_effect(rng, left, share))
    return planted
