"""Prepared tests as rows for networks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from mrpipe.api.options import settings_of
from mrpipe.artifacts import FloatArray, IntArray
from mrpipe.networks.network import FeatureSpec
from mrpipe.signals.prepared import PreparedTest


def network_rows(
    tests: Sequence[PreparedTest], *, kind: Literal["forward", "inverse"] = "forward", **settings: Any
) -> tuple[FloatArray, FloatArray, IntArray, FeatureSpec]:
    """Return features X, target y, test of each row, and the meaning of the columns of prepared tests.

    Parameters
    ----------
    tests
        Prepared tests of one sampling rate.
    kind
        `forward`: motion and drive to force; `inverse`: motion and force to drive.
    settings
        Settings of the section `assemble`, such as `past_values=2`.

    Returns
    -------
    X (n, R), y (n,), groups (n,) and the specification for `NetworkRegressor(features=...)`.

    Raises
    ------
    UserError
        If a setting is not known.
    """
    from mrpipe.config.sections.assemble import AssembleSettings
    from mrpipe.networks.assembly import join, samples

    chosen = settings_of(AssembleSettings, "assemble", settings)
    history = join(list(tests), cycles=chosen.cycles, sampling_rate_hz=chosen.sampling_rate_hz)
    forward = kind == "forward"
    spec = FeatureSpec(
        tuple(chosen.forward_inputs if forward else chosen.inverse_inputs),
        chosen.past_values,
        False if forward else chosen.inverse_absolute,
        history.sampling_rate_hz,
        "force" if forward else "drive",
        forward and chosen.forward_past_force,
    )
    rows = samples(history, spec)
    return rows.features, rows.target, rows.test, spec
