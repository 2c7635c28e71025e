"""Choice of the forced tests that the modes are fitted to, and correction of the clocks of their sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.modal.clocks.delays import SensorClock, added, corrected, estimate_clocks
from mrpipe.modal.fit.multimode import fit_again
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.options import IdentificationOptions
from mrpipe.modal.records import FrameTest, FrameTests
from mrpipe.modal.search.checks import LARGEST_COUPLING, modal_coupling
from mrpipe.modal.search.forced_modes import ModeSearch, find_modes
from mrpipe.modal.search.hidden import with_missing_modes
from mrpipe.modal.search.selection import Layout, all_floors_measured, floor_shapes, real_modes
from mrpipe.modal.search.sessions import own_fits, poles_of_tests
from mrpipe.modal.spectra import record_spectrum, thinned

_ENOUGH_COHERENCE = 0.9
_CLOCK_ROUNDS = 3
_SEARCHES = 3
_CLOCK_LINES = 4000


def training_first(tests: tuple[FrameTest, ...]) -> tuple[FrameTest, ...]:
    """Return the tests in their order, those for validation last."""
    return tuple(sorted(tests, key=lambda test: test.role == "validation"))


@dataclass(frozen=True)
class ChosenTests:
    """Modes found, and the tests of the fit (delays of their sensors corrected)."""

    search: ModeSearch
    tests: tuple[FrameTest, ...]


def choose_tests(
    forced: tuple[FrameTest, ...], tests: FrameTests, layout: Layout, options: IdentificationOptions
) -> tuple[ChosenTests, list[str]]:
    """Find the modes in the tests that are not for validation; only sweeps are used if modes are weak there.

    Validation tests are used only where the other tests do not show all modes, because a validation test that is part
    of the fit no longer validates the result.
    """
    first = tuple(test for test in forced if test.role != "validation") or forced
    arguments = (layout, options.band_low_hz, options.band_high_hz, tests.source, tests.decays)
    sets = [first]
    # sweeps put more energy into each mode than random motion, and fewer tests are fitted sooner
    for more in (tuple(test for test in forced if test.kind == "sweep"), forced):
        if len(more) > len(sets[-1]):
            sets.append(more)
    found: list[ChosenTests] = []
    fault: UserError | None = None
    for chosen in sets:
        complete = any(len(item.search.numbers) >= layout.floors for item in found)
        if complete and any(test.role == "validation" for test in chosen):
            continue
        try:
            found.append(ChosenTests(find_modes(chosen, *arguments), chosen))
        except UserError as error:
            fault = error
            continue
        if _is_sound(found[-1].search.fit, layout):
            break
    if not found:
        raise fault or UserError(tests.source, "forced tests", "no mode found", "check the channels")
    # of several doubtful sets the one with most modes counts, and among equals the one that leaves validation tests out
    sound = [item for item in found if _is_sound(item.search.fit, layout)]
    best = max(sound or found, key=lambda item: (len(item.search.numbers), -_largest_coupling(item.search.fit, layout)))
    used = [test.name for test in best.tests if test.role == "validation" and test not in first]
    notes = [f"modes are weak in the training tests: validation tests were used in the fit ({', '.join(used)})"]
    return best, notes if used else []


def _is_sound(fit: MultiModeFit, layout: Layout) -> bool:
    """Return whether all modes were found, each is well above the noise, and the shapes are orthogonal to the mass."""
    if fit.mode_coherence().min() < _ENOUGH_COHERENCE:
        return False
    if not layout.is_chain or layout.masses is None or not all_floors_measured(fit, layout):
        return fit.angular_frequencies.size >= layout.floors
    return fit.angular_frequencies.size == layout.floors and _largest_coupling(fit, layout) <= LARGEST_COUPLING


def _largest_coupling(fit: MultiModeFit, layout: Layout) -> float:
    """Return the largest off-diagonal element of the scaled U'MU; zero if it cannot be computed."""
    if layout.masses is None or not all_floors_measured(fit, layout):
        return 0.0
    coupling = modal_coupling(floor_shapes(fit, layout)[0], np.diag(layout.masses))
    return float(np.abs(np.triu(coupling, 1)).max())


def _imaginary_part(fits: Sequence[MultiModeFit], errors: Sequence[FloatArray]) -> float:
    """Return the squared imaginary parts of the residues over the squares of `errors`, summed over the fits."""
    pairs = zip(fits, errors, strict=True)
    return float(sum(np.sum(np.square(fit.residues.imag / np.maximum(error, 1e-300))) for fit, error in pairs))


def with_clocks(
    chosen: ChosenTests, tests: FrameTests, layout: Layout, options: IdentificationOptions
) -> tuple[ChosenTests, tuple[SensorClock, ...]]:
    """Correct the clocks of the sensors if this makes the mode shapes real, and search the modes again.

    The modes are searched again after the correction, and the clocks are estimated again with these modes, because a
    mode that was missing before disturbs the phases. Modes that only wrong clocks produced disappear. With
    other modes the estimate begins with the records as measured: a drift that was wrong because modes were missing
    would otherwise leave a rest that is neither a drift nor a step.

    Steps are searched only after the modes, because a sweep passes the modes one after another: a mode that was not
    found disturbs the phases from a certain time on, like a step.
    """
    clocks: list[SensorClock] = []
    best = chosen
    stepped = False
    modes = 0
    for attempt in range(_SEARCHES):
        incomplete = layout.is_chain and len(best.search.numbers) < layout.floors
        steps = not stepped and (attempt > 0 or not incomplete)
        stepped = stepped or steps
        start = clocks if len(best.search.numbers) == modes else []
        modes = len(best.search.numbers)
        more, moved = _estimated(best.search.fit, chosen.tests, start, len(clocks), steps)
        if more is None:
            if stepped:
                break
            continue
        band = (options.band_low_hz, options.band_high_hz)
        again = find_modes(moved, layout, *band, tests.source, tests.decays)
        if layout.is_chain and len(again.numbers) < layout.floors:
            again = with_missing_modes(again, moved, layout, options.band_high_hz)
        complete_before = len(best.search.numbers) == layout.floors == len(again.numbers)
        best, clocks = ChosenTests(again, moved), more
        if complete_before:
            break
    return best, tuple(clocks)


def _estimated(
    fit: MultiModeFit, tests: tuple[FrameTest, ...], start: list[SensorClock], known: int, steps: bool
) -> tuple[list[SensorClock] | None, tuple[FrameTest, ...]]:
    """Return the delays of the sensors and the corrected tests; None if the shapes do not become more real.

    Parameters
    ----------
    fit
        A fit of the tests after the correction of the delays known so far.
    tests
        The tests as measured.
    start
        Delays to begin with.
    known
        Number of the delays known so far.
    steps
        Whether a delay may have a step.
    """
    fits = _fits(fit)
    # correct clocks also reduce the errors of the residues, so that their own errors would let a shape that another
    # cause makes complex, such as a mode that was not found, seem more complex than before
    errors = [item.residue_errors for item in fits]
    before = _imaginary_part(fits, errors)
    total = start
    moved = tuple(corrected(test, total) for test in tests)
    for round_number in range(_CLOCK_ROUNDS):
        groups = [moved] if len(fits) == 1 else [(test,) for test in moved]
        found = [estimate_clocks(*pair, steps and round_number == 0) for pair in zip(fits, groups, strict=True)]
        new = [item for own in found for item in own if not item.is_zero]
        if not new:
            break
        total = added(total, new)
        moved = tuple(corrected(test, total) for test in tests)
        lines = [(item.omega[0], item.omega[-1]) for item in fit.spectra]
        band = (min(low for low, _ in lines) / (2.0 * np.pi), max(high for _, high in lines) / (2.0 * np.pi))
        spectra = thinned([record_spectrum(test, band) for test in moved], _CLOCK_LINES)
        groups_of_spectra = [spectra] if len(fits) == 1 else [(item,) for item in spectra]
        fits = [
            fit_again(own, item, passes=2, evaluations=10) for item, own in zip(fits, groups_of_spectra, strict=True)
        ]
    cost = 2.0 * max(len(total) - known, 1) * np.log(max(sum(item.residues.size for item in fits), 2))
    if total is start or _imaginary_part(fits, errors) + cost > before:
        return None, tests
    return total, moved


def _fits(fit: MultiModeFit) -> list[MultiModeFit]:
    """Return the fit, or one for each test if the tests do not agree on the frequencies.

    With the poles of other tests the phases of a test are wrong near its resonances, and a delay would explain a part
    of this. Tests differ if the structure softens with amplitude, or was changed between them.
    """
    poles = poles_of_tests(fit)
    if poles is None or not poles.differ(range(len(fit.spectra))):
        return [fit]
    return own_fits(fit, poles)


def without_complex(search: ModeSearch) -> ModeSearch:
    """Return the modes without those whose shape is not real even with correct clocks, because they are not modes."""
    kept = real_modes(search.fit)
    if not kept or len(kept) == len(search.numbers):
        return search
    return replace(search, fit=search.fit.only(kept), numbers=tuple(search.numbers[i] for i in kept))
