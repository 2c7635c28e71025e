"""HDF5 artifacts: what one stage hands to the next, readable with h5py alone."""

from mrpipe.artifacts.atomic import atomic_path, atomic_write_text, sha256_of
from mrpipe.artifacts.hdf5 import Artifact, ArtifactWriter, Provenance
from mrpipe.artifacts.resources import (
    ParameterSet,
    config_directory,
    load_parameter_set,
    public_data_directory,
    require_parameter_set,
)
from mrpipe.artifacts.types import BoolArray, FloatArray, IntArray, Progress, no_progress

__all__ = [
    "Artifact",
    "ArtifactWriter",
    "BoolArray",
    "FloatArray",
    "IntArray",
    "ParameterSet",
    "Progress",
    "Provenance",
    "atomic_path",
    "atomic_write_text",
    "config_directory",
    "load_parameter_set",
    "no_progress",
    "public_data_directory",
    "require_parameter_set",
    "sha256_of",
]
