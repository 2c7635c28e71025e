"""The chosen model judges filter and rate again, and a rate is kept only where it changes no name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mrpipe.tracing.bench.model_choice.filter_and_rate as module
from mrpipe.effects.library import damper_effects
from mrpipe.tracing.bench.model_choice.filter_and_rate import Bench, choose_with_filter_and_rate, fit_declared_model
from mrpipe.tracing.options import TracingOptions
from tests.tracing.bench.rig import campaign

pytestmark = pytest.mark.planted


def _bench(planted: str, *names: str) -> Bench:
    library = damper_effects()
    tests = [test for test in campaign(planted) if test.role != "validation"]
    return Bench(tests, {name: library[name] for name in names}, [], np.random.default_rng(1))


def _options(rate_hz: float) -> TracingOptions:
    return TracingOptions(
        base_forms=("bouc-wen", "dahl"), refits=1, bootstrap_draws=50, most_effects=1, fit_rate_hz=rate_hz
    )


def _twice(_bench: Bench, found: Any) -> TracingOptions:
    options: TracingOptions = found.options
    return options.model_copy(update={"fit_rate_hz": 2.0 * options.fit_rate_hz})


def test_a_higher_rate_that_keeps_the_names_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = _bench("wide-backlash", "backlash")
    begun = fit_declared_model(bench, _options(62.5))
    monkeypatch.setattr(module, "_at_better_rate", _twice)
    found = choose_with_filter_and_rate(bench, begun)
    assert found.options.fit_rate_hz == 125.0
    assert found.names == {"backlash"}
    assert len(found.training.force) > len(begun.training.force)


def test_a_rate_that_changes_the_names_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = _bench("wide-backlash", "backlash")
    real, calls = module._choose, []

    def choose_once(bench: Bench, begun: Any) -> Any:
        calls.append(begun.options.fit_rate_hz)
        found = real(bench, begun)
        # the second choice finds nothing
        return found if len(calls) == 1 else module.ChosenModel(**vars(begun), choice=_nothing(found.choice))

    monkeypatch.setattr(module, "_choose", choose_once)
    monkeypatch.setattr(module, "_at_better_rate", _twice)
    monkeypatch.setattr(module, "better_filter", lambda *args, **_: args[3])
    found = choose_with_filter_and_rate(bench, fit_declared_model(bench, _options(62.5)))
    assert len(calls) == 2
    assert found.options.fit_rate_hz == 62.5
    assert found.names == {"backlash"}


class _Named:
    """What was chosen, by its names alone."""

    def __init__(self, begun: Any, names: set[str]) -> None:
        self.names, self.options, self.filter, self.training = names, begun.options, begun.filter, begun.training


def test_one_more_name_at_a_higher_rate_is_not_taken_but_the_rate_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same effect was kept at the low rate, where its numbers are biased, because the high rate added another."""
    bench = _bench("wide-backlash", "backlash", "stribeck")
    able: list[set[str]] = []

    def choose_once(_bench: Bench, begun: Any) -> Any:
        able.append(set(begun.able))
        return _Named(begun, {"backlash"} if len(able) == 1 else set(begun.able))

    monkeypatch.setattr(module, "_choose", choose_once)
    monkeypatch.setattr(module, "_at_better_rate", _twice)
    monkeypatch.setattr(module, "_better_filter", lambda _bench, found, _options: found.filter)
    found = choose_with_filter_and_rate(bench, fit_declared_model(bench, _options(62.5)))
    assert found.options.fit_rate_hz == 125.0 and found.names == {"backlash"}
    assert able[1] > able[2] == {"backlash"}


@pytest.mark.parametrize("leaves_less", [True, False])
def test_another_name_at_a_higher_rate_counts_where_it_leaves_less(
    monkeypatch: pytest.MonkeyPatch, leaves_less: bool
) -> None:
    """A free play that one sample of the low rate spans had looked like a delay between the channels."""
    bench = _bench("wide-backlash", "backlash", "channel-skew")
    names = iter([{"channel-skew"}, {"backlash"}])
    monkeypatch.setattr(module, "_choose", lambda _bench, begun: _Named(begun, next(names)))
    monkeypatch.setattr(module, "_at_better_rate", _twice)
    monkeypatch.setattr(module, "_better_filter", lambda _bench, found, _options: found.filter)
    monkeypatch.setattr(module, "_leaves_less", lambda *_: leaves_less)
    found = choose_with_filter_and_rate(bench, fit_declared_model(bench, _options(62.5)))
    assert found.names == ({"backlash"} if leaves_less else {"channel-skew"})


def _nothing(choice: Any) -> Any:
    return replace(choice, selection=replace(choice.selection, chosen=choice.selection.without_effects))


def test_a_model_within_the_noise_keeps_filter_and_rate() -> None:
    bench = _bench("none", "backlash")
    begun = fit_declared_model(bench, _options(250.0))
    found = choose_with_filter_and_rate(bench, begun)
    assert found.options.fit_rate_hz == 250.0
    assert found.names == set()
