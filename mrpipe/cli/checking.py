"""The checks of `mrpipe check`: settings, campaign files and data, read in the same way as by `mrpipe run`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrpipe.errors import UserError
from mrpipe.words import counted, shortest

if TYPE_CHECKING:
    from mrpipe.campaigns import Campaign
    from mrpipe.campaigns.header import CampaignHeader
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.config.loader import LoadedConfig
    from mrpipe.pipeline.stage import Stage

RIGS = {"bench": "damper-bench", "frame": "shear-frame", "closed_loop": "shear-frame"}
"""Key of `campaigns` -> rig that it takes."""


@dataclass(frozen=True)
class CheckResult:
    """Findings of a check.

    Attributes
    ----------
    campaigns
        Key of `campaigns` -> the campaign in a few words.
    notes
        Key of `campaigns` -> notes of the reader of the campaign files.
    findings
        Key of `campaigns` -> findings of the plausibility checks.
    """

    campaigns: dict[str, str] = field(default_factory=dict)
    notes: dict[str, list[str]] = field(default_factory=dict)
    findings: dict[str, list[Finding]] = field(default_factory=dict)

    @property
    def errors(self) -> int:
        """Number of findings that are errors."""
        return sum(item.severity == "error" for items in self.findings.values() for item in items)

    def as_dict(self) -> dict[str, Any]:
        """Return campaigns and findings as plain structure for JSON."""
        notes = [
            {"campaign": key, "name": "reader", "severity": "warning", "sentence": line}
            for key, lines in self.notes.items()
            for line in lines
        ]
        judged = [{"campaign": key, **item.as_dict()} for key, items in self.findings.items() for item in items]
        return {"campaigns": self.campaigns, "findings": [*notes, *judged], "errors": self.errors}


def check_stages(loaded: LoadedConfig) -> None:
    """Check the settings of every stage of the configuration.

    Effect files are read and not run, because the configuration may come from somebody else.

    Raises
    ------
    UserError
        If a stage is unknown or its settings do not fit together; the message names the file and the line.
    """
    from mrpipe.cli.own_effects import refuse_other_rig, without_own_effects
    from mrpipe.cli.session import require_stages
    from mrpipe.config.located import located
    from mrpipe.pipeline.settings_view import SettingsView

    require_stages(loaded)
    refuse_other_rig(loaded)
    try:
        config = without_own_effects(loaded)
        needed = needed_stages(loaded)
        for name, stage in _stages(loaded).items():
            if name in needed and stage.check is not None:
                stage.check(SettingsView(config, stage.settings, name))
    except UserError as error:
        raise located(error, loaded) from error


def measured_campaigns(loaded: LoadedConfig) -> dict[str, Path]:
    """Return key of `campaigns` -> path of the measured campaigns; the virtual laboratory is left out."""
    from mrpipe.config.sections.campaigns import LABORATORY

    sources = loaded.config.campaigns.model_dump()
    return {key: Path(source) for key, source in sources.items() if source not in (None, LABORATORY)}


def require_path(loaded: LoadedConfig, key: str, path: Path) -> None:
    """Refuse a campaign that is not there.

    Parameters
    ----------
    loaded
        The configuration.
    key
        Its key under `campaigns`.
    path
        Its directory or file.

    Raises
    ------
    UserError
        If that is so; the message names the line of the configuration.
    """
    from mrpipe.config.located import located

    if not path.exists():
        problem = f"there is no {shortest(path)}"
        remedy = "name a directory that holds campaign.yaml, or such a file, relative to the configuration"
        raise located(UserError("campaigns", key, problem, remedy), loaded)


def check_headers(loaded: LoadedConfig) -> None:
    """Check each campaign file without its data: the rig, the declared effects, and that the data files exist.

    Raises
    ------
    UserError
        If a campaign belongs under another key, declares an unknown effect, or lacks a file.
    """
    from mrpipe.campaigns import campaign_files
    from mrpipe.campaigns.files import not_found
    from mrpipe.campaigns.header import read_header
    from mrpipe.cli.own_effects import own_effects

    for key, path in measured_campaigns(loaded).items():
        require_path(loaded, key, path)
        header = read_header(path)
        if header.rig != RIGS[key]:
            right = next(other for other, rig in RIGS.items() if rig == header.rig)
            raise UserError(
                loaded.path,
                f"campaigns.{key}",
                f"names a {header.rig} campaign ({shortest(header.file)}), but takes a {RIGS[key]} campaign",
                f"name it under campaigns.{right}",
            )
        require_known_effects(header, own_effects(loaded))
        require_known_laws(header)
        for file in campaign_files(path):
            if not file.is_file():
                raise not_found(file)


def require_known_effects(header: CampaignHeader, own: Mapping[str, str] | None = None) -> None:
    """Refuse unknown effects that a campaign declares.

    Parameters
    ----------
    header
        Head of the campaign.
    own
        Name -> class of the user's own effects, as :func:`mrpipe.cli.own_effects.own_effects` returns them.

    Raises
    ------
    UserError
        If an effect is unknown; the message names the nearest known effect. A structure cannot declare the user's own
        effects on a damper.
    """
    own = own or {}
    if not header.declared_effects or "" in own:
        return
    from mrpipe.effects.declared import require_known

    of_damper = {name for name, kind in own.items() if kind == "Effect" and header.rig == "shear-frame"}
    known = effects_of_rig(header.rig) | (set(own) - of_damper)
    require_known(header.declared_effects, known, header.file, of_damper)


def require_known_laws(header: CampaignHeader) -> None:
    """Refuse closed-loop tests whose control law, or one of its gains, is unknown.

    Raises
    ------
    UserError
        If a law or gain is unknown; the message names the nearest known one.
    """
    if not header.laws:
        return
    from mrpipe.artifacts.yaml_source import nearest, read_yaml
    from mrpipe.control.laws import law_named, law_names

    source = read_yaml(header.file)
    for index, (law, gains) in header.laws.items():
        if law not in law_names():
            place = ("tests", index, "law")
            raise source.error(
                place,
                f"unknown control law {law!r}",
                f"{nearest(law, set(law_names()))}; if it is another law, leave out the keys law and gains",
            )
        known = {item.name for item in law_named(law).gains}
        for name in gains:
            if name not in known:
                remedy = nearest(name, known) if known else "the law has no gains"
                raise source.error(("tests", index, "gains"), f"law {law} has no gain {name!r}", remedy)


def known_effects() -> set[str]:
    """Return the names of all effects of the library."""
    from mrpipe.effects.structural.library import all_structural_effects

    return {*known_damper_effects(), *all_structural_effects()}


def effects_of_rig(rig: str) -> set[str]:
    """Return the names of the effects of the library that a campaign of this rig can declare."""
    return known_effects() if rig == "shear-frame" else known_damper_effects()


def known_damper_effects() -> set[str]:
    """Return the names of the effects of a damper in the library."""
    from mrpipe.effects.library import all_effects

    return set(all_effects())


def check_campaigns(loaded: LoadedConfig) -> CheckResult:
    """Read all measured campaigns and judge them.

    Raises
    ------
    UserError
        If a campaign cannot be read.
    """
    from mrpipe.campaigns import load_campaign
    from mrpipe.campaigns.plausibility import judge
    from mrpipe.cli.closed_loop_checks import without_law, without_modes
    from mrpipe.cli.own_effects import not_tried

    measured = measured_campaigns(loaded)
    result = CheckResult()
    for key, source in loaded.config.campaigns.model_dump().items():
        if key not in measured:
            result.campaigns[key] = source or "none"
            continue
        if key == "closed_loop" and measured[key] == measured.get("frame"):
            result.campaigns[key] = f"{result.campaigns['frame']}, the same as frame"
            result.findings[key] = without_law(load_campaign(measured[key]))
            continue
        campaign = load_campaign(measured[key])
        result.campaigns[key] = f"{campaign.name}: {counted(len(campaign.recordings), 'test')}"
        result.notes[key] = list(campaign.findings)
        judged = judge(campaign)
        # where the clock is wrong, so are the durations
        clock_is_wrong = any(item.channel == "time" and item.severity == "error" for item in judged)
        result.findings[key] = [
            *judged,
            *([] if clock_is_wrong else _too_short(loaded, campaign)),
            *_refused_by_stages(loaded, key, campaign),
            *_no_validation(loaded, key, campaign),
            *not_tried(loaded, key),
        ]
        if key == "closed_loop":
            result.findings[key] += without_law(campaign) + without_modes(loaded, campaign)
    return result


def _no_validation(loaded: LoadedConfig, key: str, campaign: Campaign) -> list[Finding]:
    """Return a finding where close-loop will trace this structure and no test of it validates."""
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.cli.own_effects import traces_structure

    if key == "bench" or not traces_structure(loaded):
        return []
    if not campaign.floor_masses_kg or any(test.role == "validation" for test in campaign.recordings):
        return []
    return [
        Finding(
            name="no-validation",
            severity="error",
            sentence="no test has the role validation, so close-loop cannot judge what it finds",
            remedy="write role: validation for one forced test, or take close-loop out of stages",
        )
    ]


def _too_short(loaded: LoadedConfig, campaign: Campaign) -> list[Finding]:
    if campaign.rig != "damper-bench" or "prepare" not in needed_stages(loaded):
        return []
    from mrpipe.pipeline.settings_view import setting_named
    from mrpipe.signals.lengths import find_short_tests

    return find_short_tests(campaign, setting_named(loaded.config, "prepare"))


def _refused_by_stages(loaded: LoadedConfig, key: str, campaign: Campaign) -> list[Finding]:
    """Return what stages of the configuration refuse of a campaign, with the message of the stage."""
    from mrpipe.cli.campaign_refusal import require_drives, require_frame_tests, require_motion

    needed = needed_stages(loaded)
    found = []
    if key == "frame" and "identify-frame" in needed and "campaign:frame" in _stages(loaded)["identify-frame"].inputs:
        found.append(_refusal("no-frame-tests", lambda: require_frame_tests(campaign)))
    if campaign.rig != "damper-bench":
        return [item for item in found if item is not None]
    if "prepare" in needed:
        found.append(_refusal("no-acceleration", lambda: require_motion(loaded, campaign)))
    if "train-inverse" in needed:
        found.append(_refusal("constant-drive", lambda: require_drives(campaign)))
    return [item for item in found if item is not None]


def _refusal(name: str, require: Callable[[], None]) -> Finding | None:
    """Return the error that a requirement raises as a finding."""
    from mrpipe.campaigns.plausibility import Finding

    try:
        require()
    except UserError as error:
        test = error.where.removeprefix("test ")
        return Finding(
            name=name,
            severity="error",
            sentence=error.problem,
            remedy=error.remedy,
            test=test if test != error.where else "",
            channel="" if test != error.where else error.where,
        )
    return None


def needed_stages(loaded: LoadedConfig) -> set[str]:
    """Return the stages that `mrpipe run` builds: those of the configuration, and those that they cannot do without."""
    return with_required(_stages(loaded), loaded.config.stages)


def _stages(loaded: LoadedConfig) -> dict[str, Stage]:
    from mrpipe.stages.registry import stages_for

    return {name: stage.for_configuration(loaded.config) for name, stage in stages_for(loaded.config).items()}


def with_required(stages: Mapping[str, Stage], names: Collection[str]) -> set[str]:
    """Return the named stages, and those that they cannot do without."""
    found: set[str] = set()
    waiting = [name for name in names if name in stages]
    while waiting:
        name = waiting.pop()
        found.add(name)
        waiting += [item for item in stages[name].inputs if item in stages and item not in found]
    return found


def stages_without_data(loaded: LoadedConfig) -> dict[str, str]:
    """Return stage -> missing campaign, for stages that need one which the configuration does not name.

    A stage also needs the campaigns of the stages that it depends on.

    Raises
    ------
    UserError
        If no stage has data.
    """
    campaigns = loaded.config.campaigns.model_dump()
    stages = _stages(loaded)
    without: dict[str, str] = {}

    def missing(name: str) -> str:
        for item in stages[name].inputs:
            key = item.partition(":")[2]
            lacking = item if key and campaigns.get(key.replace("-", "_")) is None else "" if key else missing(item)
            if lacking:
                return lacking
        return ""

    for name in loaded.config.stages:
        if name in stages and missing(name):
            without[name] = missing(name).partition(":")[2]
    if without and set(without) == set(loaded.config.stages) - {"report"}:
        raise UserError(
            loaded.path,
            "campaigns",
            f"no stage has data, because no {' or '.join(sorted(set(without.values())))} campaign is named",
            "write the path of a campaign there, or `laboratory` for the virtual rig",
        )
    return without
