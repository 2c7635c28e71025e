"""Mass, damping and stiffness of structures."""

from mrpipe.structures.dynamics import (
    ComplexModes,
    NaturalModes,
    StateSpace,
    complex_modes,
    discretise_first_order,
    discretise_zero_order,
    floor_position,
    frequency_response,
    modal_assurance,
    natural_modes,
    normalise_to_largest,
    state_space,
    storey_position,
)
from mrpipe.structures.frame import Frame, read_frame, write_frame
from mrpipe.structures.shear_frame import (
    frame_from_modes,
    frame_from_parameter_set,
    mass_matrix,
    modal_damping_matrix,
    shear_frame,
    shear_stiffness,
)

__all__ = [
    "ComplexModes",
    "Frame",
    "NaturalModes",
    "StateSpace",
    "complex_modes",
    "discretise_first_order",
    "discretise_zero_order",
    "floor_position",
    "frame_from_modes",
    "frame_from_parameter_set",
    "frequency_response",
    "mass_matrix",
    "modal_assurance",
    "modal_damping_matrix",
    "natural_modes",
    "normalise_to_largest",
    "read_frame",
    "shear_frame",
    "shear_stiffness",
    "state_space",
    "storey_position",
    "write_frame",
]
