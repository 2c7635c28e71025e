"""What the tests of the controller share."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from mrpipe.artifacts import load_parameter_set
from mrpipe.dampers.model import DamperModel, damper_from_parameter_set
from mrpipe.networks.network import FeatureSpec, Network
from mrpipe.structures import Frame, frame_from_parameter_set

SCALES = {"displacement": 0.01, "velocity": 0.07, "force": 60.0}


@pytest.fixture(scope="session")
def thesis_frame() -> Frame:
    return frame_from_parameter_set("thesis")


@pytest.fixture(scope="session")
def set_c() -> DamperModel:
    return damper_from_parameter_set(load_parameter_set("dampers", "set-c"))


@pytest.fixture(scope="session")
def floor_one() -> np.ndarray:
    return np.eye(5)[0]


def random_network(channels: tuple[str, ...], target: str, past: int, absolute: bool, seed: int = 1) -> Network:
    """A network of plausible size whose numbers mean nothing: for tests of arithmetic."""
    rng = np.random.default_rng(seed)
    layers = (len(channels) * (past + 1), 6, 6, 1)
    pairs = list(itertools.pairwise(layers))
    return Network(
        weights=tuple(0.5 * rng.standard_normal((outer, inner)) for inner, outer in pairs),
        biases=tuple(0.1 * rng.standard_normal(outer) for _, outer in pairs),
        input_scale=np.repeat([SCALES[name] for name in channels], past + 1),
        input_shift=0.01 * rng.standard_normal(layers[0]),
        output_scale=4.0 if target == "drive" else 80.0,
        output_shift=0.1,
        features=FeatureSpec(channels, past, absolute, 200.0, target),
    )
