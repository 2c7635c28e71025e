"""Random draws of frames and dampers from the uncertainty of their identification."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.dampers.model import DamperModel
from mrpipe.structures import Frame, natural_modes


@dataclass(frozen=True)
class FrameUncertainty:
    """Standard deviations of the modal parameters of a frame.

    Attributes
    ----------
    frequency_relative
        Standard deviation of each natural frequency over the frequency, shape (n,) [1].
    damping_ratio
        Standard deviation of each damping ratio, shape (n,) [1].
    """

    frequency_relative: FloatArray
    damping_ratio: FloatArray

    @classmethod
    def none(cls, floors: int) -> FrameUncertainty:
        """Return that of a frame of known matrices."""
        return cls(np.zeros(floors), np.zeros(floors))

    @property
    def exists(self) -> bool:
        """Whether anything is uncertain."""
        return bool(self.frequency_relative.any() or self.damping_ratio.any())


@dataclass(frozen=True)
class DamperUncertainty:
    """Covariance of the parameters of a damper, and its model error.

    Attributes
    ----------
    names
        Parameters of the covariance, length p.
    covariance
        Shape (p, p), units of the parameters.
    force_relative
        Standard deviation of a common factor on the force [1]: the error of the model on tests that it was not fitted
        to. The covariance alone says only how well this form of model is determined.
    effects
        `<effect>.<parameter>` -> standard deviation of a parameter of a traced effect, in its unit.
    """

    names: tuple[str, ...]
    covariance: FloatArray
    force_relative: float = 0.0
    effects: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def without_covariance(cls, force_relative: float = 0.0) -> DamperUncertainty:
        """Return that of a damper of known parameters, with the error of its model."""
        return cls((), np.zeros((0, 0)), force_relative)

    @property
    def exists(self) -> bool:
        """Whether anything is uncertain."""
        return bool(self.covariance.any() or self.force_relative or self.effects)


@dataclass(frozen=True)
class Draw:
    """One realisation of structure and damper.

    Attributes
    ----------
    frame, damper
        The realisation.
    force_factor
        Factor on the damper force.
    numbers
        Uncertain quantity -> deviation in standard deviations, for the sensitivities.
    """

    frame: Frame
    damper: DamperModel
    force_factor: float
    numbers: Mapping[str, float]


def draw(
    frame: Frame,
    damper: DamperModel,
    frame_uncertainty: FrameUncertainty,
    damper_uncertainty: DamperUncertainty,
    rng: np.random.Generator,
) -> Draw:
    """Draw one structure and one damper.

    Parameters
    ----------
    frame, damper
        As identified.
    frame_uncertainty, damper_uncertainty
        Uncertainty of the frame and of the damper.
    rng
        Generator of the draw.
    """
    numbers: dict[str, float] = {}
    drawn_frame = _drawn_frame(frame, frame_uncertainty, rng, numbers)
    drawn_damper = _drawn_damper(damper, damper_uncertainty, rng, numbers)
    force = rng.standard_normal()
    numbers["damper_force"] = float(force)
    factor = max(0.1, 1.0 + damper_uncertainty.force_relative * float(force))
    return Draw(drawn_frame, drawn_damper, factor, numbers)


def _drawn_frame(
    frame: Frame, uncertainty: FrameUncertainty, rng: np.random.Generator, numbers: dict[str, float]
) -> Frame:
    """Change frequencies and damping ratios of the modes; masses and mode shapes stay.

    K + M Phi diag(omega'^2 - omega^2) Phi' M with mass-normalised Phi has the changed frequencies; C likewise.
    """
    modes = natural_modes(frame)
    omega, shapes = modes.angular_frequencies, modes.mode_shapes
    shapes = shapes / np.sqrt(np.einsum("im,ij,jm->m", shapes, frame.mass, shapes))
    z_omega, z_damping = rng.standard_normal((2, len(omega)))
    numbers.update({f"frequency_{k + 1}": float(z) for k, z in enumerate(z_omega)})
    numbers.update({f"damping_ratio_{k + 1}": float(z) for k, z in enumerate(z_damping)})
    changed = omega * (1.0 + uncertainty.frequency_relative * z_omega)
    ratio = np.diag(shapes.T @ frame.damping @ shapes) / (2.0 * omega)
    drawn = np.maximum(ratio + uncertainty.damping_ratio * z_damping, 0.1 * ratio)
    left = frame.mass @ shapes
    stiffness = frame.stiffness + (left * (changed**2 - omega**2)) @ left.T
    damping = frame.damping + (left * (2.0 * drawn * changed - 2.0 * ratio * omega)) @ left.T
    return replace(frame, damping=damping, stiffness=stiffness)


def _drawn_damper(
    damper: DamperModel, uncertainty: DamperUncertainty, rng: np.random.Generator, numbers: dict[str, float]
) -> DamperModel:
    """Draw the parameters of base form and effects; a parameter keeps its sign and at least a tenth of its size."""
    parameters = _drawn_base(damper.parameters, uncertainty, rng, numbers) if uncertainty.names else damper.parameters
    effects = []
    for item in damper.effects:
        values = dict(item.values)
        for name, nominal in item.values.items():
            key = f"{item.name}.{name}"
            sigma = uncertainty.effects.get(key, 0.0)
            if sigma > 0.0:
                numbers[key] = float(rng.standard_normal())
                values[name] = _kept_sign(nominal, nominal + sigma * numbers[key])
        effects.append(replace(item, values=values))
    return replace(damper, parameters=parameters, effects=tuple(effects))


def _drawn_base(
    known: Mapping[str, float], uncertainty: DamperUncertainty, rng: np.random.Generator, numbers: dict[str, float]
) -> dict[str, float]:
    deviation = np.sqrt(np.maximum(np.diag(uncertainty.covariance), 0.0))
    values, vectors = np.linalg.eigh(uncertainty.covariance)
    step = vectors @ (np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(len(values)))
    parameters = dict(known)
    for name, change, sigma in zip(uncertainty.names, step, deviation, strict=True):
        if name not in parameters or sigma == 0.0:
            continue
        numbers[name] = float(change / sigma)
        parameters[name] = _kept_sign(parameters[name], parameters[name] + float(change))
    return parameters


def _kept_sign(nominal: float, changed: float) -> float:
    """Return a drawn value that keeps the sign and at least a tenth of the size of the nominal one."""
    return changed if changed * nominal > 0.1 * nominal**2 else 0.1 * nominal


@dataclass(frozen=True)
class Ranking:
    """Certainty of the choice of the law.

    Attributes
    ----------
    probability_best
        Law -> share of draws in which it has the smallest objective.
    regret
        Mean excess of the chosen law's objective over the best one of each draw [1].
    regret_p90
        Regret that one draw in ten exceeds [1].
    sensitivities
        Uncertain quantity -> rank correlation with the lead of the chosen law over the runner-up, largest first.
    values
        Law -> objective in each draw, shape (draws,).
    """

    probability_best: Mapping[str, float]
    regret: float
    regret_p90: float
    sensitivities: Mapping[str, float]
    values: Mapping[str, FloatArray]


def rank(laws: Sequence[str], chosen: str, draws: Sequence[Draw], values: FloatArray) -> Ranking:
    """Compare the laws over all draws.

    Parameters
    ----------
    laws, chosen
        Laws that are compared, and the one that the design chose.
    draws
        Realisations, which are the same for all laws.
    values
        Objective of each law in each draw, shape (draws, laws).
    """
    best = np.argmin(values, axis=1)
    place = laws.index(chosen)
    regret = values[:, place] / values.min(axis=1) - 1.0
    others = np.delete(values, place, axis=1)
    lead = others.min(axis=1) - values[:, place] if others.size else np.zeros(len(draws))
    return Ranking(
        {law: float(np.mean(best == k)) for k, law in enumerate(laws)},
        float(np.mean(regret)),
        float(np.quantile(regret, 0.9)),
        _sensitivities(draws, lead),
        {law: values[:, k] for k, law in enumerate(laws)},
    )


def _sensitivities(draws: Sequence[Draw], lead: FloatArray) -> dict[str, float]:
    from scipy.stats import spearmanr

    if len(draws) < 4 or np.ptp(lead) == 0.0:
        return {}
    found = {}
    for name in draws[0].numbers:
        column = np.array([item.numbers[name] for item in draws])
        if np.ptp(column) > 0.0:
            found[name] = float(spearmanr(column, lead).statistic)
    return dict(sorted(found.items(), key=lambda item: -abs(item[1])))


def test_for(parameter: str) -> str:
    """Return the test that determines an uncertain quantity better."""
    if parameter.startswith("frequency_"):
        return f"slow sweep of the structure through mode {parameter.rpartition('_')[2]} at the amplitude of operation"
    if parameter.startswith("damping_ratio_"):
        return f"free decay of the structure in mode {parameter.rpartition('_')[2]}"
    if parameter == "damper_force":
        return "repeat of the damper's validation tests on another day and at the temperature of operation"
    if parameter == "eta":
        return "steps of the drive at constant velocity of the damper"
    if parameter.startswith("c0"):
        return "triangular motion of the damper at several speeds, at the drive of operation"
    if "." in parameter:
        effect = parameter.partition(".")[0]
        return f"more bench tests that excite {effect}; the page on effects lists suitable tests"
    return "slow triangular motion of the damper at drives between zero and the limit"
