"""Section of the report on a closed loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from mrpipe.reporting import simulation as figures
from mrpipe.reporting.sink import Sink
from mrpipe.simulation.excitation import Excitation
from mrpipe.simulation.indices import FLOWING, decay_damping
from mrpipe.simulation.loop import Response
from mrpipe.simulation.rig import Rig
from mrpipe.simulation.training_range import RangeCheck
from mrpipe.words import in_percent

VISCOUS = "vd"
"""Law that the others are compared with."""


def describe(
    sink: Sink,
    law: str,
    rig: Rig,
    response: Response,
    excitation: Excitation,
    values: Mapping[str, Any],
    viscous: Mapping[str, Any] | None,
) -> None:
    """Write the section of a stage `simulate-LAW`.

    Parameters
    ----------
    sink
        Part of the report that is written.
    law, rig, response, excitation
        The law, the rig, its response, and the excitation.
    values, viscous
        Indices of the run, and of vd under the same excitation where it was run.
    """
    sink.text(_words(law, excitation, values))
    table = _table(law, values, viscous)
    others = f", and those of {VISCOUS} under the same excitation" if f"over {VISCOUS}" in table else ""
    sink.table("indices", table, f"Indices{others} (SI).")
    last = excitation.steady_s[1]
    cycle = 2.0 * np.pi / excitation.frequency_rad_s if np.isfinite(excitation.frequency_rad_s) else last / 4.0
    shown = (response.time_s >= last - 4.0 * cycle) & (response.time_s < last)
    loops = figures.loops(
        response.damper_displacement[shown],
        response.damper_velocity[shown],
        response.force[shown],
        response.desired_force[shown],
        law,
    )
    sink.figure("loops", loops, "Damper force in the last four cycles.")
    sink.figure(
        "histories",
        figures.histories(
            response.time_s,
            response.displacement[:, response.top],
            response.damper_displacement,
            response.force,
            response.desired_force,
            response.drive,
            rig.damper.drive_unit,
        ),
        "Histories.",
    )
    sink.figure(
        "energy",
        figures.energies(response.time_s, response.work_in, response.work_damper, response.work_frame),
        f"Energies; the balance closes to {values['energy_balance_error']:.1e}.",
    )
    if np.isfinite(excitation.decay_from_s):
        decay = decay_damping(response, excitation.decay_from_s, FLOWING * rig.damper.drive_limit)
        after = response.time_s >= excitation.decay_from_s
        sink.figure(
            "decay",
            figures.decay(
                response.time_s[after],
                response.displacement[after, response.top],
                decay.peak_time_s,
                decay.peak_m,
                decay.point_to_point,
            ),
            "Free decay after the base stops.",
        )


def _words(law: str, excitation: Excitation, values: Mapping[str, Any]) -> str:
    damping = values["damping_ratio"]
    decay = ""
    if damping is not None:
        low, high = values["damping_ratio_interval"]
        decay = f" Free decay: damping ratio {damping:.3f} while current flows; readings from {low:.3f} to {high:.3f}."
    return (
        f"Law {law}, {excitation.details['kind']} excitation: rms top displacement "
        f"{1e3 * values['rms_x_top_m']:.1f} mm, first floor {1e3 * values['rms_x1_m']:.1f} mm; "
        f"{in_percent(values['switched_off_share'])} of the time switched off, "
        f"{in_percent(values['clipped_share'])} clipped.{decay} "
        f"Energy balance closed to {values['energy_balance_error']:.1e}; "
        f"{values['real_time_factor']:.0f} times real time."
    )


def _table(law: str, values: Mapping[str, Any], viscous: Mapping[str, Any] | None) -> pd.DataFrame:
    numbers = {key: value for key, value in values.items() if isinstance(value, float)}
    frame = pd.DataFrame({"index": list(numbers), law: list(numbers.values())})
    if viscous is not None and law != VISCOUS:
        frame[VISCOUS] = [viscous.get(key) for key in numbers]
        frame[f"over {VISCOUS}"] = [
            value / viscous[key] if viscous.get(key) else None for key, value in numbers.items()
        ]
    return frame


def describe_ranges(sink: Sink, checks: Sequence[RangeCheck]) -> None:
    """Write how the inputs of networks and damper model compare with what training and bench tests covered."""
    rows = [
        {"of": check.what, "input": name, "share of time outside": item.outside_share}
        | {"largest input": item.asked[1], "largest known": item.known[1]}
        | {"smallest input": item.asked[0], "smallest known": item.known[0]}
        for check in checks
        for name, item in check.inputs.items()
    ]
    if not rows:
        return
    within = [check.what for check in checks if not check.warning]
    if within:
        sink.text(f"All inputs lie within the range of training and tests: {', '.join(within)}.")
    sink.table(
        "training-range",
        pd.DataFrame(rows),
        "Inputs of networks and damper model in this run, and the range of their training rows and bench tests (SI).",
    )
