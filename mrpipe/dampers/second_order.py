"""A second-order low-pass filter in the time domain, for drives and for force channels."""

from __future__ import annotations

from numba import float64, int64, njit, void

from mrpipe.artifacts import FloatArray


@njit(void(float64[::1], float64, float64, float64, float64, int64), cache=True)
def second_order_filter(
    state: FloatArray, value: float, delay: float, damping_ratio: float, dt: float, first: int
) -> None:
    """Advance w'' + 2 zeta omega w' + omega^2 (w - u) = 0 by one interval, with omega = 2 zeta / T.

    Slow changes are late by T. The input is linear between two samples. Each interval is divided into steps of at most
    0.3 rad, which are integrated by the trapezoidal rule.

    Parameters
    ----------
    state
        Output w, its rate [1/s], last input; shape (3,). Changed in place.
    value
        Present input u.
    delay
        T [s]; without delay the output is the input.
    damping_ratio
        zeta.
    dt
        Interval [s].
    first
        1 at the first sample: the filter starts at rest at the input.
    """
    if first == 1:
        state[0] = value
        state[1] = 0.0
        state[2] = value
    if delay > 1e-7:
        omega = 2.0 * damping_ratio / delay
        count = min(int(omega * dt / 0.3) + 1, 50)
        h = dt / count
        damping = 2.0 * damping_ratio * omega
        implicit = 1.0 + 0.5 * h * damping + 0.25 * h * h * omega * omega
        for index in range(count):
            middle = state[2] + (value - state[2]) * (index + 0.5) / count
            force = omega * omega * (middle - state[0]) - damping * state[1]
            change = h * force / implicit
            # the mean rate over the step acts on the displacement within it
            change -= 0.5 * h * h * omega * omega * state[1] / implicit
            state[0] += h * (state[1] + 0.5 * change)
            state[1] += change
    else:
        state[0] = value
        state[1] = 0.0
    state[2] = value
