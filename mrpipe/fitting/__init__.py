"""Fits of a damper model to bench recordings: concatenated recordings, the fitting problem, and its solver."""
