"""Gains of every law: from closed forms, from exact eigenvalues, or from a publication."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.optimize import minimize_scalar

from mrpipe.artifacts import FloatArray
from mrpipe.control import exact, limits
from mrpipe.control.calibration_settings import CalibrationSettings
from mrpipe.control.gains import Gains
from mrpipe.control.law import Law, Plant
from mrpipe.control.laws import all_laws, law_named, law_names
from mrpipe.control.lqg import Weights, frame_regulator_gain
from mrpipe.errors import UserError
from mrpipe.structures import Frame

Source = Literal["exact", "closed-form", "published"]

POSITIVE_SHARE, NEGATIVE_SHARE = 0.5, -0.8
"""Ratio of the stiffness of vdps and of vdns to the static stiffness at the damper. At -1 the structure becomes
unstable. The margin covers the error of an identified stiffness.
"""


@dataclass(frozen=True)
class LawCalibration:
    """Calibration of one law.

    Attributes
    ----------
    law
        Name.
    gains
        Gains with which the law runs.
    candidates
        Source (`published`, `closed-form`, `closed-form-thesis`, `exact`) -> gains.
    damping_ratio_estimate, damping_ratio_exact
        Damping ratio at `gains` by the closed form P2 (7), and by the complex eigenvalue of the frame without inherent
        damping; NaN if the law has no such value. Friction is replaced by its equivalent (4.24).
    damping_ratio_with_frame
        Exact damping ratio with the inherent damping of the frame.
    damping_ratio_clipped
        Damping ratio of the equivalent of the clipped law (laws with stiffness).
    unstable_pole_1_s
        Largest real part of the poles of the loop without clipping [1/s].
    """

    law: str
    gains: Gains
    candidates: Mapping[str, Gains]
    damping_ratio_estimate: float
    damping_ratio_exact: float
    damping_ratio_with_frame: float
    damping_ratio_clipped: float
    unstable_pole_1_s: float


@dataclass(frozen=True)
class Calibration:
    """Result of :func:`calibrate`.

    Attributes
    ----------
    modes
        Limiting modes of the target.
    static_stiffness_n_m
        Static stiffness of the structure at the damper [N/m], which is the limit of negative stiffness.
    laws
        Law -> its calibration.
    regulator_gain
        k of law lqg, shape (2n,).
    position
        Connectivity vector w of the damper, shape (n,).
    skipped
        Law that could not be calibrated -> reason.
    """

    modes: limits.LimitingModes
    static_stiffness_n_m: float
    laws: Mapping[str, LawCalibration]
    regulator_gain: FloatArray
    position: FloatArray
    skipped: Mapping[str, str] = field(default_factory=dict)


_SETTINGS = CalibrationSettings()
"""Source of the defaults, so that options and settings have the same ones."""


@dataclass(frozen=True)
class CalibrationOptions:
    """Options of the calibration of the laws.

    Attributes
    ----------
    mode
        Number of the target mode, from 1.
    source
        Source of the gains with which the laws run.
    published
        Law -> published gains.
    positive_stiffness_n_m, negative_stiffness_n_m
        k of vdps and of vdns, for which c is calibrated [N/m]; None: :data:`POSITIVE_SHARE` and :data:`NEGATIVE_SHARE`
        of the static stiffness at the damper.
    overrides
        Law -> gains (name -> value) that the user gives; the other gains are calibrated.
    weights
        Weights of the laws that are optimal regulators; None: :func:`balanced_weights` of the frame.

    Raises
    ------
    UserError
        If published gains are those of a law that does not exist, or the law has no such gain or another sign.
    """

    mode: int = _SETTINGS.target_mode
    source: Source = _SETTINGS.gains
    published: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    positive_stiffness_n_m: float | None = _SETTINGS.positive_stiffness_n_m
    negative_stiffness_n_m: float | None = _SETTINGS.negative_stiffness_n_m
    overrides: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    weights: Weights | None = None

    def __post_init__(self) -> None:
        for name, given in self.published.items():
            if name not in law_names():
                raise UserError("calibrate.published", name, "is not a control law", f"one of {', '.join(law_names())}")
            try:
                law_named(name).check_given(given)
            except UserError as error:
                raise UserError("calibrate.published", f"{name}.{error.where}", error.problem, error.remedy) from error


LARGEST_REGULATED = 1.0 / np.sqrt(2.0)
"""Largest damping ratio for which the weight of the force is chosen: without resonance in the response to a force."""

CHEAPEST = 1e-8
"""Smallest weight of the force that is tried, relative to the estimate."""

WEIGHT_TOLERANCE = 1e-3
"""Relative tolerance of the damping ratio for which the weight of the force is chosen."""


def balanced_weights(
    frame: Frame, position: FloatArray, modes: limits.LimitingModes, residual_force_n: float = 0.0, **given: float
) -> Weights:
    """Return weights whose regulator damps the target mode twice as much as optimal viscous damping does.

    Both damping ratios are exact: those of the complex eigenvalue of the structure without inherent damping, before
    the damper clips the force. The target is at most :data:`LARGEST_REGULATED`. If no weight of the force reaches it,
    the weight is the one of the largest damping ratio.

    Parameters
    ----------
    frame, position
        Structure and connectivity vector w of the damper, shape (n,).
    modes
        Limiting modes of the target.
    residual_force_n
        Residual force of the damper [N], taken as the noise of its force.
    given
        Weights that are given, by name; they replace the computed ones.

    Raises
    ------
    UserError
        If energy and top displacement both have no weight.
    """
    energy, top = given.get("energy", 1.0), given.get("top_displacement", 0.0)
    if energy <= 0.0 and top <= 0.0:
        where, key = "calibrate.regulator", "energy_weight"
        raise UserError(where, key, "is 0, and so is top_displacement_weight", "give a positive weight to one of them")
    weights = Weights(**{"force": 1.0, "force_noise_n": residual_force_n, **given})
    if "force" in given:
        return weights
    target = exact.target_mode(exact.undamped(frame), position, modes)
    viscous = exact.best_gain(
        lambda c: exact.stable_ratio(target.linear(c, 0.0)), 4.0 * limits.optimal_viscosity(modes)
    ).damping_ratio
    wanted = min(2.0 * viscous, LARGEST_REGULATED)

    def ratio(force: float) -> float:
        gain = frame_regulator_gain(frame, position, replace(weights, force=force))
        return exact.stable_ratio(target.feedback(gain))

    return replace(weights, force=_force_weight(ratio, wanted, _estimated_force_weight(weights, modes, wanted)))


def _estimated_force_weight(weights: Weights, modes: limits.LimitingModes, wanted: float) -> float:
    """Return the weight of the force for a small damping ratio of a single mode without inherent damping [1/N^2].

    For the cost e (omega^2 q^2 + q'^2) + t (phi q)^2 + R u^2 of an oscillator of unit mass, on which the force u acts
    through u_0, the damping ratio is u_0/(2 omega) sqrt((2 e + t phi^2/omega^2)/R). phi is the amplitude of the mode at
    the top.
    """
    cost = 2.0 * weights.energy + weights.top_displacement * (modes.top_0 / modes.omega_0) ** 2
    return cost * modes.u_0**2 / (4.0 * modes.omega_0**2 * wanted**2)


def _force_weight(ratio: Callable[[float], float], wanted: float, start: float) -> float:
    """Return the largest weight of the force with a damping ratio; the one of the largest ratio if none reaches it.

    The damping ratio rises with a smaller weight, at most until the poles come near to the zeros of the cost.
    """
    low, strong = start, ratio(start)
    while strong >= wanted:
        high, weak = 4.0 * low, ratio(4.0 * low)
        if weak < wanted:
            return _between(ratio, wanted, (high, weak), (low, strong))
        low, strong = high, weak
    high, weak = low, strong
    while low > CHEAPEST * start:
        low, strong = 0.25 * high, ratio(0.25 * high)
        if strong >= wanted:
            return _between(ratio, wanted, (high, weak), (low, strong))
        if strong < weak:
            break
        high, weak = low, strong
    bounds = (float(np.log(low)), float(np.log(4.0 * high)))
    found = minimize_scalar(lambda x: -ratio(float(np.exp(x))), bounds=bounds, method="bounded")
    return float(np.exp(found.x))


def _between(
    ratio: Callable[[float], float], wanted: float, weaker: tuple[float, float], stronger: tuple[float, float]
) -> float:
    """Return the weight of the force with a damping ratio, between two weights with their damping ratios.

    The damping ratio is nearly a power of the weight.
    """
    (high, weak), (low, strong) = weaker, stronger
    while strong > wanted * (1.0 + WEIGHT_TOLERANCE):
        share = np.log(wanted / weak) / np.log(strong / weak) if weak > 0.0 else 0.5
        middle = float(high * (low / high) ** min(max(share + 0.02, 0.05), 0.95))
        found = ratio(middle)
        if found < wanted:
            high, weak = middle, found
        else:
            low, strong = middle, found
    return low


def calibrate(
    frame: Frame, position: FloatArray, options: CalibrationOptions, laws: Sequence[Law] | None = None
) -> Calibration:
    """Calibrate every law on a frame with a damper along `position`, shape (n,).

    Parameters
    ----------
    frame, position, options
        Structure, connectivity vector of the damper, and options of the calibration.
    laws
        Laws to calibrate; None: all laws.

    Raises
    ------
    UserError
        If the frame or the position allows no calibration, or a given gain has the wrong sign.
    """
    plant = plant_of(frame, position, options)
    found, skipped = {}, {}
    for law in all_laws().values() if laws is None else laws:
        law.check_given(options.overrides.get(law.name, {}))
        if not law.calibrated:
            continue
        try:
            found[law.name] = calibrate_law(plant, law, options)
        except UserError as error:
            skipped[law.name] = str(error)
    return Calibration(
        plant.modes,
        plant.static_stiffness_n_m,
        found,
        frame_regulator_gain(frame, position, plant.weights),
        position,
        skipped,
    )


def plant_of(frame: Frame, position: FloatArray, options: CalibrationOptions) -> Plant:
    """Return the structure, the modes and the weights for which the laws are calibrated.

    Raises
    ------
    UserError
        If the frame or the position allows no calibration.
    """
    modes, static = limits.limiting_modes(frame, position, options.mode), limits.static_stiffness(frame, position)
    shares = {"vdps": POSITIVE_SHARE, "vdns": NEGATIVE_SHARE}
    chosen = {"vdps": options.positive_stiffness_n_m, "vdns": options.negative_stiffness_n_m}
    default = {law: shares[law] * static if k is None else k for law, k in chosen.items()}
    return Plant(
        frame=frame,
        bare=exact.undamped(frame),
        position=position,
        modes=modes,
        static_stiffness_n_m=static,
        # c is calibrated for the stiffness with which the law runs, which the user may give as a gain
        stiffness_n_m={law: options.overrides.get(law, {}).get("k_n_m", k) for law, k in default.items()},
        weights=balanced_weights(frame, position, modes) if options.weights is None else options.weights,
    )


def calibrate_law(plant: Plant, law: Law, options: CalibrationOptions) -> LawCalibration:
    """Return the gains of a law from every source, the gains with which it runs, and the damping that these give.

    Raises
    ------
    UserError
        If a given gain is unknown or has the wrong sign, or the law cannot be calibrated for this plant.
    """
    candidates = dict(law.candidates(plant))
    if law.name in options.published:
        candidates = {"published": Gains(**options.published[law.name]), **candidates}
    gains = candidates.get(options.source, candidates.get("exact", Gains()))
    gains = gains.changed(**options.overrides.get(law.name, {}))
    law.check(gains)
    return LawCalibration(law.name, gains, candidates, **vars(law.assess(plant, gains)))
