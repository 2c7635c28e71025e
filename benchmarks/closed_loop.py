"""How many times faster than real time the closed loop is: 60 s, five floors, set C, network in the controller.

Run with `python benchmarks/closed_loop.py`; compilation is not counted (functions are compiled when imported).
"""

from __future__ import annotations

import time

import numpy as np

from mrpipe.artifacts import load_parameter_set
from mrpipe.control import ControllerOptions, Gains, build_controller
from mrpipe.dampers.model import damper_from_parameter_set
from mrpipe.networks.network import FeatureSpec, Network
from mrpipe.simulation import LoopOptions, SensorNoise, harmonic, simulate_law
from mrpipe.structures import frame_from_parameter_set

SECONDS = 60.0
REPEATS = 7


def network() -> Network:
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
    laws = {"vd": Gains(650.0), "vdns": Gains(250.0, -4500.0), "fdns": Gains(alpha_n_m=3000.0)}
    print(f"{'law':6} {'plant Hz':>8} {'x real time (wall)':>19} {'x real time (processor)':>24} {'balance':>9}")
    for rate in (1000.0, 2000.0):
        options = LoopOptions(plant_rate_hz=rate, noise=SensorNoise(2e-5, 0.1))
        for law, gains in laws.items():
            controller = build_controller(law, gains, ControllerOptions(drive_limit=4.0), inverse=network())
            wall, processor = [], []
            for _ in range(REPEATS):
                began = time.process_time()
                response = simulate_law(
                    frame, damper.chain(), controller, excitation, options, rng=np.random.default_rng(1)
                )
                processor.append(time.process_time() - began)
                wall.append(response.seconds)
            seconds = response.time_s[-1]
            print(
                f"{law:6} {rate:8.0f} {seconds / min(wall):19.0f} {seconds / min(processor):24.0f} "
                f"{response.energy_balance_error:9.1e}"
            )


if __name__ == "__main__":
    main()
