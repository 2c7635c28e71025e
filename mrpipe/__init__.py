"""mrpipe: magnetorheological dampers from the measured file to the closed loop, and back."""

__version__ = "0.1.0"
