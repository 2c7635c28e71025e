"""Inputs of the stages that run or export the closed loop, which depend on the damper and on the inverse."""

from __future__ import annotations

LOOP_INPUTS = (
    ("simulate.damper", "identified", "identify-damper"),
    ("simulate.damper", "traced", "identify-damper"),
    ("simulate.damper", "traced", "close-loop"),
    ("simulate.controller.inverse", "network", "train-inverse"),
)
"""Conditional inputs of a stage: a loop with a damper from a parameter set and the inverse of its model needs no bench
tests."""
