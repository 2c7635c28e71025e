"""Damping ratios from free decays."""
