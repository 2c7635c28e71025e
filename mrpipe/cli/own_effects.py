"""The user's own effect files as `mrpipe check` sees them: read, and not run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrpipe.errors import UserError

if TYPE_CHECKING:
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.config.loader import LoadedConfig
    from mrpipe.config.model import RunSettings
    from mrpipe.effects.file_reading import FoundEffect


def _read(loaded: LoadedConfig) -> dict[Path, FoundEffect]:
    """Return file -> effect of the files that the configuration names."""
    from mrpipe.effects.file_reading import effect_in_file
    from mrpipe.effects.own import require_free_names
    from mrpipe.pipeline.settings_view import setting_named

    files = setting_named(loaded.config, "close_loop.effect_files")
    found = {path: effect_in_file(path) for path in map(Path, files or ())}
    require_free_names((path, effect.name) for path, effect in found.items())
    return found


def own_effects(loaded: LoadedConfig) -> dict[str, str]:
    """Return name -> class of the effects in the user's files, read without running them.

    The name is empty if it is only known when the file is run; the class is `Effect`, `StructuralEffect`, or empty.

    Raises
    ------
    UserError
        If a file is missing, is not Python, or defines no EFFECT, or if an effect has the name of another one.
    """
    return {found.name: found.kind for found in _read(loaded).values()}


def without_own_effects(loaded: LoadedConfig) -> RunSettings:
    """Return the configuration without effect files, and without the candidates, which are checked here.

    Raises
    ------
    UserError
        If a candidate is unknown; it may be an effect of the program or of one of the files.
    """
    from mrpipe.cli.checking import effects_of_rig
    from mrpipe.effects.own import require_candidates

    own = own_effects(loaded)
    if not own:
        return loaded.config
    section: Any = loaded.config.close_loop  # type: ignore[attr-defined]
    # a name that the file computes is known only when the file is run
    if "close-loop" in loaded.config.stages and "" not in own:
        rig = "shear-frame" if traces_structure(loaded) else "damper-bench"
        require_candidates(section.candidates, {*effects_of_rig(rig), *own})
    changed = section.model_copy(update={"effect_files": (), "candidates": ()})
    return loaded.config.model_copy(update={"close_loop": changed})


def traces_structure(loaded: LoadedConfig) -> bool:
    """Return whether `close-loop` is a stage of the configuration and traces a structure."""
    from mrpipe.stages.close_loop_frame import variant

    return "close-loop" in loaded.config.stages and variant(loaded.config) is not None


def refuse_other_rig(loaded: LoadedConfig) -> None:
    """Refuse a file with an effect of a structure where `close-loop` traces a damper, as this stage does.

    Raises
    ------
    UserError
        If there is such a file.
    """
    from mrpipe.effects.library import OF_STRUCTURE

    if "close-loop" not in loaded.config.stages or traces_structure(loaded):
        return
    for path, found in _read(loaded).items():
        if found.kind == "StructuralEffect":
            raise UserError(path, "EFFECT", *OF_STRUCTURE)


def not_tried(loaded: LoadedConfig, key: str) -> list[Finding]:
    """Return the user's effects on a damper that `close-loop` will not try, because it traces a structure.

    Parameters
    ----------
    loaded
        Configuration.
    key
        Key of `campaigns`. An effect file belongs to no campaign, so the findings are those of the first campaign of a
        structure.
    """
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.cli.checking import measured_campaigns
    from mrpipe.effects.structural.library import NOT_TRIED, TRACED_ON_BENCH

    first = next((name for name in measured_campaigns(loaded) if name != "bench"), "")
    if key != first or not traces_structure(loaded):
        return []
    return [
        Finding("effect-not-tried", "warning", f"{name!r} of close_loop.effect_files {NOT_TRIED}", TRACED_ON_BENCH)
        for name, kind in own_effects(loaded).items()
        if kind == "Effect"
    ]
