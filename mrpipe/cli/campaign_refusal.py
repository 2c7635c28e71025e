"""Refusal of measured campaigns that stages cannot work with, before any stage is built."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from mrpipe.errors import UserError

if TYPE_CHECKING:
    from mrpipe.campaigns import Campaign
    from mrpipe.config.loader import LoadedConfig
    from mrpipe.pipeline.runner import Pipeline


def refuse_wrong_campaigns(pipeline: Pipeline, names: Collection[str]) -> None:
    """Read every measured campaign that the stages need, and refuse what they would refuse.

    Findings that no stage refuses, such as a doubtful test, do not count. A campaign is not read where all stages that
    read it are up to date, because they have accepted it.

    Parameters
    ----------
    pipeline
        The stages and their configuration.
    names
        Stages that will be built.

    Raises
    ------
    UserError
        If a campaign cannot be read, if a test is too short for the filters, if a channel that `prepare` needs is
        missing, or if the drive never changes and an inverse model is needed.
    """
    from mrpipe.campaigns import load_campaign
    from mrpipe.cli.checking import measured_campaigns, with_required

    needed = with_required(pipeline.stages, names)
    checked = set()
    for key, path in measured_campaigns(pipeline.loaded).items():
        if path in checked or not _is_read(pipeline, needed, key):
            continue
        checked.add(path)
        campaign = load_campaign(path)
        if campaign.rig == "damper-bench" and "prepare" in needed:
            _require_lengths(pipeline, campaign)
            require_motion(pipeline.loaded, campaign)
        if campaign.rig == "damper-bench" and "train-inverse" in needed:
            require_drives(campaign)
        if (
            "identify-frame" in needed
            and "campaign:frame" in pipeline.stages["identify-frame"].inputs
            and key == "frame"
        ):
            require_frame_tests(campaign)


def refuse_before_building(pipeline: Pipeline, names: Sequence[str], *, where_possible: bool = False) -> None:
    """Refuse missing campaigns, wrong settings and unknown declared effects before the first stage is built.

    Parameters
    ----------
    pipeline, names, where_possible
        As for :func:`refuse_missing_campaigns`.

    Raises
    ------
    UserError
        Naming the file and the line.
    """
    refuse_missing_campaigns(pipeline, names, where_possible=where_possible)
    refuse_wrong_settings(pipeline, names)
    refuse_unknown_effects(pipeline, names)


def refuse_missing_campaigns(pipeline: Pipeline, names: Sequence[str], *, where_possible: bool = False) -> None:
    """Refuse stages whose campaign the configuration does not name, before files of an earlier run are changed.

    Parameters
    ----------
    pipeline
        The stages and their configuration.
    names
        Stages that will be built.
    where_possible
        Whether it is enough that one of the stages has data.

    Raises
    ------
    UserError
        If that is so, or if the campaign is not there; the message names the setting of the campaign.
    """
    from mrpipe.cli.checking import measured_campaigns, require_path, with_required
    from mrpipe.config.located import located

    needed = with_required(pipeline.stages, names)
    for key, path in measured_campaigns(pipeline.loaded).items():
        if any(f"campaign:{key.replace('_', '-')}" in pipeline.stages[name].all_inputs for name in needed):
            require_path(pipeline.loaded, key, path)
    lacking = {name: item for name in names if (item := pipeline.sources.lacking(name))}
    if not lacking or (where_possible and len(lacking) < len(names)):
        return
    name, item = next(iter(lacking.items()))
    rig = item.partition(":")[2]
    problem = (
        f"is null, and {name} reads a {rig} campaign{pipeline.sources.demanded_by_settings(pipeline.stages[name])}"
    )
    remedy = "give its path here or with --campaign DIR, or write `laboratory` for the virtual rig"
    raise located(UserError("campaigns", rig.replace("-", "_"), problem, remedy), pipeline.loaded)


def refuse_wrong_settings(pipeline: Pipeline, names: Collection[str]) -> None:
    """Check the settings of stages and of all that they need, before the first of them is built.

    Raises
    ------
    UserError
        If a stage cannot work with its settings; the message names the file and the line.
    """
    from mrpipe.cli.checking import with_required

    needed = with_required(pipeline.stages, names)
    for name in pipeline.stages:
        if name in needed:
            pipeline.check(name)


def refuse_constant_drive(pipeline: Pipeline, names: Collection[str]) -> None:
    """Refuse a bench campaign whose drive never changes where a stage needs an inverse model.

    Without this, the stages before the inverse model would be built first, which takes minutes.

    Raises
    ------
    UserError
        If that is so, or if the campaign cannot be read.
    """
    error = constant_drive(pipeline, names)
    if error is not None:
        raise error


def constant_drive(pipeline: Pipeline, names: Collection[str]) -> UserError | None:
    """Return the error on a drive that never changes where a stage needs an inverse model; None if it may be built.

    Raises
    ------
    UserError
        If the campaign cannot be read.
    """
    from mrpipe.campaigns import load_campaign
    from mrpipe.cli.checking import measured_campaigns, with_required

    path = measured_campaigns(pipeline.loaded).get("bench")
    if path is None or "train-inverse" not in with_required(pipeline.stages, names):
        return None
    if _is_up_to_date(pipeline, "train-inverse"):
        return None
    campaign = load_campaign(path)
    try:
        require_drives(campaign)
    except UserError as error:
        return error
    return None


def refuse_unknown_effects(pipeline: Pipeline, names: Collection[str]) -> None:
    """Refuse a campaign that declares an unknown effect where `close-loop` is needed.

    Without this, the stages before the tracing would be built first, which takes minutes.

    Raises
    ------
    UserError
        If that is so; the message names the line of the campaign file and the nearest known effect.
    """
    from mrpipe.campaigns.header import read_header
    from mrpipe.cli.checking import measured_campaigns, require_known_effects, with_required
    from mrpipe.cli.own_effects import own_effects

    if "close-loop" not in with_required(pipeline.stages, names):
        return
    for path in measured_campaigns(pipeline.loaded).values():
        require_known_effects(read_header(path), own_effects(pipeline.loaded))


def require_motion(loaded: LoadedConfig, campaign: Campaign) -> None:
    """Refuse a bench campaign without the acceleration that `prepare.motion` needs.

    Raises
    ------
    UserError
        If a test lacks it; the message names the test.
    """
    from mrpipe.pipeline.settings_view import setting_named
    from mrpipe.signals.accelerometer import require_acceleration

    channels = {test.name: set(test.channels) for test in campaign.recordings}
    require_acceleration(channels, setting_named(loaded.config, "prepare.motion"), str(campaign.file))


def require_drives(campaign: Campaign) -> None:
    """Refuse a bench campaign whose drive never changes in the training tests, for an inverse model.

    Raises
    ------
    UserError
        If that is so; the message names the campaign file and the drive.
    """
    from mrpipe.campaigns import require_varying

    drives = {test.name: test.used("drive") for test in campaign.with_role("training")}
    require_varying(drives, str(campaign.file))


def require_frame_tests(campaign: Campaign) -> None:
    """Refuse a campaign of a structure whose tests lack what the identification of the frame needs.

    Raises
    ------
    UserError
        If no test shows modes, a forced test has no measured excitation, or a floor is not one of the frame.
    """
    from mrpipe.modal.recordings import frame_tests

    frame_tests(campaign)


def _is_read(pipeline: Pipeline, needed: Collection[str], key: str) -> bool:
    """Return whether a stage that is not up to date reads a campaign, or judges its drive."""
    item = f"campaign:{key.replace('_', '-')}"
    readers = {name for name in needed if item in pipeline.stages[name].all_inputs}
    if key == "bench":
        readers |= {"train-inverse"} & set(needed)
    return not all(_is_up_to_date(pipeline, name) for name in readers)


def _is_up_to_date(pipeline: Pipeline, name: str) -> bool:
    return name not in pipeline.force and pipeline.is_fresh(name)


def _require_lengths(pipeline: Pipeline, campaign: Campaign) -> None:
    from mrpipe.pipeline.settings_view import setting_named
    from mrpipe.signals.lengths import find_short_tests

    files = {test.name: test.file for test in campaign.recordings}
    for item in find_short_tests(campaign, setting_named(pipeline.loaded.config, "prepare")):
        raise UserError(files[item.test] or campaign.file, f"test {item.test}", item.sentence, item.remedy)
