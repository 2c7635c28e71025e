"""Fits of a damper to bench recordings: recordings laid end to end, the problem, and one engine that solves it."""
