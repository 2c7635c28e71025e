"""Time of the benchmark structures: 900 s of wind on 46 states, 30 s of base isolation, ten storeys with their damper.

    python benchmarks/structures.py [--repeats 3]

One core, compilation not counted. Aims: the wind in 5 s, base isolation with two dampers in 1 s, both at 1 ms.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial

import numpy as np

from mrpipe.artifacts import load_parameter_set
from mrpipe.case_studies.base_isolated.structure import surrogate_building
from mrpipe.case_studies.base_isolated.study import isolation_study
from mrpipe.case_studies.inverse import train_inverse
from mrpipe.case_studies.motion import spectrum_compatible_motion
from mrpipe.case_studies.options import LqgWeights
from mrpipe.case_studies.run import BinghamDevice
from mrpipe.case_studies.ten_storey.structure import ten_storey
from mrpipe.case_studies.ten_storey.study import ten_storey_study
from mrpipe.case_studies.wind.load import synthetic_wind
from mrpipe.case_studies.wind.structure import HEIGHT_M, WIDTH_M, surrogate_tower
from mrpipe.case_studies.wind.study import wind_study
from mrpipe.dampers.model import damper_from_parameter_set


def best(work: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Return the shortest wall and processor time [s]; the first call, which may compile, is left out."""
    work()
    walls, processors = [], []
    for _ in range(repeats):
        wall, processor = time.perf_counter(), time.process_time()
        work()
        walls.append(time.perf_counter() - wall)
        processors.append(time.process_time() - processor)
    return min(walls), min(processors)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=3)
    repeats = parser.parse_args().repeats
    rng = np.random.default_rng(1)
    device = BinghamDevice()
    network = train_inverse(device, rng).network
    motion = spectrum_compatible_motion(rng)
    isolated = isolation_study(
        surrogate_building(), device=device, network=network, damping_ratio=0.1, stiffness_share=0.2, lqg=LqgWeights()
    )
    load = synthetic_wind(rng, 76, HEIGHT_M, WIDTH_M)
    tower = surrogate_tower()
    wind = wind_study(
        tower, tower, load, device=device, network=network, stiffness_share=0.5, tuned_mass_kg=500e3,
        lqg=LqgWeights(displacement=1000.0, acceleration=10.0),
    )  # fmt: skip
    chain = damper_from_parameter_set(load_parameter_set("dampers", "p4-1000kn")).chain()
    storeys = ten_storey_study(ten_storey(), motion, device=device, chain=chain)
    runs: dict[str, Callable[[], object]] = {}
    for law in ("vd", "fdns", "lqg"):
        runs[f"wind, 900 s, 46 states, {law}"] = partial(wind.run, wind.controller(law))
        runs[f"base isolation, 30 s, {law}"] = partial(isolated.run, motion, isolated.controller(law))
    runs["ten storeys, 30 s at 0.5 ms, vd"] = partial(storeys.case, "vd")
    print(f"{'run':34} {'s wall':>8} {'s processor':>12}")
    for name, work in runs.items():
        wall, processor = best(work, repeats)
        print(f"{name:34} {wall:8.2f} {processor:12.2f}")


if __name__ == "__main__":
    main()
