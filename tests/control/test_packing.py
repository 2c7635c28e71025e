"""The arrays of a controller hold its parts where the layout says."""

from __future__ import annotations

import numpy as np
import pytest

from mrpipe.control import kernel
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.inverse import InverseTable
from mrpipe.control.laws import law_named
from mrpipe.control.lqg import Observer
from mrpipe.control.packing import ControllerArrays
from mrpipe.errors import UserError
from mrpipe.networks.network import FeatureSpec, Network

TABLE = InverseTable(np.arange(12.0).reshape(3, 4), largest_speed_m_s=0.5, largest_drive=2.0)


def network(*, past_target: bool = False, neurons: int = 2) -> Network:
    """Return a network of velocity and force with one past value each, sampled at 100 Hz."""
    inputs = 6 if past_target else 4
    return Network(
        weights=(np.full((neurons, inputs), 3.0), np.full((1, neurons), 5.0)),
        biases=(np.full(neurons, 4.0), np.full(1, 6.0)),
        input_scale=np.ones(inputs),
        input_shift=np.zeros(inputs),
        output_scale=7.0,
        output_shift=8.0,
        features=FeatureSpec(("velocity", "force"), 1, True, 100.0, "drive", past_target=past_target),
    )


@pytest.mark.golden
def test_each_part_begins_where_the_layout_says() -> None:
    arrays = ControllerArrays(ControllerOptions(rate_hz=200.0))
    arrays.add_table(TABLE)
    samples = arrays.add_network(network(), kernel.NETWORK_INVERSE, kernel.INVERSE_SPACING)
    numbers, layout = arrays.finish(law_named("vd"), samples, 0)

    at = layout[kernel.AT_TABLE]
    assert at == kernel.HEAD and numbers[at : at + 12].tolist() == list(range(12))
    assert layout[kernel.TABLE_SPEEDS] == 3 and layout[kernel.TABLE_DRIVES] == 4
    assert numbers[kernel.TABLE_SPEED] == 0.5 and numbers[kernel.TABLE_DRIVE] == 2.0
    entry = layout[layout[kernel.NETWORK_INVERSE] :]
    values = numbers[entry[kernel.NET_AT] :]
    # scale and shift of four inputs and of the output, then weights by row and biases of two layers
    assert values[:10].tolist() == [1.0] * 4 + [0.0] * 4 + [7.0, 8.0]
    assert values[10:23].tolist() == [3.0] * 8 + [4.0] * 2 + [5.0] * 2 + [6.0]
    # the network reads every second sample of the controller
    assert numbers[kernel.INVERSE_SPACING] == 2.0 and samples == 4
    assert layout[kernel.AT_LIMITS] + layout[kernel.CHANNELS] == len(numbers)
    assert layout[kernel.STATE_SIZE] == layout[kernel.STATE_GOOD] + layout[kernel.CHANNELS]


@pytest.mark.property
def test_the_state_holds_an_observer_between_the_past_values_and_the_law() -> None:
    law = law_named("lqg")
    layout = ControllerArrays(ControllerOptions()).finish(law, 2, 3)[1]
    assert layout[kernel.STATE_OBSERVER] == layout[kernel.STATE_HISTORY] + 4 * 2
    assert layout[kernel.STATE_LAW] == layout[kernel.STATE_OBSERVER] + 2 * 3
    assert layout[kernel.STATE_GOOD] == layout[kernel.STATE_LAW] + law.memory


@pytest.mark.golden
def test_parts_that_the_loop_cannot_run_are_refused() -> None:
    arrays = ControllerArrays(ControllerOptions(rate_hz=200.0))
    place = kernel.NETWORK_INVERSE, kernel.INVERSE_SPACING
    with pytest.raises(UserError, match="its own past output cannot be an input in the loop"):
        arrays.add_network(network(past_target=True), *place)
    with pytest.raises(UserError, match=f"at most {kernel.WIDEST}"):
        arrays.add_network(network(neurons=kernel.WIDEST + 1), *place)
    square = np.eye(2)
    observer = Observer(square, square[0], np.zeros((2, 3)), square[0], sample_time_s=0.01, floors=1)
    with pytest.raises(UserError, match="was made for another rate"):
        arrays.add_observer(observer)
    with pytest.raises(UserError, match="low_pass_hz: 120 Hz is not below half of 200 Hz"):
        ControllerArrays(ControllerOptions(rate_hz=200.0, low_pass_hz=120.0))
