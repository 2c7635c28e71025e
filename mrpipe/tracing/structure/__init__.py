"""Tracing on the structure: residual between measured vibration and a linear frame."""
