"""Steps called through their addresses are the steps themselves."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from mrpipe.dampers.plant import WIRE_SIZE
from mrpipe.fitting.pointers import addresses_of, step_at
from tests.dampers.test_forms import model


@njit
def _called(address, wire, state, parameters, dt):
    step_at(address)(wire, state, parameters, dt)


@pytest.mark.property
def test_a_step_called_by_its_address_gives_what_it_gives_by_its_name() -> None:
    chain = model("bouc-wen").chain()
    addresses = addresses_of(chain)
    assert len(addresses) == len(chain.functions)
    for place in range(len(chain.names)):
        numbers = chain.parameters[chain.parameter_offsets[place] : chain.parameter_offsets[place + 1]]
        size = int(chain.state_offsets[place + 1] - chain.state_offsets[place])
        results = []
        for call in (chain.functions[place], lambda *given, at=addresses[place]: _called(at, *given)):
            wire, state = np.linspace(0.1, 2.0, WIRE_SIZE), np.linspace(0.0, 0.3, size)
            call(wire, state, numbers, 1e-3)
            results.append((wire, state))
        for by_name, by_address in zip(*results, strict=True):
            np.testing.assert_array_equal(by_name, by_address)
