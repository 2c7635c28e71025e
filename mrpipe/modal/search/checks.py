"""Checks of a mode matrix: orthogonality with respect to the mass, and wrong signs."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from mrpipe.artifacts import FloatArray
from mrpipe.words import listed

LARGEST_COUPLING = 0.1
_FLIPS = 3
_SUSPECT_COUPLING = 0.05
SURE_ERRORS = 5.0
SURE_SHARE = 0.1
"""The sign of an element of a shape is sure above so many standard errors and this share of the largest element."""


@dataclass(frozen=True)
class ModeMatrixFinding:
    """Something wrong with a mode matrix.

    Attributes
    ----------
    kind
        `not-orthogonal`, `wrong-sign`, `singular` or `sign-changes`.
    message
        One line.
    elements
        (floor, mode) concerned, from 1.
    """

    kind: str
    message: str
    elements: tuple[tuple[int, int], ...] = ()


def modal_coupling(mode_shapes: ArrayLike, mass: ArrayLike) -> FloatArray:
    """Return U'MU (3.14) scaled to a unit diagonal, shape (r, r): its off-diagonals should vanish."""
    U = np.asarray(mode_shapes, dtype=np.float64)
    gram = U.T @ np.asarray(mass, dtype=np.float64) @ U
    size = np.sqrt(np.diag(gram))
    return np.asarray(gram / np.outer(size, size))


def _off_diagonal(coupling: FloatArray) -> float:
    return 0.5 * float(np.sum(coupling**2) - np.sum(np.diag(coupling) ** 2))


def wrong_signs(mode_shapes: ArrayLike, mass: ArrayLike) -> tuple[tuple[int, int], ...]:
    """Return the fewest elements (floor, mode), from 1, whose sign must change to make the columns orthogonal.

    All sets of up to three elements are tried; empty if none reduces the off-diagonal coupling to less than a quarter.
    """
    U = np.asarray(mode_shapes, dtype=np.float64)
    M = np.asarray(mass, dtype=np.float64)
    weight = np.diag(M)
    size = np.sqrt(np.einsum("f,fm->m", weight, U**2))
    scaled = np.sqrt(weight)[:, None] * U / size
    gram = scaled.T @ scaled
    before = _off_diagonal(gram)
    suspect = np.flatnonzero((np.abs(gram - np.diag(np.diag(gram))) > _SUSPECT_COUPLING).any(axis=0))
    places = [(i, int(j)) for i in range(U.shape[0]) for j in suspect if abs(U[i, j]) > 0.02 * abs(U[:, j]).max()]
    best: tuple[float, tuple[tuple[int, int], ...]] = (before, ())
    for number in range(1, _FLIPS + 1):
        if number == _FLIPS and best[0] < 0.05 * before:
            break
        for chosen in combinations(places, number):
            turned = _turned_cost(scaled, gram, chosen)
            # another element must reduce the cost enough
            if turned < best[0] * (0.5 if number > len(best[1]) else 1.0):
                best = (turned, chosen)
    if best[0] > 0.25 * before:
        return ()
    return tuple((i + 1, j + 1) for i, j in best[1])


def _turned_cost(scaled: FloatArray, gram: FloatArray, chosen: tuple[tuple[int, int], ...]) -> float:
    columns = sorted({j for _, j in chosen})
    changed = scaled[:, columns].copy()
    for i, j in chosen:
        changed[i, columns.index(j)] *= -1.0
    result = gram.copy()
    rows = changed.T @ scaled
    result[columns, :] = rows
    result[:, columns] = rows.T
    result[np.ix_(columns, columns)] = changed.T @ changed
    return _off_diagonal(result)


def check_mode_matrix(
    mode_shapes: ArrayLike, mass: ArrayLike, *, largest_coupling: float = LARGEST_COUPLING
) -> list[ModeMatrixFinding]:
    """Return what is wrong with a mode matrix; empty if nothing is.

    Parameters
    ----------
    mode_shapes
        Shape (n, r): one row per floor, one column per mode.
    mass
        Shape (n, n), diagonal [kg].
    largest_coupling
        Largest element off the diagonal of the scaled U'MU that counts as orthogonal.
    """
    U = np.asarray(mode_shapes, dtype=np.float64)
    findings: list[ModeMatrixFinding] = []
    singular = np.linalg.svd(U / np.linalg.norm(U, axis=0), compute_uv=False)
    if singular[-1] < 1e-8 * singular[0]:
        findings.append(ModeMatrixFinding("singular", "two modes have the same shape"))
        return findings
    coupling = modal_coupling(U, mass)
    pairs = [
        (i, j) for i in range(U.shape[1]) for j in range(i + 1, U.shape[1]) if abs(coupling[i, j]) > largest_coupling
    ]
    if not pairs:
        return findings
    i, j = max(pairs, key=lambda p: abs(coupling[p]))
    message = f"modes {i + 1} and {j + 1} are not orthogonal: scaled U'MU is {coupling[i, j]:+.2f}"
    findings.append(ModeMatrixFinding("not-orthogonal", message))
    elements = wrong_signs(U, mass)
    if elements:
        names = listed([f"U{floor}{mode} = {U[floor - 1, mode - 1]:+.3f}" for floor, mode in elements])
        corrected = U.copy()
        for floor, mode in elements:
            corrected[floor - 1, mode - 1] *= -1.0
        left = np.abs(np.triu(modal_coupling(corrected, mass), 1)).max()
        message = f"the sign of {names} is wrong: with the other sign the largest coupling is {left:.3f}"
        findings.append(ModeMatrixFinding("wrong-sign", message, elements))
    return findings


def possible_sign_changes(mode_shape: ArrayLike, error: ArrayLike) -> tuple[int, int]:
    """Return the fewest and the most sign changes that a shape (n,) can have, given standard errors (n,).

    The sign of an element smaller than twice its error is not determined.
    """
    shape = np.asarray(mode_shape, dtype=np.float64)
    known = np.abs(shape) > np.maximum(2.0 * np.asarray(error, dtype=np.float64), 1e-12)
    fewest = {1: 0, -1: 0}
    most = {1: 0, -1: 0}
    for index, (value, sure) in enumerate(zip(shape, known, strict=True)):
        signs = [int(np.sign(value))] if sure else [1, -1]
        if index == 0:
            fewest = dict.fromkeys(signs, 0)
            most = dict(fewest)
            continue
        fewest = {s: min(count + (s != before) for before, count in fewest.items()) for s in signs}
        most = {s: max(count + (s != before) for before, count in most.items()) for s in signs}
    return min(fewest.values()), max(most.values())


def orthogonal_shapes(mode_shapes: ArrayLike, mass: ArrayLike, relative_errors: ArrayLike) -> FloatArray:
    """Return the shapes orthogonal to the mass that are nearest to the measured ones, weighted by certainty.

    The weighted Procrustes problem: with L = M^(1/2), the polar factor of L U W, W = 1/error2. Orthogonality to the
    accurate modes then determines a mode that the sweep hardly shows.

    Parameters
    ----------
    mode_shapes
        Shape (n, n).
    mass
        Shape (n, n), diagonal [kg].
    relative_errors
        Shape (n,): error of each shape over its norm.
    """
    root = np.sqrt(np.diag(np.asarray(mass, dtype=np.float64)))[:, None]
    scaled = root * np.asarray(mode_shapes, dtype=np.float64)
    size = np.linalg.norm(scaled, axis=0)
    weight = 1.0 / np.maximum(np.asarray(relative_errors, dtype=np.float64), 1e-5) ** 2
    left, _, right = np.linalg.svd(scaled / size * (weight / weight.max()))
    return np.asarray(left @ right / root * size)


def reversed_finding(mode_shape: ArrayLike, error: ArrayLike) -> list[str]:
    """Return a sentence on floors that move against the others in the first mode of a chain; empty for none.

    Springs between floors and to the ground give a first mode in which all floors move to one side (theorem of Perron
    and Frobenius for the inverse of the stiffness). A floor against it has a sensor with the opposite sign.

    Parameters
    ----------
    mode_shape
        First mode, shape (n,).
    error
        Standard errors, shape (n,); infinite at floors without a sensor.
    """
    shape = np.asarray(mode_shape, dtype=np.float64)
    size = np.abs(shape)
    sure = size > np.maximum(SURE_ERRORS * np.asarray(error, dtype=np.float64), SURE_SHARE * size.max())
    up, down = (np.flatnonzero(sure & (sign * shape > 0.0)) + 1 for sign in (1.0, -1.0))
    fewer = up if up.size < down.size else down
    if not fewer.size:
        return []
    names = listed(list(map(str, fewer)))
    one = fewer.size == 1
    subject, sign = (
        (f"floor {names} moves", "the sign of its sensor is")
        if one
        else (f"floors {names} move", "the signs of their sensors are")
    )
    return [
        f"{subject} against the others in the first mode, which springs between floors do not allow: {sign} probably "
        "wrong (scale: -1 in campaign.yaml turns it)"
    ]
