"""From the settings of `close-loop` to the options of a tracing."""

from __future__ import annotations

from typing import Any

from mrpipe.tracing.bench.summary import TracingOptions
from mrpipe.tracing.bench.verdict import Rules


def tracing_options(settings: Any, drive_unit: str) -> TracingOptions:
    """Return the options of a tracing, on a bench or behind a structure."""
    return TracingOptions(
        model=settings.model,
        yield_order=settings.yield_order,
        viscosity_order=settings.viscosity_order,
        most_effects=settings.most_effects,
        fit_rate_hz=settings.fit_rate_hz,
        displacement_cutoff_hz=settings.displacement_cutoff_hz,
        refits=settings.refits,
        folds=settings.folds,
        bootstrap_draws=settings.bootstrap_draws,
        rules=Rules(settings.named_share, settings.least_share, settings.lead),
        record_gain=settings.record_gain,
        observation_filter=settings.observation_filter,
        model_error_share=settings.model_error_share,
        unattributed=settings.unattributed,
        base_forms=tuple(settings.base_forms),
        validation=settings.rules.validation,
        drive_unit=drive_unit or "A",
    )
