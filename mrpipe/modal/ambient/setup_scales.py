"""Scale of set-ups from the orthogonality of the modes, if the reference sensors are at a node.

The sensors that two set-ups share give the ratio of their shapes. Sensors at a node of a mode do not show this ratio.
The rows of each set-up then have an unknown factor d_s. The modes of one structure are orthogonal to the mass, so that
the factors of a mode obey

    sum_s d_s (phi_q' M a_s) = 0    for each other mode q,

with the rows a_s of set-up s. Each shared sensor gives a further equation, d_s a_s(i) = d_t a_t(i). All equations are
weighted by their errors. The vector of factors is the right singular vector of the smallest singular value, because
only the common factor of all parts is free. The misfit of the redundant equations increases the errors (Birge 1932,
Physical Review 40, 207).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.ambient.setups import PICKED_UP, Merged, part_of
from mrpipe.modal.fit.result import MultiModeFit
from mrpipe.modal.search.selection import Layout, all_floors_measured, floor_shapes, shape_errors

_ROUNDS = 4
_OPEN = 0.2
"""Error of a shape over its norm from which on the signs of its parts are not determined."""
_CONTRADICTION = 9.0
"""Squared misfit over its degrees of freedom from which on the parts contradict the other modes."""


def scaled_by_orthogonality(merged: Merged, modes: Sequence[int], layout: Layout) -> MultiModeFit:
    """Return the merged fit; set-ups are scaled by orthogonality where this is better than the shared sensors.

    The fit is unchanged if masses are unknown, or if a floor has no sensor in any set-up.

    Parameters
    ----------
    merged
        Modes of all set-ups.
    modes
        Indices of its poles that are modes of the structure by their own evidence.
    layout
        Floors and masses.
    """
    fit = merged.fit
    if layout.masses is None or not all_floors_measured(fit, layout):
        return fit
    shapes, errors = floor_shapes(fit, layout)
    residues, spread = fit.residues.copy(), fit.residue_errors.copy()
    rows = [sensor.floor - 1 for sensor in fit.sensors]
    for mode in range(fit.angular_frequencies.size):
        others = [other for other in modes if other != mode]
        found = joined_parts(_parts(merged, mode), shapes[:, others], errors[:, others], layout.masses)
        if found is None:
            continue
        values, own = found
        before = np.linalg.norm(errors[:, mode]) / np.linalg.norm(shapes[:, mode])
        if np.linalg.norm(own) / np.linalg.norm(values) < min(float(before), _OPEN):
            scale = np.linalg.norm(shapes[:, mode]) / np.linalg.norm(values)
            residues[:, mode], spread[:, mode] = scale * values[rows], scale * own[rows]
    return replace(fit, residues=residues, residue_errors=spread)


def scaling_notes(before: MultiModeFit, after: MultiModeFit, modes: Sequence[int]) -> tuple[str, ...]:
    """Return a line that names the modes (indices from 0) whose shape the shared sensors alone do not determine."""
    open_before = np.flatnonzero(shape_errors(before) >= _OPEN)
    names = [str(place) for place, mode in enumerate(modes, start=1) if mode in open_before]
    if not names or after is before:
        return ()
    return (
        f"set-ups: the shared sensors are near a node of mode {', '.join(names)}; the scale of its parts follows "
        "from the orthogonality of the modes to the given floor masses",
    )


def _parts(merged: Merged, mode: int) -> list[Part]:
    """Return the part of a mode that each set-up shows."""
    parts = []
    for index, set_up in enumerate(merged.set_ups):
        values, errors = part_of(set_up, merged.places[index][mode], float(merged.fit.angular_frequencies[mode]))
        parts.append(Part(tuple(sensor.floor - 1 for sensor in set_up.fit.sensors), values, errors))
    return parts


@dataclass(frozen=True)
class Part:
    """Rows of a mode that one set-up shows.

    Attributes
    ----------
    rows
        Degree of freedom (from 0) of each value, shape (s,).
    values, errors
        Values with arbitrary scale, and standard errors, shape (s,).
    """

    rows: tuple[int, ...]
    values: FloatArray
    errors: FloatArray


def joined_parts(
    parts: Sequence[Part], shapes: FloatArray, errors: FloatArray, masses: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return a mode from parts with unknown scales, shape (n,), and its errors; None if scales remain unknown.

    Parameters
    ----------
    parts
        The mode as each set-up shows it; together they have all n rows.
    shapes, errors
        Shape (n, r): the other modes, and standard errors.
    masses
        Shape (n,) [kg].
    """
    size = [float(np.sqrt(masses[list(part.rows)] @ part.values**2)) for part in parts]
    units = [Part(p.rows, p.values / s, p.errors / s) for p, s in zip(parts, size, strict=True)]
    if {row for part in parts for row in part.rows} != set(range(masses.size)) or min(size) <= 0.0:
        return None
    norm = np.sqrt(masses @ shapes**2)
    others, spread = shapes / norm, errors / norm
    scaled = others.T @ (masses[:, None] * others)
    coupled = float(np.sqrt(np.mean(scaled[np.triu_indices(norm.size, 1)] ** 2))) if norm.size > 1 else 0.0
    common = max(PICKED_UP, coupled)
    factors, covariance = np.full(len(parts), len(parts) ** -0.5), np.zeros((len(parts), len(parts)))
    for _ in range(_ROUNDS):
        equations = np.vstack(
            [
                _orthogonality(units, factors, others, spread, masses, common),
                _shared(units, factors, common / np.sqrt(masses.sum())),
            ]
        )
        found = _null_vector(equations)
        if found is None:
            return None
        factors, covariance = found
    return _assembled(units, factors, covariance, masses.size)


def _holders(parts: Sequence[Part], floors: int) -> list[list[tuple[int, int]]]:
    """Return for each row the parts that have it, and its place in each."""
    return [[(k, part.rows.index(row)) for k, part in enumerate(parts) if row in part.rows] for row in range(floors)]


def _orthogonality(
    parts: Sequence[Part],
    factors: FloatArray,
    others: FloatArray,
    spread: FloatArray,
    masses: FloatArray,
    common: float,
) -> FloatArray:
    """Return one weighted row for each other mode: coefficients of the factors, shape (r, parts)."""
    rows = np.zeros((others.shape[1], len(parts)))
    variance = np.full(others.shape[1], common**2)
    for row, holders in enumerate(_holders(parts, masses.size)):
        # a row that several parts have counts once, as their mean
        for k, place in holders:
            share = masses[row] / len(holders)
            rows[:, k] += share * others[row] * parts[k].values[place]
            variance += (share * factors[k]) ** 2 * (
                (others[row] * parts[k].errors[place]) ** 2 + (spread[row] * parts[k].values[place]) ** 2
            )
    return np.asarray(rows / np.sqrt(variance)[:, None])


def _shared(parts: Sequence[Part], factors: FloatArray, common: float) -> FloatArray:
    """Return one weighted row for each sensor that a part shares with an earlier one; `common`: least error."""
    rows = []
    floors = 1 + max(row for part in parts for row in part.rows)
    for holders in _holders(parts, floors):
        (first, at), *rest = holders
        for k, place in rest:
            line = np.zeros(len(parts))
            line[first], line[k] = parts[first].values[at], -parts[k].values[place]
            noise = np.hypot(factors[first] * parts[first].errors[at], factors[k] * parts[k].errors[place])
            rows.append(line / float(np.hypot(noise, common)))
    return np.array(rows).reshape(-1, len(parts))


def _null_vector(equations: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return the factors of unit norm that solve the equations best, and their covariance; None if they contradict."""
    count = equations.shape[1]
    freedom = equations.shape[0] - count + 1
    if freedom < 0:
        return None
    _, singular, right = np.linalg.svd(equations, full_matrices=True)
    singular = np.concatenate([singular, np.zeros(count - singular.size)])
    misfit = float(singular[-1] ** 2) / max(freedom, 1)
    if misfit > _CONTRADICTION:
        return None
    across = right[:-1]
    variance = max(misfit, 1.0) / np.maximum(singular[:-1] ** 2, 1e-12)
    return right[-1], np.asarray(across.T @ (variance[:, None] * across))


def _assembled(
    parts: Sequence[Part], factors: FloatArray, covariance: FloatArray, floors: int
) -> tuple[FloatArray, FloatArray]:
    values, errors = np.zeros(floors), np.zeros(floors)
    for row, holders in enumerate(_holders(parts, floors)):
        own = np.array([factors[k] * parts[k].values[place] for k, place in holders])
        noise = np.array([factors[k] * parts[k].errors[place] for k, place in holders])
        scale = np.array([np.sqrt(covariance[k, k]) * parts[k].values[place] for k, place in holders])
        variance = np.maximum(noise**2 + scale**2, 1e-24)
        values[row] = float(np.sum(own / variance) / np.sum(1.0 / variance))
        errors[row] = float(1.0 / np.sqrt(np.sum(1.0 / variance)))
    return values, errors
