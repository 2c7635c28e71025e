"""Calibration and control laws."""
