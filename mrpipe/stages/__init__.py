"""The stages, one thin file each: declared inputs, outputs and settings; no numerics."""
