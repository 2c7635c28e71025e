"""Search of the fault of a sensor that explains the residual of a linear frame.

One sensor after another is given an unknown gain and delay, in all tests or in a single one, and the linear frame is
fitted again. Pairs of floors are exchanged as well.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.structures.dynamics import ComplexArray
from mrpipe.tracing.structure.fit import Base, Columns, Design, design_of, predicted, stacked
from mrpipe.tracing.structure.groups import Groups
from mrpipe.tracing.structure.sensor_faults import (
    SensorFault,
    corrected,
    motion_change,
    sensitivity_of,
    sensors_of,
)
from mrpipe.tracing.structure.spectra import Spectra

REFINED = 6
"""Numerical technique: number of possible faults whose gain and delay are fitted after screening."""

STARTS = ((1.0, 0.0), (-1.0, 0.0), (0.8, 0.0), (1.25, 0.0), (1.0, -0.3), (1.0, 0.3))
"""Numerical technique: gains, and delays in periods of the fastest line, from which a fault in all tests is sought. The
residual has several minima, because a large gain makes a floor seem to stand still and a delay turns fast lines round.
"""

STEPS = 8
"""Numerical technique: largest number of Gauss-Newton steps for gain and delay."""

STEP_LENGTHS = (1.0, 0.5, 0.25, 0.125)
"""Numerical technique: shares of a step that are tried, because the residual is linear in small changes only."""

CONVERGED = 1e-4
"""Numerical technique: change of gain, and of delay relative to the period of the fastest line, that ends the fit."""


def likely_fault(design: Design, groups: Groups, masses: FloatArray, least_share: float) -> SensorFault | None:
    """Return the fault of a sensor that removes most of the residual of a linear frame; None if none removes enough.

    The weights of the lines were estimated with the faulty sensor. Judge the fault by tracing the corrected records.

    Parameters
    ----------
    design
        General linear frame, fitted to the training records.
    groups
        Groups of lines in which its residual exceeds the noise.
    masses
        Floor masses, shape (n,) [kg].
    least_share
        Share of the excess over the noise that the fault must remove.
    """
    spectra, whole = design.spectra, groups.excess(design.residual)
    if whole <= 0.0:
        return None
    possible = (*_exchanges(spectra, masses), *_promising(design, masses))
    fitted = [_fitted(item, spectra, masses) for item in possible]
    best, own = min(fitted, key=lambda item: groups.excess(item[1].residual))
    removed = 1.0 - groups.excess(own.residual) / whole
    return replace(best, explained=removed) if removed >= least_share else None


def with_smaller_residual(fault: SensorFault, spectra: Sequence[Spectra], masses: FloatArray) -> SensorFault:
    """Return a fault whose gain and delay are changed so that records corrected with it have the smallest residual.

    Parameters
    ----------
    fault
        The fault. An exchange of two floors has neither gain nor delay, and is returned as it is.
    spectra
        Spectra of the records that were corrected with it.
    masses
        Floor masses, shape (n,) [kg].
    """
    if fault.exchanged_with:
        return fault
    rest, _ = _fitted(SensorFault(fault.floor, fault.test), spectra, masses)
    return replace(
        fault, gain=fault.gain * rest.gain, delay_s=fault.delay_s + rest.delay_s,
        gain_error=abs(fault.gain) * rest.gain_error, delay_error_s=rest.delay_error_s,
    )  # fmt: skip


def fault_in_record(
    base: Base, linear: Sequence[FloatArray], record: Spectra, expected: ComplexArray, masses: FloatArray
) -> SensorFault:
    """Return the fault of one sensor, in one record, that brings it nearest to a frame fitted to other records.

    Parameters
    ----------
    base, linear
        Kind of the linear frame, and its coefficients for each storey.
    record
        Spectra of the record.
    expected
        Shear forces that the frame predicts for it, shape (n, b) [N/sqrt(Hz)].
    masses
        Floor masses, shape (n,) [kg].
    """
    name = record.record.name
    floors = [floor for floor in sensors_of([record]) if floor]
    starts = [SensorFault(floor, name, gain) for floor in sensors_of([record]) for gain in (1.0, -1.0)]
    exchanged = [SensorFault(a, name, exchanged_with=b) for a, b in itertools.combinations(floors, 2)]

    def error(fault: SensorFault) -> ComplexArray:
        moved = corrected(record, fault, masses)
        return np.asarray((moved.target - expected - motion_change(base, linear, moved, record)) * record.weight)

    def cost(fault: SensorFault) -> float:
        return float(np.sum(np.abs(error(fault)) ** 2))

    def sensitivity(fault: SensorFault) -> FloatArray:
        lines = sensitivity_of(fault, corrected(record, fault, masses), base, linear, masses)
        return stacked(lines * record.weight).reshape(2, -1)

    found = list(exchanged)
    fastest = 2.0 * np.pi * float(record.frequencies_hz[-1])
    for start in starts:
        best = start
        for _ in range(STEPS):
            columns = sensitivity(best)
            change = np.linalg.lstsq(columns.T, stacked(error(best)).ravel(), rcond=None)[0]
            better = next((item for item in _tries(best, np.asarray(change), fastest) if cost(item) < cost(best)), None)
            if better is None:
                break
            best = better
        found.append(_with_errors(best, sensitivity(best), cost(best) / (2 * record.target.size)))
    return min(found, key=cost)


def _with(fault: SensorFault, spectra: Sequence[Spectra], masses: FloatArray) -> Design:
    return design_of("linear-frame", [corrected(item, fault, masses) for item in spectra])


def _exchanges(spectra: Sequence[Spectra], masses: FloatArray) -> list[SensorFault]:
    """Return the exchange of two floors in all tests, and the one in a single test, that promise most.

    If two floors are exchanged in all tests, a linear frame of another stiffness often fits as well. In a single test,
    the exchange is judged by a frame that is fitted to the other tests.
    """
    floors = [floor for floor in sensors_of(spectra) if floor]
    pairs = list(itertools.combinations(floors, 2))
    if not pairs:
        return []
    everywhere = [SensorFault(a, exchanged_with=b) for a, b in pairs]
    found = [min(everywhere, key=lambda item: _with(item, spectra, masses).chi_square)]
    alone = []
    for record in spectra if len(spectra) > 1 else ():
        design = design_of("linear-frame", [item for item in spectra if item is not record])
        linear = design.linear
        before = _misfit(record, design.base, linear)
        for a, b in pairs:
            fault = SensorFault(a, record.record.name, exchanged_with=b)
            alone.append((_misfit(corrected(record, fault, masses), design.base, linear) / before, fault))
    if alone:
        found.append(min(alone, key=lambda item: item[0])[1])
    return found


def _misfit(record: Spectra, base: Base, linear: Sequence[FloatArray]) -> float:
    """Return the weighted squared error of a frame in one record."""
    return float(
        np.sum(np.abs((record.target - predicted(base, record, linear, None, np.zeros(0))) * record.weight) ** 2)
    )


def _promising(design: Design, masses: FloatArray) -> list[SensorFault]:
    """Return the faults, with start values, that promise the smallest residual after one step of the fit."""
    spectra = design.spectra
    period = 1.0 / float(spectra[0].frequencies_hz[-1])
    ranked = []
    for floor in sensors_of(spectra):
        for gain, periods in STARTS:
            start = SensorFault(floor, gain=gain, delay_s=periods * period)
            moved = start.gain != 1.0 or start.delay_s != 0.0
            ranked.append((_step(start, _with(start, spectra, masses) if moved else design, masses)[1], start))
        for name in (item.record.name for item in spectra):
            ranked.append((_step(SensorFault(floor, name), design, masses)[1], SensorFault(floor, name)))
            turned = SensorFault(floor, name, -1.0)
            ranked.append((_with(turned, spectra, masses).chi_square, turned))
    return [item for _, item in sorted(ranked, key=lambda pair: pair[0])[:REFINED]]


def _fitted(fault: SensorFault, spectra: Sequence[Spectra], masses: FloatArray) -> tuple[SensorFault, Design]:
    """Return a fault with fitted gain and delay, and the linear frame with the corrected sensor."""
    best, design = fault, _with(fault, spectra, masses)
    if fault.exchanged_with:
        return best, design
    fastest = 2.0 * np.pi * float(spectra[0].frequencies_hz[-1])
    for _ in range(STEPS):
        change, _ = _step(best, design, masses)
        solved = ((item, _with(item, spectra, masses)) for item in _tries(best, change, fastest))
        better = next((pair for pair in solved if pair[1].chi_square < design.chi_square), None)
        if better is None:
            break
        best, design = better
        if float(np.max(np.abs(change * [1.0, fastest]))) < CONVERGED:
            break
    return _with_errors(best, _columns(best, design, masses), design.chi_square), design


def _with_errors(fault: SensorFault, columns: FloatArray, mean_square: float) -> SensorFault:
    """Return a fault with standard errors from the sensitivity to logarithmic gain and delay, shape (2, equations)."""
    covariance = np.linalg.pinv(columns @ columns.T) * max(mean_square, 1.0)
    gain, delay = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return replace(fault, gain_error=float(abs(fault.gain) * gain), delay_error_s=float(delay))


def _tries(fault: SensorFault, change: FloatArray, fastest: float) -> Iterator[SensorFault]:
    """Yield the fault after the whole step, and then after shorter ones."""
    return (_changed_by(fault, share * change, fastest) for share in STEP_LENGTHS)


def _changed_by(fault: SensorFault, change: FloatArray, fastest: float) -> SensorFault:
    """Return a fault after a change of logarithmic gain and delay, shortened where it would not be linear."""
    size = float(np.max(np.abs(change * [1.0, fastest])))
    gain, delay = change * min(1.0, 0.5 / max(size, 1e-300))
    return replace(fault, gain=float(fault.gain * (1.0 - gain)), delay_s=float(fault.delay_s + delay))


def _step(fault: SensorFault, design: Design, masses: FloatArray) -> tuple[FloatArray, float]:
    """Return the changes of logarithmic gain and of delay that lower the residual most, and the mean square expected.

    The design is that of the records corrected with the fault. A small change of the corrected acceleration A by
    (c + i w t) A changes the residual of each storey linearly, with the fitted frame.
    """
    flat = _columns(fault, design, masses)
    target = design.residual.reshape(-1)
    change = np.linalg.lstsq(flat.T, target, rcond=None)[0]
    rest = target - change @ flat
    return np.asarray(change), float(rest @ rest) / design.size


def _columns(fault: SensorFault, design: Design, masses: FloatArray) -> FloatArray:
    """Return the sensitivity to logarithmic gain and delay, projected as the residual, shape (2, equations)."""
    linear = design.linear
    columns = []
    for item in design.spectra:
        lines = np.zeros((2, item.record.floors, len(item.frequencies_hz)), dtype=np.complex128)
        if not fault.test or item.record.name == fault.test:
            lines = sensitivity_of(fault, item, design.base, linear, masses)
        columns.append(Columns(lines))
    return np.asarray(design.project(columns).reshape(2, -1))
