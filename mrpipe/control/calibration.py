"""Gains of every law, three ways: as the thesis ran them, by closed form, by the exact eigenvalue."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.control import exact, limits
from mrpipe.control.controller import Gains
from mrpipe.control.linearisation import clipped_linear_stiffness, friction_stiffness
from mrpipe.control.lqg import Weights, regulator_gain
from mrpipe.errors import UserError
from mrpipe.structures import Frame, state_space

Source = Literal["thesis", "closed-form", "exact"]

THESIS_GAINS: dict[str, Gains] = {
    "vd": Gains(c_n_s_m=650.0),
    "vdps": Gains(c_n_s_m=400.0, k_n_m=2500.0),
    "vdns": Gains(c_n_s_m=250.0, k_n_m=-4500.0),
    "fdns": Gains(alpha_n_m=3000.0),
    "nnc": Gains(alpha_n_m=3000.0),
}
"""What the thesis and P2 ran (Table 5.1; errata section B, row 13 for k of vdns)."""


@dataclass(frozen=True)
class LawCalibration:
    """One law.

    Attributes
    ----------
    law
        Name.
    gains
        Those to run with.
    candidates
        Source (`thesis`, `closed-form`, `closed-form-thesis`, `exact`) -> gains.
    damping_ratio_estimate, damping_ratio_exact
        At `gains`: closed form P2 (7), and complex eigenvalue of the frame without its own damping; NaN where there is
        none. Friction by its equivalent (4.24).
    damping_ratio_with_frame
        The exact one with the frame's own damping.
    damping_ratio_clipped
        Of the equivalent of the clipped law (laws with stiffness).
    unstable_pole_1_s
        Largest real part of the unclipped loop's poles.
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
    """All that calibrate finds.

    Attributes
    ----------
    modes
        Limiting modes of the target.
    static_stiffness_n_m
        At the damper: limit of negative stiffness.
    laws
        Law -> its calibration.
    regulator_gain
        k of law lqg, shape (2n,).
    """

    modes: limits.LimitingModes
    static_stiffness_n_m: float
    laws: Mapping[str, LawCalibration]
    regulator_gain: FloatArray


@dataclass(frozen=True)
class CalibrationOptions:
    """What is calibrated.

    Attributes
    ----------
    mode
        Target, from 1.
    source
        Which gains the laws run with.
    positive_stiffness_n_m, negative_stiffness_n_m
        k of vdps and vdns where c is calibrated for it.
    overrides
        Gains of the user's own for a law.
    weights
        Of lqg.
    """

    mode: int = 1
    source: Source = "thesis"
    positive_stiffness_n_m: float = 2500.0
    negative_stiffness_n_m: float = -4500.0
    overrides: Mapping[str, Gains] = field(default_factory=dict)
    weights: Weights = field(default_factory=Weights)


def calibrate(frame: Frame, position: FloatArray, options: CalibrationOptions) -> Calibration:
    """Calibrate every law on a frame with a damper along `position`, shape (n,).

    Raises
    ------
    UserError
        If the frame or the position allows no calibration, or a given gain has the wrong sign.
    """
    modes = limits.limiting_modes(frame, position, options.mode)
    bare = exact.undamped(frame)
    laws: dict[str, LawCalibration] = {}
    for law in ("vd", "vdps", "vdns", "fdns", "nnc"):
        candidates = candidate_gains(bare, position, modes, law, options)
        gains = options.overrides.get(law, candidates[options.source])
        _check_signs(law, gains)
        laws[law] = assess(frame, position, modes, law, gains, candidates)
    regulator = regulator_gain(frame, position, options.weights)
    laws["lqg"] = _assess_regulator(frame, bare, position, modes, regulator)
    return Calibration(modes, limits.static_stiffness(frame, position), laws, regulator)


def candidate_gains(
    bare: Frame, position: FloatArray, modes: limits.LimitingModes, law: str, options: CalibrationOptions
) -> dict[str, Gains]:
    """Return the gains of a law by source; `bare` is the frame without its own damping."""
    found = {"thesis": THESIS_GAINS[law]}
    if law in {"fdns", "nnc"}:
        found["closed-form"] = Gains(alpha_n_m=limits.optimal_friction(modes))
        best = exact.best_gain(lambda alpha: _ratio(exact.exact_friction(bare, position, modes, alpha)), 2.0 / modes.nu)
        found["exact"] = Gains(alpha_n_m=best.gain)
        return found
    k = {"vd": 0.0, "vdps": options.positive_stiffness_n_m, "vdns": options.negative_stiffness_n_m}[law]
    found["closed-form"] = Gains(limits.optimal_viscosity(modes, k), k)
    found["closed-form-thesis"] = Gains(limits.optimal_viscosity_thesis(modes, k), k)
    largest = 4.0 * limits.optimal_viscosity(modes)

    def ratio(c: float) -> float:
        if k < 0.0:
            # without clipping negative stiffness can make the structure fold, so the clipped law is what is tuned
            H = clipped_linear_stiffness(c, k, modes.omega_0)
            return _ratio(exact.exact_equivalent(bare, position, modes, H))
        return _ratio(exact.exact_damping(bare, position, modes, c, k))

    found["exact"] = Gains(exact.best_gain(ratio, largest).gain, k)
    return found


def _ratio(answer: exact.ExactDamping) -> float:
    return answer.damping_ratio if answer.stable else -1.0


def _check_signs(law: str, gains: Gains) -> None:
    where = f"calibrate.gains_{law}"
    if gains.c_n_s_m < 0.0 or gains.alpha_n_m < 0.0:
        raise UserError(where, "c_n_s_m or alpha_n_m", "is negative", "a damper takes energy out: give a positive gain")
    if law == "vdps" and gains.k_n_m < 0.0:
        raise UserError(where, "k_n_m", f"is {gains.k_n_m:g}", "positive stiffness is meant; vdns has the negative one")
    if law == "vdns" and gains.k_n_m > 0.0:
        raise UserError(where, "k_n_m", f"is {gains.k_n_m:g}", "negative stiffness is meant; vdps has the positive one")


def assess(
    frame: Frame,
    position: FloatArray,
    modes: limits.LimitingModes,
    law: str,
    gains: Gains,
    candidates: Mapping[str, Gains],
) -> LawCalibration:
    """Return estimate and exact damping of a linear or friction law at its gains."""
    bare = exact.undamped(frame)
    clipped = float("nan")
    if law in {"fdns", "nnc"}:
        H = friction_stiffness(gains.alpha_n_m)
        without, with_frame = (exact.exact_equivalent(item, position, modes, H) for item in (bare, frame))
    else:
        H = complex(gains.k_n_m, gains.c_n_s_m * modes.omega_0)
        without, with_frame = (
            exact.exact_damping(item, position, modes, gains.c_n_s_m, gains.k_n_m) for item in (bare, frame)
        )
        if gains.k_n_m:
            equivalent = clipped_linear_stiffness(gains.c_n_s_m, gains.k_n_m, modes.omega_0)
            clipped = exact.exact_equivalent(bare, position, modes, equivalent).damping_ratio
    return LawCalibration(
        law=law,
        gains=gains,
        candidates=candidates,
        damping_ratio_estimate=limits.damping_estimate(modes, H.real, H.imag),
        damping_ratio_exact=without.damping_ratio,
        damping_ratio_with_frame=with_frame.damping_ratio,
        damping_ratio_clipped=clipped,
        unstable_pole_1_s=with_frame.unstable_pole,
    )


def _assess_regulator(
    frame: Frame, bare: Frame, position: FloatArray, modes: limits.LimitingModes, gain: FloatArray
) -> LawCalibration:
    """Follow the target's pole while the unclipped regulator is faded in."""
    answers = []
    for item in (bare, frame):
        space = state_space(item, position)
        pole = complex(0.0, modes.omega_0)
        poles = np.zeros(0, dtype=np.complex128)
        for share in np.linspace(0.0, 1.0, exact.CONTINUATION_STEPS + 1):
            poles = np.asarray(np.linalg.eigvals(space.A - share * np.outer(space.B[:, 1], gain)))
            upper = poles[poles.imag >= -1e-9]
            pole = complex(upper[np.argmin(np.abs(upper - pole))])
        answers.append(exact.ExactDamping(pole, float(np.max(poles.real))))
    without, with_frame = answers
    nan = float("nan")
    return LawCalibration(
        "lqg", Gains(), {}, nan, without.damping_ratio, with_frame.damping_ratio, nan, with_frame.unstable_pole
    )


def validity_warnings(
    calibration: Calibration,
    *,
    amplitude_m: float,
    residual_force_n: float,
    largest_force_n: float,
) -> list[str]:
    """Return what the user should know before running the laws, a sentence each.

    Parameters
    ----------
    calibration
        Of all laws.
    amplitude_m
        Damper amplitude at which forces are judged.
    residual_force_n, largest_force_n
        Of the damper at that speed, at no drive and at its limit.
    """
    said = []
    limit = calibration.static_stiffness_n_m
    omega = calibration.modes.omega_0
    for law, item in calibration.laws.items():
        k, alpha = item.gains.k_n_m, item.gains.alpha_n_m
        negative = max(-k, alpha)
        if negative > limit:
            said.append(
                f"{law}: negative stiffness of {-negative:.0f} N/m is beyond the static limit of {-limit:.0f} N/m at "
                f"the damper; unclipped, its fastest pole is {item.unstable_pole_1_s:+.2f} rad/s"
            )
        elif negative > 0.9 * limit:
            said.append(
                f"{law}: negative stiffness is at {negative / limit:.0%} of the static limit of {-limit:.0f} N/m"
            )
        needed = needed_force(item.gains, amplitude_m, omega)
        if needed <= 0.0:
            continue
        if needed > largest_force_n:
            said.append(f"{law}: needs {needed:.0f} N, but the damper gives at most {largest_force_n:.0f} N")
        if residual_force_n > 0.3 * needed:
            said.append(
                f"{law}: the residual force of {residual_force_n:.0f} N is {residual_force_n / needed:.0%} of the "
                f"{needed:.0f} N needed at {1e3 * amplitude_m:.1f} mm: it limits the law, not saturation"
            )
    return said


def needed_force(gains: Gains, amplitude_m: float, omega: float) -> float:
    """Return the largest force [N] that a law asks for in harmonic motion of the damper, after clipping."""
    if gains.alpha_n_m:
        return 2.0 * gains.alpha_n_m * amplitude_m
    # c v + k x has its largest value where it is still dissipative, or at an extremum
    return float(amplitude_m * np.hypot(gains.c_n_s_m * omega, gains.k_n_m))


def gains_to_json(law: str, gains: Gains) -> dict[str, Any]:
    """Return the gains that a law has, keys with units."""
    if law in {"fdns", "nnc"}:
        return {"alpha_n_m": gains.alpha_n_m}
    entry = {"c_n_s_m": gains.c_n_s_m}
    return entry if law == "vd" else {**entry, "k_n_m": gains.k_n_m}


def with_gains(calibration: Calibration, law: str, gains: Gains) -> Calibration:
    """Return the calibration with other gains of one law (not assessed anew)."""
    changed = replace(calibration.laws[law], gains=gains)
    return replace(calibration, laws={**calibration.laws, law: changed})
