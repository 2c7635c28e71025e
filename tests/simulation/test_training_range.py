"""Requests to the networks of a loop, beside the range of their training rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrpipe.control.kernel import COMMAND_FORCE, COMMAND_INVERSE, COMMAND_SWITCHED, COMMAND_UNCLIPPED, COMMAND_VELOCITY
from mrpipe.networks.network import Network
from mrpipe.simulation import LoopOptions, Response
from mrpipe.simulation.sensors import SensorNoise
from mrpipe.simulation.training_range import check_damper, check_networks, requests
from tests.control.conftest import random_network

NOISY = LoopOptions(noise=SensorNoise(20e-6, 0.1))


def signals(response: Response) -> dict[str, np.ndarray]:
    return requests(response, np.zeros(len(response.commands)))


def with_range(network: Network, low: list[float], high: list[float]) -> Network:
    window = network.features.past_values + 1
    return replace(network, feature_minimum=np.repeat(low, window), feature_maximum=np.repeat(high, window))


@pytest.mark.oracle
@pytest.mark.parametrize("form", ["steady", "history"])
def test_the_rows_are_those_the_kernel_asks_with(rig, form):
    network = random_network(("velocity", "force"), "drive", 3, True)
    network = replace(network, features=replace(network.features, sampling_rate_hz=80.0))
    controller = rig.controller("vdns", inverse=network, inverse_request=form)
    response, _ = rig.run("vdns", NOISY, inverse=network, inverse_request=form)
    asked = controller.networks["inverse"]
    rows = signals(response).rows(asked, 200.0)
    np.testing.assert_allclose(asked.predict(rows), response.commands[:, COMMAND_INVERSE], rtol=1e-9, atol=1e-9)


@pytest.mark.oracle
def test_the_network_of_nnc_is_followed_too(rig):
    response, _ = rig.run("nnc", NOISY)
    network = rig.controller("nnc").networks["law"]
    force = network.predict(signals(response).rows(network, 200.0))
    np.testing.assert_allclose(force, response.commands[:, COMMAND_UNCLIPPED], rtol=1e-9, atol=1e-9)


@pytest.mark.planted
def test_time_outside_is_counted_and_the_input_is_named(rig):
    network = with_range(random_network(("velocity", "force"), "drive", 3, True), [0.0, 0.0], [0.04, 1e4])
    controller = rig.controller("vd", inverse=network)
    response, _ = rig.run("vd", NOISY, inverse=network)
    (check,) = check_networks(controller, response, np.zeros(len(response.commands)))
    speed = np.abs(response.commands[:, COMMAND_VELOCITY])
    counts = response.commands[:, COMMAND_SWITCHED] < 0.5
    assert check.what == "inverse network"
    assert check.outside_share == pytest.approx(np.mean((speed > 1.02 * 0.04) & counts), abs=1e-12)
    assert check.inputs["velocity"].outside_share == check.outside_share > 0.05
    assert check.inputs["velocity"].asked[1] == pytest.approx(speed[counts].max())
    assert check.inputs["force"].outside_share == 0.0
    assert check.warning.startswith("the inverse network extrapolates")
    assert "velocity up to" in check.warning and "(known to 0.04)" in check.warning and "force" not in check.warning
    assert check.as_json()["inputs"]["velocity"]["known_largest_m_s"] == 0.04


@pytest.mark.planted
def test_a_force_beyond_training_is_told_as_such(rig):
    network = with_range(random_network(("velocity", "force"), "drive", 3, True), [0.0, 0.0], [10.0, 30.0])
    response, _ = rig.run("vd", NOISY, inverse=network)
    (check,) = check_networks(rig.controller("vd", inverse=network), response, np.zeros(len(response.commands)))
    wanted = np.abs(response.commands[:, COMMAND_FORCE])
    assert check.outside_share == pytest.approx(np.mean(wanted > 1.02 * 30.0), abs=1e-12)
    assert "force up to" in check.warning and "velocity" not in check.warning


@pytest.mark.property
def test_within_its_range_nothing_is_warned_of(rig):
    network = with_range(random_network(("velocity", "force"), "drive", 3, True), [0.0, 0.0], [10.0, 1e4])
    response, _ = rig.run("vd", NOISY, inverse=network)
    still = np.zeros(len(response.commands))
    (check,) = check_networks(rig.controller("vd", inverse=network), response, still)
    assert check.outside_share == 0.0 and check.warning == ""
    # nobody knows the range of a network that came without one; a perfect damper needs no inverse
    unknown = random_network(("velocity", "force"), "drive", 3, True)
    assert check_networks(rig.controller("vd", inverse=unknown), response, still) == []
    assert check_networks(rig.controller("vd", inverse=network), response, still, drive_counts=False) == []
    assert rig.controller("passive-off", inverse=network).networks == {}


@pytest.mark.planted
def test_a_damper_that_moves_further_than_on_the_bench_is_warned_of(rig):
    response, _ = rig.run("vd", NOISY)
    largest = float(np.abs(response.damper_displacement).max())
    check = check_damper(response, {"displacement": 0.5 * largest, "velocity": 10.0})
    assert check.outside_share == pytest.approx(np.mean(np.abs(response.damper_displacement) > 0.51 * largest))
    assert "displacement up to" in check.warning and "mm" in check.warning and "velocity" not in check.warning
    assert check_damper(response, {"displacement": largest, "velocity": 10.0}).warning == ""
