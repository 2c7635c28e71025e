"""`close-loop` on a structure: the residual of a linear frame, and of its closed loop, traced to an effect.

This stage replaces the stage on a bench campaign if the user gives a campaign of a shear frame, or has no bench
campaign.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from mrpipe.errors import StageSkipped
from mrpipe.pipeline.stage import Stage, StageContext

if TYPE_CHECKING:
    from mrpipe.config.model import RunSettings
    from mrpipe.tracing.structure.verdict import StructureTracing


def _run(context: StageContext) -> Mapping[str, Any]:
    from mrpipe.campaigns import load_campaign
    from mrpipe.effects.declared import declared_effects
    from mrpipe.effects.library import damper_effects
    from mrpipe.effects.structural import library as structural
    from mrpipe.reporting import close_loop_frame as section
    from mrpipe.tracing.options import tracing_options
    from mrpipe.tracing.structure.verdict import trace_structure

    settings = context.settings.close_loop
    campaigns = [load_campaign(path) for name, path in context.inputs.items() if name.startswith("campaign:")]
    for campaign in campaigns:
        for finding in campaign.findings:
            context.warn(finding)
    if not any(_masses_are_known(campaign.floor_masses_kg) for campaign in campaigns) and not any(
        "drive" in test.channels for campaign in campaigns for test in campaign.recordings
    ):
        raise StageSkipped(
            "the masses of the floors are not given, or not all of them, so no storey force can be computed: "
            "write frame: {floor_masses_kg: [...]} in campaign.yaml"
        )
    own, of_damper = structural.effects_of_files(settings.effect_files)
    library = structural.structural_effects(settings.candidates, own)
    for campaign in campaigns:
        known = {**structural.all_structural_effects(), **damper_effects(), **library}
        declared_effects(campaign.declared_effects, known, campaign.file, of_damper)
    for name, path in of_damper.items():
        context.warn(f"{path}: {name!r} is not tried: it {structural.NOT_TRIED}; {structural.TRACED_ON_BENCH}")
    asked = tracing_options(settings)
    # few long tests: fewer forms are refitted, and nothing filtered their force
    options = asked.changed(refits=min(settings.refits, 4), observation_filter=False, unattributed=False)
    traced = trace_structure(
        campaigns,
        library,
        damper_effects(),
        options,
        rng=context.rng,
        jobs=context.jobs,
        progress=context.progress,
    )
    reasons = dict.fromkeys(of_damper, f"it {structural.NOT_TRIED}")
    traced = replace(traced, summary={**traced.summary, "not_tried": reasons})
    for finding in traced.findings:
        context.warn(finding)
    _write(context, traced)
    section.describe(context.report, section.TracedStructure(traced, settings.named_share, settings.least_share))
    return traced.summary


def _check(settings: Any) -> None:
    """Check that the effects to be considered are known, and that files of the user can be read."""
    from mrpipe.effects.library import damper_effects
    from mrpipe.effects.own import require_candidates
    from mrpipe.effects.structural import library as structural

    section = settings.close_loop
    if section.candidates or section.effect_files:
        own, of_damper = structural.effects_of_files(section.effect_files)
        known = {*structural.all_structural_effects(), *damper_effects(), *(item.name for item in own), *of_damper}
        require_candidates(section.candidates, known)


def _masses_are_known(masses_kg: Sequence[float]) -> bool:
    return bool(masses_kg) and all(math.isfinite(mass) for mass in masses_kg)


def _write(context: StageContext, traced: StructureTracing) -> None:
    from mrpipe.artifacts import atomic_write_text
    from mrpipe.artifacts.plain import to_json

    with context.write("close-loop.h5") as artifact:
        artifact.put_json("summary", dict(traced.summary))
        for name, history in traced.histories.items():
            artifact.put(name, history.values, unit=history.unit, dims=history.dims)
    atomic_write_text(context.run_directory / "close-loop.json", to_json(traced.summary) + "\n")


def _stage(*inputs: str) -> Stage:
    return Stage(
        name="close-loop",
        summary="Trace the residual of a structure to a missing effect, add it, and report the error before and after.",
        run=_run,
        inputs=inputs,
        settings=("close_loop",),
        outputs=("close-loop.h5", "close-loop.json"),
        check=_check,
    )


def variant(configuration: RunSettings, given: str = "") -> Stage | None:
    """Return the stage on the campaign of a structure; None if the tracing is that of the bench.

    Parameters
    ----------
    configuration
        The whole configuration.
    given
        Entry of `campaigns` that the user named on the command line, empty for none.
    """
    from mrpipe.config.sections.campaigns import LABORATORY

    campaigns = configuration.campaigns
    if given in ("frame", "closed_loop"):
        return _stage(f"campaign:{given.replace('_', '-')}")
    own = [name for name in ("frame", "closed_loop") if getattr(campaigns, name) not in (None, LABORATORY)]
    if given or campaigns.bench is not None or not own:
        return None
    return _stage(*(f"campaign:{name.replace('_', '-')}" for name in own))
