"""Damper models: base forms, laws of the drive, and the chain of steps that simulates a damper."""
