"""Dampers with effects, from an artifact or by name; the library of effects converts names to steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from mrpipe.artifacts import Artifact, load_parameter_set
from mrpipe.dampers.model import Addition, DamperModel, damper_from_parameter_set
from mrpipe.dampers.model import read_damper as read_plain
from mrpipe.effects.library import damper_effects, load_effect_file
from mrpipe.errors import UserError
from mrpipe.words import listed

DAMPERS_OF_A_RUN = ("identified", "traced")
"""Names of the dampers that the stages of a run build."""


def read_damper(artifact: Artifact, group: str = "damper") -> DamperModel:
    """Read a damper with its effects.

    Raises
    ------
    UserError
        If an effect is unknown, or the file that defines it is missing.
    """

    drive_unit = str(artifact.attributes(group)["drive_unit"])

    def effect(name: str, form: str, file: str) -> Addition:
        known = damper_effects()
        if not file and name not in known:
            raise UserError(artifact.path, f"{group}/effects", f"no effect {name!r}", "build it again with --force")
        found = load_effect_file(Path(file)) if file else known[name]
        shape = found.form(form)
        units = {item.name: item.unit.replace("drive", drive_unit) for item in shape.parameters}
        return Addition(name, form, {}, units, found.sensor, shape.steps, file)

    return read_plain(artifact, group, effect=effect)


def damper_named(name: str, artifacts: Mapping[str, Callable[[], Artifact]], setting: str = "") -> DamperModel:
    """Return the damper that a setting names.

    Parameters
    ----------
    name
        A key of `artifacts` (`identified`, `traced`), an artifact file (`.h5`) such as that of another run, a set of
        configs/dampers, or its YAML file.
    artifacts
        Name -> function that opens the artifact of this run that contains the damper.
    setting
        Setting that gives the name, for the message.

    Raises
    ------
    UserError
        If there is no such damper.
    """
    if name in artifacts:
        return read_damper(artifacts[name]())
    if setting:
        require_damper(name, setting, tuple(artifacts))
    if name.endswith(".h5"):
        path = Path(name).absolute()
        if not path.is_file():
            remedy = (
                "name an existing damper artifact, or a set of configs/dampers, in calibrate.damper or simulate.damper"
            )
            raise UserError(path, "damper", "no such artifact", remedy)
        return read_damper(Artifact(Path(name)))
    return damper_from_parameter_set(load_parameter_set("dampers", name))


def require_damper(name: str, setting: str = "", of_run: Sequence[str] = DAMPERS_OF_A_RUN) -> None:
    """Refuse a damper that is not there, before stages are built for it.

    Parameters
    ----------
    name
        As in :func:`damper_named`.
    setting
        Setting that gives the name; empty for the option `--damper`.
    of_run
        Names of the dampers that stages of the run build.

    Raises
    ------
    UserError
        If there is no such artifact and no such parameter set.
    """
    if name in of_run:
        return
    if name.endswith(".h5"):
        if setting and not Path(name).is_file():
            raise UserError(setting, "", f"no such artifact {name}", f"name an existing file, or {listed(of_run)}")
        damper_named(name, {})
        return
    try:
        load_parameter_set("dampers", name)
    except UserError as error:
        if "no such parameter set" not in error.problem:
            raise
        known = f"{', '.join(of_run)}, a file, or one of the {error.remedy}"
        if setting:
            raise UserError(setting, "", f"no such damper {name!r}", known) from None
        raise UserError("--damper", name, "no such damper", known) from None
