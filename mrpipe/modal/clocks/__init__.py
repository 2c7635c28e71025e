"""Clocks of sensors: delays, drifts and steps, and their validation."""
