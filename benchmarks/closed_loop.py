"""How many times faster than real time the closed loop is: 60 s, five floors, set C, networks in the controller.

    taskset -c 0 python benchmarks/closed_loop.py

`loop` is the compiled loop alone, `all` the whole call with building, noise and histories; both in processor time of
this thread, which other work on the machine changes least. Compilation is not counted (done when imported).
"""

from __future__ import annotations

import time

import numpy as np

from mrpipe.artifacts import load_parameter_set
from mrpipe.control import ControllerOptions, Gains, build_controller
from mrpipe.control.neural import ReferenceOptions, train_reference
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.networks.network import FeatureSpec, Network
from mrpipe.simulation import LoopOptions, SensorNoise, harmonic, loop, simulate_law
from mrpipe.structures import frame_from_parameter_set, natural_modes

SECONDS = 60.0
REPEATS = 9


class ThreadClock:
    """Stands for the module `time` in the loop, so that it times the processor instead of the wall."""

    perf_counter = staticmethod(time.thread_time)


def inverse_network() -> Network:
    """Return an 8-6-6-1 network that follows the post-yield force roughly: its cost is that of a trained one."""
    rng = np.random.default_rng(1)
    layers = (8, 6, 6, 1)
    weights = [0.3 * rng.standard_normal((layers[i + 1], layers[i])) for i in range(3)]
    return Network(
        weights=tuple(weights),
        biases=tuple(np.zeros(len(matrix)) for matrix in weights),
        input_scale=np.repeat([0.1, 100.0], 4),
        input_shift=np.zeros(8),
        output_scale=4.0,
        output_shift=0.0,
        features=FeatureSpec(("velocity", "force"), 3, True, 200.0, "drive"),
    )


def main() -> None:
    frame = frame_from_parameter_set("thesis")
    damper = damper_from_parameter_set(load_parameter_set("dampers", "set-c"))
    cycles = round(SECONDS * 8.0 / (2.0 * np.pi))
    excitation = harmonic(0.79, 8.0, cycles=cycles, settling_cycles=cycles // 2)
    others = tuple(natural_modes(frame).angular_frequencies[1:])
    learnt = ReferenceOptions(
        3000.0, (0.003, 0.006, 0.012), (0.8, 1.3, 2.0), starts=1, iterations=40, disturbances_rad_s=others
    )
    reference = train_reference(learnt, np.random.default_rng(1)).network
    laws = {"vd": Gains(650.0), "vdns": Gains(250.0, -4500.0), "fdns": Gains(alpha_n_m=3000.0), "nnc": Gains()}
    vars(loop)["time"] = ThreadClock
    print(f"{'law':6} {'plant Hz':>8} {'loop x real time':>17} {'all x real time':>16} {'balance':>9}")
    for rate in (1000.0, 2000.0):
        options = LoopOptions(plant_rate_hz=rate, noise=SensorNoise(2e-5, 0.1))
        for law, gains in laws.items():
            controller = build_controller(
                law,
                gains,
                ControllerOptions(drive_limit=4.0, residual_force_n=18.0, friction_rounding_m_s=0.0125),
                inverse=inverse_network(),
                reference=reference,
            )
            inner, whole = [], []
            for _ in range(REPEATS):
                began = time.thread_time()
                response = simulate_law(
                    frame, damper.chain(), controller, excitation, options, rng=np.random.default_rng(1)
                )
                whole.append(time.thread_time() - began)
                inner.append(response.seconds)
            seconds = response.time_s[-1]
            print(
                f"{law:6} {rate:8.0f} {seconds / min(inner):17.0f} {seconds / min(whole):16.0f} "
                f"{response.energy_balance_error:9.1e}"
            )


if __name__ == "__main__":
    main()
