"""Test plans of a bench campaign."""

from __future__ import annotations

from mrpipe.errors import UserError
from mrpipe.laboratory.motion import BenchTest, CurrentKind

FREQUENCIES_HZ = (0.5, 1.0, 1.27, 1.8, 2.2)
PLANS = ("table-2.1", "compact", "discriminating")
SOFT_START_CYCLES = 2.75


def table_2_1(cycles: int = 10, frequencies_hz: tuple[float, ...] = FREQUENCIES_HZ) -> list[BenchTest]:
    """Return Table 2.1: 19 sets at five frequencies, training (a) and validation (b); set 11 repeats set 1."""
    constant: list[tuple[float, CurrentKind, float]] = [
        (a, "constant", i) for a in (0.005, 0.010) for i in (0.0, 1.0, 2.0, 3.0, 4.0)
    ]
    half: list[tuple[float, CurrentKind, float]] = [(0.005, "half-sine", i) for i in (0.0, 1.0, 2.0, 3.0, 4.0)]
    half += [(0.010, "half-sine", i) for i in (1.0, 2.0, 3.0, 4.0)]
    tests = []
    for number, (amplitude, kind, current) in enumerate(constant + half, start=1):
        for letter, role in (("a", "training"), ("b", "validation")):
            for frequency in frequencies_hz:
                duration = (cycles + SOFT_START_CYCLES + 0.5) / frequency
                name = f"{number}{letter}-{frequency:g}Hz" if frequency % 1 else f"{number}{letter}-{frequency:.1f}Hz"
                tests.append(BenchTest(name, role, "sine", amplitude, frequency, kind, current, duration))
    return tests


def compact(duration_s: float = 5.0) -> list[BenchTest]:
    """Return 44 short tests with different motions; validation tests have some of these kinds of motion and others."""
    mm = 1e-3
    d = duration_s
    rows: list[BenchTest] = []

    def add(role: str, motion: str, a: float, f: float, kind: str, current: float, repeat: str = "") -> None:
        name = f"{len(rows) + 1:02d}-{motion}-{a:g}mm-{f:g}Hz-{kind}-{current:g}A"
        rows.append(BenchTest(name, role, motion, a * mm, f, kind, current, d, repeat))  # type: ignore[arg-type]

    for a, f, levels in (
        (5.0, 1.0, (0.0, 2.0)),
        (5, 2.2, (0.0, 3.0)),
        (10, 0.5, (0.0, 1.0)),
        (10, 1.8, (0.0, 4.0)),
        (10, 1.27, (0.5, 1.0, 3.0)),
    ):
        for level in levels:
            add("training", "sine", a, f, "constant", level)
    for a, f, current in ((5, 1.0, 2.0), (10, 1.0, 4.0), (10, 2.2, 1.0), (5, 1.8, 3.0)):
        add("training", "sine", a, f, "half-sine", current)
    for motion, a, f, current in (
        ("sine", 10, 1.0, 4),
        ("sine", 5, 1.27, 2),
        ("triangle", 10, 0.5, 3),
        ("triangle", 8, 1.0, 4),
    ):
        add("training", motion, a, f, "steps", current)
    for a, f, current in ((10, 0.25, 1), (10, 1.0, 2), (5, 2.0, 3), (2, 0.5, 2)):
        add("training", "triangle", a, f, "constant", current)
    for a, f, kind, current in ((10, 3.0, "constant", 0), (10, 2.0, "constant", 2), (10, 3.0, "random", 4)):
        add("training", "random", a, f, kind, current)
    for a, f, kind, current in ((12, 3.0, "steps", 3), (10, 4.0, "random", 2)):
        add("training", "earthquake", a, f, kind, current)
    add("training", "dwell", 10, 1.5, "constant", 2)
    add("repeat", "sine", 10, 1.8, "constant", 4, rows[7].name)
    add("repeat", "sine", 10, 1.0, "half-sine", 4, rows[12].name)
    add("repeat", "sine", 10, 1.27, "constant", 1, rows[9].name)
    for motion, a, f, kind, current in (
        ("sine", 7.5, 0.8, "constant", 1.5),
        ("sine", 8, 1.5, "half-sine", 3),
        ("sine", 10, 1.8, "constant", 3.5),
        ("sine", 10, 1.27, "steps", 3),
        ("triangle", 7, 0.7, "constant", 2.5),
        ("triangle", 10, 0.8, "steps", 4),
        ("random", 10, 2.5, "constant", 1),
        ("random", 10, 3.0, "random", 3),
        ("earthquake", 12, 3.0, "constant", 2),
        ("earthquake", 11, 3.5, "steps", 4),
        ("sine", 10, 2.2, "random", 4),
        ("random", 6, 2.0, "steps", 2),
    ):
        add("validation", motion, a, f, kind, current)
    return rows


def discriminating(duration_s: float = 8.0) -> list[BenchTest]:
    """Return the tests that separate similar effects: speeds, steps, dwells, a long run, repeats."""
    tests = [
        BenchTest(
            f"speed-{speed * 1e3:.0f}mm_s-{current:g}A",
            "training",
            "triangle",
            0.008,
            speed / 0.032,
            "constant",
            current,
            max(duration_s, 1.6 * 0.032 / speed),
        )
        for speed in (0.004, 0.01, 0.025, 0.06, 0.15)
        for current in (0.0, 2.0)
    ]
    tests += [
        BenchTest(f"steps-{f:g}Hz", role, "triangle", 0.010, f, "steps", 4.0, duration_s, pause_s=0.5)
        for f, role in ((0.5, "training"), (1.0, "training"), (0.7, "validation"))
    ]
    tests += [
        BenchTest(f"reversal-{current:g}A", "training", "triangle", 0.002, 0.5, "constant", current, duration_s)
        for current in (1.0, 4.0)
    ]
    tests += [
        BenchTest(f"dwell-{current:g}A", role, "dwell", 0.012, 1.0, "constant", current, 1.5 * duration_s)
        for current, role in ((0.0, "training"), (2.0, "training"), (1.0, "validation"))
    ]
    d = duration_s
    tests += [
        BenchTest("long", "training", "sine", 0.010, 1.8, "constant", 4.0, 5.0 * d),
        BenchTest("cooling", "training", "hold", 0.010, 1.8, "constant", 4.0, 5.0 * d, pause_s=2.0 * d),
        BenchTest("cooling-b", "validation", "hold", 0.008, 1.5, "constant", 3.0, 5.0 * d, pause_s=d),
        BenchTest("again-1", "training", "sine", 0.010, 1.27, "half-sine", 3.0, duration_s),
        BenchTest("again-2", "repeat", "sine", 0.010, 1.27, "half-sine", 3.0, duration_s, "again-1"),
        BenchTest("unlike", "validation", "random", 0.010, 3.0, "random", 4.0, duration_s),
    ]
    return tests


def tests_of(plan: str, *, cycles: int = 10, duration_s: float = 5.0) -> list[BenchTest]:
    """Return the tests of a plan, or of several joined by `+` (`compact+discriminating`).

    Raises
    ------
    UserError
        If the plan does not exist.
    """
    tests: list[BenchTest] = []
    for name in plan.split("+"):
        if name not in PLANS:
            raise UserError("laboratory.bench.plan", name, "no such plan", f"one of {', '.join(PLANS)}, joined by +")
        if name == "table-2.1":
            tests += table_2_1(cycles)
        else:
            tests += compact(duration_s) if name == "compact" else discriminating(1.6 * duration_s)
    return tests
