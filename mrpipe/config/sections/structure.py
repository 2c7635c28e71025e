"""Settings of a structure that is given instead of identified."""

from mrpipe.structures.options import StructureSettings

__all__ = ["StructureSettings"]
