"""Tracing on the structure: residual of the linear frame against measured vibration."""
