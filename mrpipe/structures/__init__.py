"""Mass, damping and stiffness of structures.

The names below are imported at first use, because the configuration needs the settings of a structure without scipy.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mrpipe.structures.dynamics import (
        ComplexModes,
        NaturalModes,
        StateSpace,
        complex_modes,
        floor_position,
        frequency_response,
        modal_assurance,
        natural_modes,
        normalise_to_largest,
        state_space,
        storey_position,
    )
    from mrpipe.structures.frame import Frame, read_frame, write_frame
    from mrpipe.structures.shear_frames import (
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

_HOMES = {
    "ComplexModes": "dynamics",
    "NaturalModes": "dynamics",
    "StateSpace": "dynamics",
    "complex_modes": "dynamics",
    "floor_position": "dynamics",
    "frequency_response": "dynamics",
    "modal_assurance": "dynamics",
    "natural_modes": "dynamics",
    "normalise_to_largest": "dynamics",
    "state_space": "dynamics",
    "storey_position": "dynamics",
    "Frame": "frame",
    "read_frame": "frame",
    "write_frame": "frame",
    "frame_from_modes": "shear_frames",
    "frame_from_parameter_set": "shear_frames",
    "mass_matrix": "shear_frames",
    "modal_damping_matrix": "shear_frames",
    "shear_frame": "shear_frames",
    "shear_stiffness": "shear_frames",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
