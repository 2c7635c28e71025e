"""Reading of a run directory for the report."""

from __future__ import annotations

from mrpipe.errors import UserError
from mrpipe.pipeline.manifest import Manifest
from mrpipe.pipeline.parts import read_part
from mrpipe.pipeline.runner import Pipeline
from mrpipe.pipeline.sources import CAMPAIGN_RECORDERS
from mrpipe.reporting.facts import ReportStage, RunFacts
from mrpipe.thesis import figures as thesis


def run_facts(pipeline: Pipeline) -> RunFacts:
    """Return what the report shows of a run: the stages that belong to it, and nothing that failed calls left behind.

    A recorder belongs to the run where the configuration takes its campaign from the virtual laboratory. A skipped
    stage belongs to it where the configuration lists it.

    Raises
    ------
    UserError
        If no stage has run.
    """
    directory, config = pipeline.run_directory, pipeline.loaded.config
    stages = []
    for name, stage in pipeline.stages.items():
        manifest = Manifest.load(directory / "manifests", name)
        if manifest is None or not _belongs(pipeline, name, manifest):
            continue
        items = read_part(directory, name)
        if thesis.STAGE in config.stages:
            items = thesis.with_citations(items)
        stages.append(
            ReportStage(
                name,
                stage.summary,
                items,
                manifest.summary,
                manifest.warnings,
                manifest.skipped,
                manifest.seconds,
                manifest.failed,
            )
        )
    if not stages:
        raise UserError(
            directory, "", "no stage has run here", "run `mrpipe run` first, or name the directory with --run"
        )
    return RunFacts(
        directory, config.report.title or config.name, config.description, stages, config.model_dump(mode="json")
    )


def _belongs(pipeline: Pipeline, name: str, manifest: Manifest) -> bool:
    recorded = {stage: f"campaign:{rig}" for rig, stage in CAMPAIGN_RECORDERS.items()}
    if name in recorded and pipeline.sources.provider(recorded[name]) != name:
        return False
    return not manifest.skipped or name in pipeline.loaded.config.stages
