"""Fit of poles to whole-record spectra: linear part, projection, covariance, first poles."""
