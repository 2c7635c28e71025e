"""Every effect of the library: named as the contract has it, nothing at zero strength, dissipative where it says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrpipe.dampers.drive import driver_lag, polynomial_coefficients
from mrpipe.dampers.hysteresis import hysteresis
from mrpipe.dampers.plant import FORCE, build_chain, run_chain
from mrpipe.effects.contract import EffectForm, EffectScales
from mrpipe.effects.library import all_effects, damper_effects, effects_named, load_effect_file
from mrpipe.errors import UserError

CONTRACT = [
    "offset",
    "accumulator",
    "inertia",
    "asymmetry",
    "stribeck",
    "quadratic-drag",
    "rate-dependent-yield",
    "migration",
    "remanence",
    "heating",
    "backlash",
    "delay",
    "saturation",
    "pinching",
    "channel-skew",
    "end-stop",
]
SCALES = EffectScales(stroke=0.01, speed=0.12, acceleration=1.5, drive=4.0, force=120.0, time=5.0)
FORMS = [(effect.name, form) for effect in damper_effects().values() for form in (*effect.forms, *effect.refinements)]
IDS = [f"{name}/{form.name}" for name, form in FORMS]


def base_steps() -> list:
    return [
        polynomial_coefficients([22.0, 5.5, 22.0, -2.0], [50.0, 75.0]),
        driver_lag(100.0),
        hysteresis(3.7e-4, 0.5, 2.0),
    ]


def motion(frequency: float = 1.3, amplitude: float = 0.009, rate: float = 1000.0) -> tuple[np.ndarray, ...]:
    t = np.arange(int(3.0 * rate)) / rate
    omega = 2 * np.pi * frequency
    x = amplitude * np.sin(omega * t)
    drive = 2.0 + 1.5 * np.sin(2 * np.pi * 0.7 * t)
    return x, omega * amplitude * np.cos(omega * t), -(omega**2) * x, drive, 1.0 / rate


def force_with(form: EffectForm | None, values: dict[str, float] | None, **kind: float) -> np.ndarray:
    steps = base_steps() if form is None else [*base_steps(), *form.steps(values or {})]
    return run_chain(build_chain(steps), *motion(**kind))[:, FORCE]


def middle(form: EffectForm) -> dict[str, float]:
    return {p.name: p.start_values(SCALES)[0] * (0.05 if p.role == "amplitude" else 1.0) for p in form.parameters}


@pytest.mark.property
def test_the_names_of_the_contract_are_all_there() -> None:
    assert set(CONTRACT) <= set(damper_effects())


@pytest.mark.property
@pytest.mark.parametrize("name", list(all_effects()))
def test_an_effect_is_documented(name: str) -> None:
    effect = all_effects()[name]
    for text in (effect.summary, effect.physics, effect.remedy, effect.source, effect.acts_on):
        assert len(text) > 3
    for other in effect.separated_by:
        assert other in all_effects()
    for form in (*effect.forms, *effect.refinements):
        for parameter in form.parameters:
            assert parameter.unit
            assert parameter.meaning
            low, high = parameter.bounds(SCALES)
            assert low < high
            for start in parameter.start_values(SCALES):
                assert parameter.role == "amplitude" or low <= start <= high
        assert set(form.amplitude_steps) == {item.name for item in form.amplitudes}


VANISHING = [item for item in FORMS if any(p.role != "shape" for p in item[1].parameters)]
"""All but those that put their own hysteresis in the place of the base's."""


@pytest.mark.property
@pytest.mark.parametrize(("name", "form"), VANISHING, ids=[f"{name}/{form.name}" for name, form in VANISHING])
@settings(max_examples=4, deadline=None)
@given(frequency=st.floats(0.5, 2.5), amplitude=st.floats(0.002, 0.012))
def test_zero_strength_changes_nothing(name: str, form: EffectForm, frequency: float, amplitude: float) -> None:
    values = form.without_strength(SCALES)
    plain = force_with(None, None, frequency=frequency, amplitude=amplitude)
    np.testing.assert_allclose(
        force_with(form, values, frequency=frequency, amplitude=amplitude), plain, rtol=1e-9, atol=1e-9
    )


@pytest.mark.property
@pytest.mark.parametrize("form", all_effects()["channel-skew"].forms, ids=lambda form: form.name)
def test_a_skew_is_taken_back_over_a_quick_motion(form: EffectForm) -> None:
    # 10 ms at 2.5 Hz: a series of the displacement in its derivatives misses by more than its noise
    x, v, a, u, dt = motion(frequency=2.5)
    late = round(0.01 / dt)
    plain = run_chain(build_chain(base_steps()), x, v, a, u, dt)[:, FORCE]
    skewed = form.steps({"skew": late * dt})
    if form.name == "shift":
        found = run_chain(build_chain([*base_steps(), *skewed]), x[:-late], v[:-late], a[:-late], u[late:], dt)[
            :, FORCE
        ]
        expected = plain[late:]
    else:
        found = run_chain(build_chain([*base_steps(), *skewed]), x, v, a, u, dt)[:, FORCE][late:]
        expected = plain[:-late]
    settled = slice(len(expected) // 3, -2 * late)
    np.testing.assert_allclose(found[settled], expected[settled], atol=1e-6 * np.ptp(expected))


@pytest.mark.property
@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_strength_changes_something(name: str, form: EffectForm) -> None:
    values = {
        p.name: 0.6 * p.bounds(SCALES)[1] if p.role == "strength" else p.start_values(SCALES)[-1]
        for p in form.parameters
    }
    change = force_with(form, values, amplitude=0.0099) - force_with(None, None, amplitude=0.0099)
    assert np.all(np.isfinite(change))
    assert np.sqrt(np.mean(change**2)) > 1e-4


@pytest.mark.property
@pytest.mark.parametrize(
    ("name", "form"),
    [item for item in FORMS if item[1].amplitudes],
    ids=[i for i, f in zip(IDS, FORMS, strict=True) if f[1].amplitudes],
)
def test_amplitudes_are_linear(name: str, form: EffectForm) -> None:
    values = middle(form)
    doubled = {n: 2.0 * v if any(p.name == n for p in form.amplitudes) else v for n, v in values.items()}
    plain = force_with(None, None)
    np.testing.assert_allclose(force_with(form, doubled) - plain, 2.0 * (force_with(form, values) - plain), atol=1e-8)


@pytest.mark.property
@pytest.mark.parametrize(
    ("name", "form"),
    [item for item in FORMS if item[1].dissipative],
    ids=[i for i, f in zip(IDS, FORMS, strict=True) if f[1].dissipative],
)
def test_a_dissipative_effect_never_feeds_energy(name: str, form: EffectForm) -> None:
    _, v, _, _, dt = motion(frequency=1.0)
    work = np.sum((force_with(form, middle(form), frequency=1.0) - force_with(None, None, frequency=1.0)) * v) * dt
    if form.amplitudes:
        assert work >= 0.0
    whole = force_with(form, middle(form), frequency=1.0)[1000:2000] @ v[1000:2000] * dt
    assert whole > 0.0


@pytest.mark.property
def test_the_gap_is_lost_motion() -> None:
    form = damper_effects()["backlash"].form("held")
    x, v, a, drive, dt = motion()
    from mrpipe.dampers.plant import DISPLACEMENT

    chain = build_chain([*base_steps(), *form.steps({"gap": 2e-4})])
    damper = run_chain(chain, x, v, a, drive, dt)[:, DISPLACEMENT]
    assert np.ptp(damper[1000:]) == pytest.approx(np.ptp(x) - 2e-4, rel=1e-6)


@pytest.mark.property
def test_a_file_of_ones_own_is_loaded(tmp_path: Path) -> None:
    source = Path(damper_effects.__code__.co_filename).with_name("quadratic_drag.py").read_text(encoding="utf-8")
    own = tmp_path / "my_drag.py"
    own.write_text(
        source.replace('name="quadratic-drag"', 'name="my-drag"').replace("cache=True", "cache=False"), encoding="utf-8"
    )
    assert load_effect_file(own).name == "my-drag"
    assert list(effects_named(["inertia"], [own])) == ["inertia", "my-drag"]


@pytest.mark.property
def test_what_is_wrong_with_a_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        load_effect_file(tmp_path / "none.py")
    (tmp_path / "empty.py").write_text("x = 1\n", encoding="utf-8")
    with pytest.raises(UserError, match="EFFECT"):
        load_effect_file(tmp_path / "empty.py")
    with pytest.raises(UserError, match=r"did you mean inertia\?"):
        effects_named(["inertja"])
