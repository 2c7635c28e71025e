"""Choices of the identification: the same model is the domain's options and the settings of its stage."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class IdentificationOptions(BaseModel):
    """How the frame is identified from its forced, ambient and decay tests."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    band_low_hz: float = Field(
        0.2, gt=0.0, description="Lower end of the band in which modes are looked for (section 3.2.1)."
    )
    band_high_hz: float = Field(
        0.0,
        ge=0.0,
        description="Upper end of the band (14 Hz in the thesis); 0 means up to where the excitation ends.",
    )
    damping_from: Literal["decay", "sweep"] = Field(
        "decay",
        description="Damping ratios that go into C: `decay` (where a mode has such a test, else the sweep) or `sweep`.",
    )
    decay_method: Literal["exponential-fit", "logarithmic-decrement", "point-to-point", "linear-fit"] = Field(
        "exponential-fit",
        description="How the damping ratio is read from a decay (section 3.2.2): exponential fit to the motion, "
        "logarithmic decrement (3.1), mean from peak to peak, or a straight line through the peaks. Of the last three "
        "the value counts as it is; an uncertain exponential fit is pooled with the sweep.",
    )
    modes_from: Literal["fit", "peak-picking"] = Field(
        "fit",
        description="Frequencies and shapes: multi-mode fit of all forced tests, or as the thesis: magnitude and phase "
        "at the peaks of the transfer functions (3.4). Peaks need a measured excitation.",
    )
    ambient_method: Literal["ssi", "plscf"] = Field(
        "ssi",
        description="Estimator of the poles of ambient tests, both of pyOMA2: covariance-driven stochastic subspace "
        "identification (`ssi`) or the polyreference least-squares complex frequency estimator (`plscf`).",
    )
    stiffness_form: Literal["modal", "tridiagonal"] = Field(
        "modal", description="K from the modes, (3.14) to (3.16), or the tri-diagonal shear frame nearest to them."
    )
    orthogonal_shapes: bool = Field(
        True,
        description="Take the nearest shapes that are orthogonal to the mass, each weighted by its certainty; not done "
        "where the measured shapes contradict it, or where shapes are given.",
    )
    clock_correction: bool = Field(
        True,
        description="Estimate the clock offset and drift of each sensor and correct them where the data support it.",
    )
    amplitude_dependence: bool = Field(
        True,
        description="Look for modes whose frequency and damping depend on the amplitude; used where they predict tests "
        "that were left out of the fit better than constant modes. M, C and K remain those of constant modes. Not done "
        "with `modes_from: peak-picking`, because picked modes are no more exact than a line of the spectrum.",
    )
