"""Shapes and participations of modes from residues of several inputs."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.modal.spectra import ComplexArray


def rank_one(residues: ComplexArray, errors: FloatArray) -> tuple[ComplexArray, FloatArray, ComplexArray]:
    """Return shapes (n, r), their errors, and participations (k, r): residues = shape x participation.

    The residue matrix of a mode has rank one. It is approximated by weighted least squares, sensors and inputs in
    turn. A shape is scaled by the participation of the input that excites the mode most.
    """
    if residues.shape[1] == 1:
        return residues[:, 0], errors[:, 0], np.ones((1, residues.shape[2]), dtype=np.complex128)
    known = np.isfinite(residues.real)
    weight = np.where(known, 1.0 / np.maximum(errors, 1e-300) ** 2, 0.0)
    values = np.where(known, residues, 0.0)
    shapes = np.zeros((residues.shape[0], residues.shape[2]), dtype=np.complex128)
    shape_errors = np.zeros(shapes.shape)
    participations = np.zeros((residues.shape[1], residues.shape[2]), dtype=np.complex128)
    for mode in range(residues.shape[2]):
        own, certain = values[:, :, mode], weight[:, :, mode]
        main = int(np.argmax(np.sum(np.abs(own) ** 2 * certain, axis=0)))
        share = np.zeros(own.shape[1], dtype=np.complex128)
        share[main] = 1.0
        for _ in range(30):
            power = np.maximum(certain @ np.abs(share) ** 2, 1e-300)
            shape = (certain * own) @ share.conj() / power
            power_of_input = np.maximum(np.abs(shape) ** 2 @ certain, 1e-300)
            share = (shape.conj() @ (certain * own)) / power_of_input
            share = share / share[main] if abs(share[main]) > 0.0 else share
        shapes[:, mode], participations[:, mode] = shape, share
        shape_errors[:, mode] = 1.0 / np.sqrt(np.maximum(certain @ np.abs(share) ** 2, 1e-300))
    return shapes, shape_errors, participations
