"""Tracing: from the residual between model and measurement to the physical effect that explains it."""
