"""Models of a notebook in the formats of other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mrpipe.api.structure import IdentifiedFrame
from mrpipe.dampers.model import DamperModel
from mrpipe.errors import UserError
from mrpipe.exports.contract import Subject
from mrpipe.networks.network import Network
from mrpipe.structures import Frame, floor_position


def export(
    model: DamperModel | Network | Frame | IdentifiedFrame,
    folder: str | Path,
    *,
    formats: Sequence[str] = (),
    prefix: str = "mrpipe",
    floor: int = 1,
    drive_unit: str = "",
) -> list[Path]:
    """Write a model for other programs, with test vectors and a README; return the files.

    Parameters
    ----------
    model
        A damper (also one with effects), a network or a frame.
    folder
        Folder of the files, made if missing.
    formats
        Formats among `c`, `json`, `matlab` and, for networks, `onnx`; none: all that are possible.
    prefix
        First part of the names in C and MATLAB.
    floor
        Floor that the damper acts on, from 1, where the model is a frame.
    drive_unit
        `A` or `V`, where the model is a network. Empty: the files have the word `drive` in place of the unit.

    Raises
    ------
    UserError
        If the model has no such format, a step of the damper cannot be translated, or `drive_unit` is neither A nor V.
    """
    from mrpipe.exports.library import write_export

    if drive_unit not in ("", "A", "V"):
        raise UserError("export", f"drive_unit: {drive_unit!r}", "is not the unit of a drive in SI", "give A or V")
    subject = _subject(model, prefix, floor, drive_unit)
    target = Path(folder)
    return [target / name for name in write_export(subject, target, formats)]


def _subject(
    model: DamperModel | Network | Frame | IdentifiedFrame, prefix: str, floor: int, drive_unit: str
) -> Subject:
    from mrpipe.exports.damper import damper_subject
    from mrpipe.exports.frame import frame_subject
    from mrpipe.exports.network import network_subject

    if isinstance(model, DamperModel):
        return damper_subject(model, prefix=prefix)
    if isinstance(model, Network):
        name = "inverse" if model.features.target == "drive" else "forward"
        return network_subject(model, name, prefix, **({"drive_unit": drive_unit} if drive_unit else {}))
    frame = model.frame if isinstance(model, IdentifiedFrame) else model
    return frame_subject(frame, floor_position(frame.floors, floor), prefix=prefix)
