"""Where the inputs of stages come from: other stages, campaigns of the user, the virtual laboratory, public data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mrpipe.artifacts import public_data_directory
from mrpipe.config.loader import LoadedConfig
from mrpipe.config.sections.campaigns import LABORATORY
from mrpipe.pipeline.fingerprint import FileHashes
from mrpipe.pipeline.stage import Stage
from mrpipe.words import listed

CAMPAIGN_RECORDERS = {"bench": "record-bench", "frame": "record-frame", "closed-loop": "record-closed-loop"}
"""Kind of rig -> stage that records its campaign on the virtual laboratory."""

ABSENT = "absent"
"""Digest of an input that does not exist."""

CAMPAIGN = "campaign:"
"""Prefix of inputs that are campaigns."""


@dataclass(frozen=True)
class Sources:
    """The inputs of the stages of one configuration.

    Attributes
    ----------
    loaded
        The configuration.
    stages
        Name -> stage.
    run_directory
        Folder of the artifacts.
    hashes
        Digests of files.
    """

    loaded: LoadedConfig
    stages: Mapping[str, Stage]
    run_directory: Path
    hashes: FileHashes

    def campaign(self, rig: str) -> str | None:
        """Return the configured campaign of a rig: a path, `laboratory`, or None."""
        source: str | None = getattr(self.loaded.config.campaigns, rig.replace("-", "_"))
        return source

    def provider(self, name: str) -> str | None:
        """Return the stage that makes an input, or None if it comes from outside."""
        if not name.startswith(CAMPAIGN):
            return name
        rig = name.removeprefix(CAMPAIGN)
        return CAMPAIGN_RECORDERS[rig] if self.campaign(rig) == LABORATORY else None

    def needs_laboratory(self, name: str) -> bool:
        """Return whether an input is recorded on the virtual rig, or made from such a recording."""
        provider = self.provider(name)
        if provider is None:
            return False
        return provider in CAMPAIGN_RECORDERS.values() or any(
            self.needs_laboratory(item) for item in self.stages[provider].inputs
        )

    def mixed_with_laboratory(self, recorder: str) -> str:
        """Return what the user should know where a virtual recording is used together with data of the user; else "".

        Parameters
        ----------
        recorder
            Stage that records a campaign in the virtual laboratory.
        """
        config = self.loaded.config
        rigs = {stage: rig.replace("-", "_") for rig, stage in CAMPAIGN_RECORDERS.items()}
        sources = config.campaigns.model_dump()
        given = [f"campaigns.{rig}" for rig, source in sources.items() if source not in {None, LABORATORY}]
        structure: Any = getattr(config, "structure", None)
        given += ["structure"] if structure != type(structure)() else []
        if recorder not in rigs or not given:
            return ""
        key = f"campaigns.{rigs[recorder]}"
        return (
            f"records a virtual campaign, because {key} is `{LABORATORY}`, but {listed(given)} "
            f"{'describes' if len(given) == 1 else 'describe'} your own rig: results mix both. Give your campaign as "
            f"{key}, or null where no campaign of this kind exists"
        )

    def path(self, name: str) -> Path | None:
        """Return the path of an input (whether built or not), or None if the configuration has none."""
        provider = self.provider(name)
        if provider is not None:
            return self.run_directory / self.stages[provider].outputs[0]
        source = self.campaign(name.removeprefix(CAMPAIGN))
        return None if source is None else Path(source)

    def configured(self, name: str) -> bool:
        """Return whether all campaigns that an input depends on are configured."""
        provider = self.provider(name)
        if provider is None:
            return self.path(name) is not None
        return all(self.configured(item) for item in self.stages[provider].inputs)

    def no_campaign(self, name: str, *, campaign_given: bool) -> str:
        """Return the reason why a campaign cannot be read that the configuration does not name.

        Parameters
        ----------
        name
            The input.
        campaign_given
            The user named a campaign on the command line.
        """
        rig = name.removeprefix(CAMPAIGN)
        given = "the one given with --campaign is of another kind; " if campaign_given else ""
        return f"there is no {rig} campaign ({given}give campaigns.{rig.replace('-', '_')}, or --campaign DIR)"

    def demanded_by_settings(self, stage: Stage) -> str:
        """Return which settings make a stage need a campaign that is not configured, so that a user can change them."""
        required = stage.required_by(self.loaded.config)
        named = [setting for item, settings in required.items() if not self.configured(item) for setting in settings]
        return f"; {stage.name} needs it because of {', '.join(dict.fromkeys(named))}" if named else ""

    def lacking(self, name: str) -> str:
        """Return the campaign without which a stage cannot be built; empty if there are all."""
        for item in self.stages[name].inputs:
            provider = self.provider(item)
            lacking = self.lacking(provider) if provider is not None else "" if self.path(item) is not None else item
            if lacking:
                return lacking
        return ""

    def digest(self, name: str, path: Path) -> str:
        """Return the digest of an input; of a campaign, that of all its files."""
        if not path.exists():
            return ABSENT
        if name.startswith(CAMPAIGN):
            from mrpipe.campaigns import campaign_files

            return self.hashes.digest_many(campaign_files(path), path if path.is_dir() else path.parent)
        return self.hashes.digest(path)

    def digest_of_public_data(self, folders: Sequence[str]) -> str:
        """Return the digest of folders of the public data; `absent` if none of them exists."""
        base = public_data_directory()
        there = [] if base is None else [base / name for name in folders if (base / name).is_dir()]
        return self.hashes.digest_many(there, base) if base is not None and there else ABSENT
