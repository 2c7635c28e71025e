"""Which rig a seed stands for: base form x effect x noise x excitation, in a layout where all combinations come."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from benchmarks.rigs.bases import BASES
from benchmarks.rigs.effects import EFFECTS, OUTSIDE
from benchmarks.rigs.sensors import NOISES
from benchmarks.rigs.types import Table

KINDS = (
    "clean", "single", "single", "outside", "clean", "single", "pair", "clean", "single", "single", "clean", "pair",
)  # fmt: skip
"""Kind of the case, by the seed's remainder: a third clean rigs. Every second round a pair is an outside shape."""

PAIRS = (
    ("accumulator", "remanence"), ("stribeck", "backlash"), ("offset", "migration"), ("heating", "asymmetry"),
    ("inertia", "delay"), ("quadratic-drag", "saturation"), ("pinching", "channel-skew"), ("end-stop", "remanence"),
    ("accumulator", "backlash"), ("heating", "offset"), ("asymmetry", "delay"), ("inertia", "pinching"),
    ("end-stop", "stribeck"),
)  # fmt: skip
RATES_HZ = (500.0, 1000.0, 2000.0)
SHARES = (0.05, 0.1, 0.2)


@dataclass(frozen=True)
class Case:
    """A case of the benchmark; everything else about it is drawn from the seed."""

    seed: int
    kind: str
    base: str
    planted: tuple[str, ...]
    share: float
    noise: str
    rate_hz: float
    training: str
    validation: str
    repeats: bool

    def as_row(self) -> Table:
        """Return the case as plain values."""
        return {**asdict(self), "planted": list(self.planted)}


def case_of(seed: int) -> Case:
    """Return the case of a seed.

    Clean rigs walk through all base forms; single effects meet every base form within 240 of them; noise, rate and
    excitation are drawn.
    """
    round_, place = divmod(seed, len(KINDS))
    kind = KINDS[place]
    if place == len(KINDS) - 1 and round_ % 2:
        kind = "outside"
    before = round_ * KINDS.count(kind) + KINDS[:place].count(kind)
    rng = np.random.default_rng([seed, 1])
    base = BASES[(before * 7 + (before // len(BASES)) * 3) % len(BASES)]
    planted: tuple[str, ...] = ()
    if kind == "single":
        planted = (EFFECTS[before % len(EFFECTS)],)
        base = BASES[(before * 7) % len(BASES)]
    elif kind == "outside":
        planted = (OUTSIDE[int(rng.integers(len(OUTSIDE)))],)
        base = BASES[int(rng.integers(len(BASES)))]
    elif kind == "pair":
        planted = PAIRS[int(rng.integers(len(PAIRS)))]
        base = BASES[int(rng.integers(len(BASES)))]
    share = float(rng.choice(SHARES)) if kind == "single" else float(rng.choice(SHARES[1:]))
    return Case(
        seed=seed,
        kind=kind,
        base=base,
        planted=planted,
        share=share if planted else 0.0,
        noise=NOISES[int(rng.integers(len(NOISES)))],
        rate_hz=float(rng.choice(RATES_HZ, p=(0.25, 0.5, 0.25))),
        training=("regular", "mixed")[int(rng.integers(2))],
        validation=("unlike", "unlike", "alike")[int(rng.integers(3))],
        repeats=bool(rng.integers(2)),
    )
