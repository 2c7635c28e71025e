"""What kind of test a frame recording is: sweep, free decay, random or closed loop."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.campaigns.proposal.words import split_words

KINDS: dict[str, set[str]] = {
    "free-decay": {"decay", "free", "ausschwing", "release", "snap", "snapback", "pull", "libre", "ausschwingversuch"},
    "sweep": {"sweep", "chirp", "sine", "gleitsinus", "barrido", "balayage"},
    "closed-loop": {
        *("closed", "loop", "control", "controlled", "geregelt", "boucle", "lazo", "malha", "anello", "regelkreis"),
        *("vd", "vdps", "vdns", "fdns", "lqg", "nnc"),
    },
    "random": {"random", "noise", "white", "rauschen", "quake", "earthquake", "northridge", "kobe", "ambient"},
}
GUESSED_BY_FORCE = "guessed, because a damper force was recorded"
"""Reason for the kind of a test whose name states none."""
MODE = {"mode", "modo", "eigenform", "moda", "m"}
GAINS: dict[str, tuple[str, ...]] = {
    "vd": ("c_n_s_m",),
    "vdps": ("c_n_s_m", "k_n_m"),
    "vdns": ("c_n_s_m", "k_n_m"),
    "fdns": ("alpha_n_m",),
    "nnc": ("alpha_n_m",),
    "lqg": (),
    "passive-off": (),
    "passive-on": (),
}
"""Control law that a file name may state -> names of its gains."""

_PASSIVE = {"passive", "passiv", "passif", "pasivo", "passivo"}
_OFF, _ON = {"off", "aus", "arret", "apagado", "spento"}, {"on", "ein", "an", "marche", "encendido", "acceso"}


def kind_of(path: Path, channels: dict[str, FloatArray], rate: float) -> tuple[str, str]:
    """Return the kind of a frame test and what is unsure about it."""
    words = set(split_words(path.stem)) | set(split_words(path.parent.name))
    for kind, known in KINDS.items():
        if words & known:
            return kind, ""
    if law_of(path):
        return "closed-loop", ""
    if "damper_force" in channels:
        return "closed-loop", GUESSED_BY_FORCE
    floors = [values for name, values in channels.items() if name.startswith("floor_")]
    if not floors:
        return "random", "guessed"
    top = floors[-1] - np.mean(floors[-1])
    parts = [float(np.std(part)) for part in np.array_split(top, 5)]
    ground = channels.get("ground_acceleration")
    still = ground is None or float(np.std(ground)) < 0.02 * float(np.std(top))
    if still and parts[-1] < 0.6 * parts[0]:
        return "free-decay", "guessed from the decaying motion"
    drive = ground if ground is not None and not still else top
    pitches = [_pitch(part, rate) for part in np.array_split(drive, 8)]
    rising = float(np.mean(np.diff(pitches) > 0.0))
    if max(pitches) > 1.5 * min(pitches) and (rising > 0.85 or rising < 0.15):
        return "sweep", "guessed from a frequency that changes steadily"
    return "random", "guessed"


def kind_of_record(channels: dict[str, FloatArray]) -> tuple[str, str]:
    """Return the kind of a strong-motion record: without a channel of the ground only the response is known."""
    if "ground_acceleration" in channels:
        return "random", ""
    return "ambient", "because no channel is known to be the ground's; random if one is"


def law_of(path: Path) -> str:
    """Return the control law that a file name states, empty where it states none."""
    words = split_words(path.stem)
    if _PASSIVE & set(words):
        return "passive-off" if _OFF & set(words) else "passive-on" if _ON & set(words) else ""
    return next((word for word in words if word in GAINS), "")


def mode_of(path: Path) -> int | None:
    """Return the mode that the name of a free decay states, as in `decay_mode2`; None where it states none."""
    words = split_words(path.stem)
    for word, following in pairwise(words):
        if word in MODE and following.isdigit() and 0 < int(following) < 100:
            return int(following)
    return None


def _pitch(values: FloatArray, rate: float) -> float:
    power = np.abs(np.fft.rfft((values - np.mean(values)) * np.hanning(values.size))) ** 2
    return float(np.argmax(power[1:]) + 1) * rate / values.size
