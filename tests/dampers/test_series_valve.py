"""The valve in series with a spring: its equation, and the simpler forms that it contains."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrpipe.dampers.drive import polynomial_coefficients
from mrpipe.dampers.form import Strength
from mrpipe.dampers.library import base_form
from mrpipe.dampers.plant import FORCE, build_chain, run_chain
from mrpipe.dampers.series_valve import EYRING, HERSCHEL_BULKLEY, flow_velocity, viscous_velocity, yield_share
from mrpipe.dampers.viscoplastic import knee
from tests.dampers.test_forms import DRIVE, VISCOSITY, YIELD, motion


@pytest.mark.property
@given(
    law=st.sampled_from([HERSCHEL_BULKLEY, EYRING]),
    load=st.floats(-1e6, 1e6),
    weight=st.floats(1e-2, 1e6),
    start=st.floats(-10.0, 10.0),
    strength=st.floats(0.0, 1e5),
    viscosity=st.floats(0.0, 1e5),
    scale=st.floats(1e-5, 1.0),
    power=st.floats(0.1, 2.0),
    sharpness=st.one_of(st.just(2.0), st.floats(1.0, 12.0)),
)
def test_the_velocity_of_the_valve_solves_its_equation(
    law, load, weight, start, strength, viscosity, scale, power, sharpness
):
    reference = 0.3
    norm = 1.0 / math.asinh(reference / scale) if law == EYRING else 1.0
    q = flow_velocity(law, load, weight, start, norm * strength, viscosity, scale, reference, power, sharpness)
    viscous = viscosity * viscous_velocity(law, q, scale, reference, power)
    left = strength * yield_share(law, q, scale, reference, sharpness) + viscous + weight * q - load
    # below a hundredth of the yield force the error relative to the yield force counts
    assert abs(left) <= 1e-5 * max(abs(load), 0.01 * strength, 1e-6)


@pytest.mark.property
@pytest.mark.parametrize(("form", "law"), [("herschel-bulkley-spring", HERSCHEL_BULKLEY), ("eyring-spring", EYRING)])
@given(
    speed=st.floats(0.0, 10.0),
    scale=st.floats(1e-4, 2.0),
    reference=st.floats(1e-2, 2.0),
    power=st.floats(0.1, 2.0),
    strength=st.floats(0.0, 1e5),
    viscosity=st.floats(0.0, 1e5),
    sharpness=st.one_of(st.just(2.0), st.floats(1.0, 12.0)),
)
def test_post_yield_force_of_an_inverse_is_that_of_the_valve(
    form, law, speed, scale, reference, power, strength, viscosity, sharpness
):
    values = {
        "velocity_scale": scale,
        "velocity_exponent": power,
        "reference_velocity": reference,
        "sharpness": sharpness,
    }
    zero = np.zeros(1)
    at = Strength(zero + speed, zero, zero + strength, zero + viscosity, zero)
    plastic = strength * yield_share(law, speed, scale, reference, sharpness)
    viscous = viscosity * viscous_velocity(law, speed, scale, reference, power)
    assert base_form(form).post_yield(values, at)[0] == pytest.approx(plastic + viscous, rel=1e-12)


def forces(form: str, values: dict[str, float], other: str, other_values: dict[str, float]) -> list[np.ndarray]:
    t, x, v = motion(1e-3)
    laws = polynomial_coefficients([YIELD], [VISCOSITY])
    return [
        run_chain(build_chain([laws, *base_form(name).steps(numbers)]), x, v, np.gradient(v, t), 0.0 * t + DRIVE, 1e-3)[
            :, FORCE
        ]
        for name, numbers in ((form, values), (other, other_values))
    ]


def relative_error(found: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((found - truth) ** 2) / np.mean(truth**2)))


@pytest.mark.property
def test_with_exponent_1_and_a_sharp_yield_it_is_a_bingham_element_with_a_spring() -> None:
    values = {"spring_stiffness": 6e4, "velocity_scale": 1e-5, "velocity_exponent": 1.0, "reference_velocity": 0.08}
    assert (
        relative_error(*forces("herschel-bulkley-spring", values, "bingham-spring", {"spring_stiffness": 6e4})) < 2e-3
    )


@pytest.mark.property
@pytest.mark.parametrize("form", ["herschel-bulkley-spring", "eyring-spring"])
def test_with_a_rigid_spring_the_force_is_that_of_the_valve(form: str) -> None:
    values = {"spring_stiffness": 1e9, "velocity_scale": 4e-3, "velocity_exponent": 0.6, "reference_velocity": 0.08}
    _, _, v = motion(1e-3)
    found, _ = forces(form, values, "bingham", {"transition_velocity": 0.01})
    if form == "eyring-spring":
        truth = YIELD * np.arcsinh(v / 4e-3) / np.arcsinh(0.08 / 4e-3) + VISCOSITY * v
    else:
        rounded = np.hypot(v, 4e-3)
        truth = YIELD * v / rounded + VISCOSITY * v * (rounded / 0.08) ** -0.4
    assert relative_error(found[1:], truth[1:]) < 1e-3


@pytest.mark.property
def test_a_sharpness_of_2_7_is_close_to_a_hyperbolic_tangent_and_12_to_a_sharp_yield_point() -> None:
    ratio = np.linspace(0.0, 6.0, 601)
    smooth, sharp = (np.array([knee(value, sharpness) for value in ratio]) for sharpness in (2.7, 12.0))
    np.testing.assert_allclose(smooth, np.tanh(ratio), atol=0.02)
    np.testing.assert_allclose(sharp, np.minimum(ratio, 1.0), atol=0.06)
