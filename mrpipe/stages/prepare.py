"""`prepare`: measured recordings to filtered, offset-free, differentiated tests with their steady cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.campaigns import Campaign
    from mrpipe.signals.preparation import Preparation

_SHOWN_TESTS = 3


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.signals.faults import KnownFaults
    from mrpipe.signals.preparation import PreparationOptions, prepare_campaign
    from mrpipe.signals.prepared import write_prepared

    settings = context.settings.prepare
    known = settings.corrections
    campaign = load_campaign(context.inputs["campaign:bench"])
    for finding in campaign.findings:
        context.warn(finding)
    options = PreparationOptions(
        working_rate_hz=settings.working_rate_hz,
        cutoff_hz=settings.cutoff_hz,
        velocity_cutoff_hz=settings.velocity_cutoff_hz,
        order=settings.order,
        phase=settings.phase,
        cutoff_choice=settings.cutoff_choice,
        differentiation=settings.differentiation,
        savitzky_golay_window_s=settings.savitzky_golay_window_s,
        kalman_displacement_noise_m=settings.kalman_displacement_noise_m,
        kalman_acceleration_noise_m_s2=settings.kalman_acceleration_noise_m_s2,
        kalman_bias_drift_m_s3=settings.kalman_bias_drift_m_s3,
        offset=settings.offset,
        displacement_late_s=settings.displacement_late_s,
        cycles=settings.cycles,
        settle_cycles=settings.settle_cycles,
        faults=KnownFaults(
            force_late_s=known.force_late_s,
            force_offset_n=known.force_offset_n,
            force_per_drive_n=known.force_per_drive_n,
            force_per_drive_squared_n=known.force_per_drive_squared_n,
            drive_lag_s=known.drive_lag_s,
            force_drift_n_s=known.force_drift_n_s,
        ),
    )
    prepared = prepare_campaign(campaign, options, context.progress)
    preparations = prepared.tests
    for finding in prepared.findings:
        context.warn(finding)
    for line in summarised([(item.test.name, line) for item in preparations for line in item.findings]):
        context.warn(line)
    with context.write("prepared.h5") as artifact:
        write_prepared(artifact, [item.test for item in preparations])
        artifact.put_json("campaign", {"name": campaign.name, "findings": list(context.warnings)})
        artifact.put_json("preparation", [_row(item) for item in preparations])
    _report(context, campaign, preparations)
    return {
        "campaign": campaign.name,
        "test_count": len(preparations),
        "sampling_rate_hz": preparations[0].test.sampling_rate_hz,
        "drive_unit": campaign.drive_unit,
        "drive_is_set_point": campaign.drive_is_set_point,
        "differentiation": options.differentiation,
        "phase": options.phase,
        "findings": list(context.warnings),
        "tests": [_row(item) for item in preparations],
    }


def summarised(lines: Sequence[tuple[str, str]]) -> list[str]:
    """Return one line for each finding that several tests share, with how many they are."""
    tests: dict[str, list[str]] = {}
    for test, line in lines:
        tests.setdefault(line, []).append(test)
    return [
        f"test {names[0]}: {line}" if len(names) == 1 else f"{len(names)} tests ({names[0]}, ...): {line}"
        for line, names in tests.items()
    ]


def _row(item: Preparation) -> dict[str, Any]:
    test = item.test
    return {
        "name": test.name,
        "role": test.role,
        "excitation": test.excitation,
        "duration_s": float(test.time_s.size / test.sampling_rate_hz),
        "frequency_hz": item.frequency_hz,
        "amplitude_m": item.amplitude_m,
        "cycles": max(0, int(test.cycles.size) - 1),
        "displacement_offset_m": test.displacement_offset_m,
        "force_offset_n": test.force_offset_n,
        "force_peak_n": float(abs(test.force_n).max()),
        "velocity_peak_m_s": float(abs(test.velocity_m_s).max()),
        "drive_mean": float(test.drive.mean()),
        "cutoffs_hz": {name: float(value) for name, value in item.cutoffs_hz.items()},
    }


def _report(context: StageContext, campaign: Campaign, preparations: Sequence[Preparation]) -> None:
    import pandas as pd

    from mrpipe.reporting.signals import loops, prepared_history, spectra_before_and_after

    rows = [_row(item) for item in preparations]
    random = sum(row["excitation"] == "random" for row in rows)
    context.report.text(
        f"{len(rows)} tests of the campaign {campaign.name}, {len(rows) - random} periodic and {random} random, at "
        f"{preparations[0].test.sampling_rate_hz:g} Hz."
    )
    for warning in context.warnings:
        context.report.text(f"Noticed: {warning}.")
    cutoffs = pd.DataFrame([row.pop("cutoffs_hz") for row in rows]).add_suffix("_cutoff_hz")
    context.report.table("tests", pd.concat([pd.DataFrame(rows), cutoffs], axis=1), "The prepared tests.")
    shown = preparations[len(preparations) // 2]
    units = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s²", "force": "N", "drive": campaign.drive_unit}
    spectra, before, after = _channels(shown)
    context.report.figure(
        "spectra",
        spectra_before_and_after(spectra, units, shown.cutoffs_hz),
        f"Power spectra before and after, test {shown.test.name}.",
    )
    context.report.figure(
        "history",
        prepared_history(shown.test.time_s, before, after, units, shown.test.cycles),
        f"Channels before and after (thesis Figures 2.10 and 2.11 a), test {shown.test.name}.",
    )
    step = max(1, len(preparations) // _SHOWN_TESTS)
    chosen = [item.test for item in preparations[::step][:_SHOWN_TESTS]]
    parts = [slice(int(test.cycles[0]), int(test.cycles[-1])) if test.cycles.size else slice(None) for test in chosen]
    context.report.figure(
        "loops",
        loops(
            [
                (test.name, test.displacement_m[part], test.velocity_m_s[part], test.force_n[part])
                for test, part in zip(chosen, parts, strict=True)
            ]
        ),
        "Force over displacement and over velocity.",
    )


def _channels(item: Preparation) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return spectra, channels before and channels after of one test."""
    from mrpipe.signals.spectra import power_spectrum

    test = item.test
    after = {
        "displacement": test.displacement_m,
        "velocity": test.velocity_m_s,
        "acceleration": test.acceleration_m_s2,
        "force": test.force_n,
        "drive": test.drive,
    }
    before = {name: item.before[name] for name in after if name in item.before}
    rate = test.sampling_rate_hz
    spectra = {
        name: (power_spectrum(values, rate), power_spectrum(after[name], rate))
        for name, values in before.items()
        if values.max() > values.min()
    }
    return spectra, before, after


STAGE = Stage(
    name="prepare",
    summary="Filter, remove offsets, differentiate, find the steady cycles.",
    run=_run,
    inputs=("campaign:bench",),
    after=("record-frame",),
    settings=("prepare",),
    outputs=("prepared.h5",),
)
