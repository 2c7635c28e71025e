"""Damper models."""
