"""Modes from responses without a measured excitation (ambient tests)."""
