"""Errors on validation records, their recoverable share, and the states that a residual depends on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from threadpoolctl import threadpool_limits

from mrpipe.artifacts import FloatArray
from mrpipe.signals.reversals import path_since_reversal
from mrpipe.tracing.step_function import explained_share
from mrpipe.tracing.structure.model import FrameModel, in_time
from mrpipe.tracing.structure.spectra import Spectra
from mrpipe.tracing.verdict import Score

LAGS = (0.03, 0.1, 0.3, 0.8)
"""Numerical technique: lags of the states that the flexible model reads, in periods of the lowest mode."""

MOST_ROWS = 8000
"""Numerical technique: largest number of samples that the flexible model is trained on."""


def frame_score(model: FrameModel, records: Sequence[Spectra]) -> Score:
    """Return the errors of the storey shear forces over all storeys and records, weighted by the sensor noise."""
    errors, wholes, own = 0.0, 0.0, {}
    for record in records:
        error = float(np.sum(np.abs((record.target - model.predict(record)) * record.weight) ** 2))
        whole = float(np.sum(np.abs(record.target * record.weight) ** 2))
        own[record.record.name] = _nrmse(error, whole)
        errors, wholes = errors + error, wholes + whole
    nrmse = _nrmse(errors, wholes)
    return Score(nrmse, 100.0 * (1.0 - nrmse), own)


def noise_floor(records: Sequence[Spectra], scale: FloatArray) -> float:
    """Return the NRMSE that sensor noise alone causes; `scale` is the mean square of the noise of each storey."""
    errors = sum(2.0 * float(np.sum(scale)) * item.frequencies_hz.size for item in records)
    wholes = sum(float(np.sum(np.abs(item.target * item.weight) ** 2)) for item in records)
    return _nrmse(errors, wholes)


def _nrmse(squared_errors: float, squared_signals: float) -> float:
    return float(np.sqrt(squared_errors / max(squared_signals, 1e-300)))


def residual_in_time(model: FrameModel, record: Spectra) -> FloatArray:
    """Return the residual of the shear force of each storey in the band, shape (m, n) [N]."""
    return in_time(record.in_storeys(record.target - model.predict(record)), record)


def states_of(record: Spectra, storey: int) -> dict[str, FloatArray]:
    """Return the states that the residual of a storey may depend on, each of shape (m,)."""
    motion, dt = record.motion, record.record.dt
    drift, rate = motion.drift[storey], motion.drift_rate[storey]
    time = np.arange(len(drift)) * dt
    floor = motion.state_displacement[:, storey]
    return {
        "drift": drift,
        "drift rate": rate,
        "slip since reversal": path_since_reversal(rate, dt) * np.sign(rate),
        "floor displacement": floor,
        "floor velocity": motion.state_velocity[:, storey],
        "ground acceleration": motion.ground,
        "time in test": time,
    }


def _features(record: Spectra, storey: int, period_s: float) -> FloatArray:
    states = states_of(record, storey)
    columns = list(states.values())[:6]
    for lag in LAGS:
        shift = max(1, round(lag * period_s * record.record.rate_hz))
        columns += [np.concatenate([np.full(shift, values[0]), values[:-shift]]) for values in columns[:2]]
    return np.column_stack(columns)


def flexible_score(
    model: FrameModel,
    training: Sequence[Spectra],
    validation: Sequence[Spectra],
    storeys: Sequence[int],
    period_s: float,
) -> float:
    """Return the NRMSE on validation records of the model plus boosted trees for the residual of some storeys.

    Parameters
    ----------
    model
        The frame with its effects.
    training, validation
        Records that the trees are trained on, and records that are judged.
    storeys
        Storeys, from 0, whose residual the trees predict.
    period_s
        Period of the lowest mode [s]; the lags of the states are shares of it.
    """
    extra = [np.zeros_like(item.motion.acceleration) for item in validation]
    for storey in storeys:
        x = np.concatenate([_features(item, storey, period_s) for item in training])
        y = np.concatenate([residual_in_time(model, item)[:, storey] for item in training])
        step = max(1, len(y) // MOST_ROWS)
        trees = HistGradientBoostingRegressor(
            max_iter=40,
            learning_rate=0.15,
            max_leaf_nodes=24,
            min_samples_leaf=60,
            # without early stopping, and with so few samples, the trees draw no random number
            random_state=0,
            early_stopping=False,
        )
        with threadpool_limits(1):
            trees.fit(x[::step], y[::step])
            for item, force in zip(validation, extra, strict=True):
                force[:, storey] = trees.predict(_features(item, storey, period_s))
    errors = wholes = 0.0
    for item, force in zip(validation, extra, strict=True):
        # the trees are trained on a tapered, band-limited residual: compare the sum on the same lines
        left = item.target - model.predict(item) - item.in_equations(item.lines_of(force))
        errors += float(np.sum(np.abs(left * item.weight) ** 2))
        wholes += float(np.sum(np.abs(item.target * item.weight) ** 2))
    return _nrmse(errors, wholes)


def dependence(model: FrameModel, records: Sequence[Spectra], storey: int) -> list[tuple[str, float]]:
    """Return (state, share of a storey's residual that a step function of it explains), judged on left-out seconds."""
    residual = np.concatenate([residual_in_time(model, item)[:, storey] for item in records])
    block = np.concatenate([(np.arange(len(item.taper)) * item.record.dt).astype(int) for item in records])
    parts = [states_of(item, storey) for item in records]
    positive = np.concatenate([part["drift rate"] > 0.0 for part in parts])
    found = [
        (name, explained_share(residual, np.concatenate([part[name] for part in parts]), positive, block % 2 == 0))
        for name in parts[0]
    ]
    return sorted(found, key=lambda item: -item[1])
