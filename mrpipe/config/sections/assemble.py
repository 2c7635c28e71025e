"""Settings of `assemble`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.networks.scaling import NORMALISATION, Normalisation
from mrpipe.options import Section

ForwardInput = Literal["displacement", "velocity", "acceleration", "drive"]
InverseInput = Literal["displacement", "velocity", "acceleration", "force"]


class AssembleSettings(Section):
    """What goes into the training set and what the networks see of it."""

    cycles: int = Field(
        10, ge=1, description="Steady cycles of each periodic test, joined at zero crossings of displacement."
    )
    sampling_rate_hz: float = Field(
        200.0,
        gt=0.0,
        description="Rate of the networks; the record is decimated by the nearest whole factor, or kept where slower.",
    )
    past_values: int = Field(3, ge=0, le=50, description="Past values of each input, in addition to the present one.")
    forward_inputs: tuple[ForwardInput, ...] = Field(
        ("velocity", "drive"), min_length=1, description="Input channels of the forward network, in order (2.8)."
    )
    forward_past_force: bool = Field(
        False, description="Past values of the force are inputs of the forward network too; then it can run freely."
    )
    inverse_inputs: tuple[InverseInput, ...] = Field(
        ("velocity", "force"), min_length=1, description="Input channels of the inverse network, in order (2.9)."
    )
    inverse_absolute: bool = Field(True, description="The inverse network sees absolute values, as in (2.9).")
    normalisation: Normalisation = Field(
        NORMALISATION,
        description="Normalisation of inputs and target: `maximum` keeps zero at zero, `range` maps to -1 .. 1 "
        "(MATLAB's mapminmax), `standard` to zero mean and unit variance.",
    )
