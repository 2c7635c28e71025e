"""Stopping rules of the training of a network."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StoppingRules:
    """Stopping rules of a training; the defaults are those of trainlm.

    Attributes
    ----------
    iterations
        Largest number of accepted steps (epochs).
    held_out_failures
        Number of consecutive steps without a new smallest error on the held-out rows after which training ends.
    gradient
        Largest |gradient| of the mean squared normalised error at which training ends.
    improvement
        Relative gain of the last ten steps below which training ends (trainlm has no such rule: 0).
    mu, mu_increase, mu_decrease, mu_maximum
        Damping of the built-in loop: first value, factors after a failed and after a successful step, and limit.
    """

    iterations: int = 1000
    held_out_failures: int = 6
    gradient: float = 1e-7
    improvement: float = 0.0
    mu: float = 1e-3
    mu_increase: float = 10.0
    mu_decrease: float = 0.1
    mu_maximum: float = 1e10
