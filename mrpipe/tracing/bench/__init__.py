"""Tracing on the damper test bench: residual force of a damper model against measured force."""
