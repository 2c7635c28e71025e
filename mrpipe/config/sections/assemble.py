"""Settings of `assemble`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.networks.scaling import NORMALISATION, Normalisation
from mrpipe.options import Section

ForwardInput = Literal["displacement", "velocity", "acceleration", "drive"]
InverseInput = Literal["displacement", "velocity", "acceleration", "force"]


class AssembleSettings(Section):
    """Content of the training set, and the features of the networks."""

    cycles: int = Field(
        10,
        ge=1,
        description="Number of steady cycles of each periodic test, joined at zero crossings of the displacement.",
    )
    sampling_rate_hz: float = Field(
        200.0,
        gt=0.0,
        description="Sampling rate of the networks; records are decimated by the nearest integer factor, and slower "
        "records are not changed.",
    )
    past_values: int = Field(
        3, ge=0, le=50, description="Number of past values of each input, in addition to the present one."
    )
    forward_inputs: tuple[ForwardInput, ...] = Field(
        ("velocity", "drive"), min_length=1, description="Input channels of the forward network, in order (2.8)."
    )
    forward_past_force: bool = Field(
        False,
        description="Whether past values of the force are inputs of the forward network too; it can then run without "
        "measured forces.",
    )
    inverse_inputs: tuple[InverseInput, ...] = Field(
        ("velocity", "force"), min_length=1, description="Input channels of the inverse network, in order (2.9)."
    )
    inverse_absolute: bool = Field(
        True, description="Whether the inputs of the inverse network are absolute values, as in (2.9)."
    )
    normalisation: Normalisation = Field(
        NORMALISATION,
        description="Normalisation of inputs and target: `maximum` keeps zero at zero, `range` maps to -1 .. 1 "
        "(MATLAB's mapminmax), `standard` to zero mean and unit variance.",
    )
