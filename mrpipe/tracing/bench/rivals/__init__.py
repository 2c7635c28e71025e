"""Rivals of the chosen model, which decide whether each of its effects is needed.

Rivals are other base forms, fewer effects, other laws of the drive, springs inside the base form, and a linear memory
of the motion. They are compared after the choice of a model and before its effects are named.
"""
