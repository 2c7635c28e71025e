"""Options of the identification, which are also the settings of its stage."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class IdentificationOptions(BaseModel):
    """Options of the identification of a frame from its forced, ambient and decay tests."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    band_low_hz: float = Field(
        0.2, gt=0.0, description="Lower end of the band in which modes are searched (section 3.2.1)."
    )
    band_high_hz: float = Field(
        0.0,
        ge=0.0,
        description="Upper end of the band (14 Hz in the thesis); 0: up to the highest frequency of the excitation.",
    )
    damping_from: Literal["decay", "sweep"] = Field(
        "decay",
        description="Damping ratios for C: `decay` (from free decays if a mode has one, else from the sweep) or "
        "`sweep`.",
    )
    decay_method: Literal["exponential-fit", "logarithmic-decrement", "point-to-point", "linear-fit"] = Field(
        "exponential-fit",
        description="Method by which the damping ratio is computed from a decay (section 3.2.2): exponential fit to "
        "the motion, logarithmic decrement (3.1), mean from peak to peak, or a straight line through the peaks. An "
        "uncertain exponential fit is combined with the value of the sweep; the other three values are used as they "
        "are.",
    )
    modes_from: Literal["fit", "peak-picking"] = Field(
        "fit",
        description="Method for frequencies and shapes: multi-mode fit of all forced tests, or, as in the thesis, "
        "magnitude and phase at the peaks of the transfer functions (3.4). Peak picking needs a measured excitation.",
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
        description="Whether the measured shapes are replaced by the nearest ones that are orthogonal to the mass, "
        "weighted by their certainty. This is not done if the measured shapes contradict it, or if shapes are given.",
    )
    clock_correction: bool = Field(
        True,
        description="Whether clock offset and drift of each sensor are estimated, and corrected if the data support "
        "it.",
    )
    amplitude_dependence: bool = Field(
        True,
        description="Whether modes with amplitude-dependent frequency and damping are fitted. They are used if they "
        "predict tests left out of the fit better than constant modes. M, C and K remain those of constant modes. "
        "This is not done with `modes_from: peak-picking`, because the accuracy of picked modes is one line of the "
        "spectrum.",
    )
