"""The text of a proposed campaign.yaml, with comments on what was found and what is unsure."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from mrpipe.campaigns.proposal.columns import Guess

_PLAIN = re.compile(r"^[A-Za-z][A-Za-z0-9_.-]*$")
_RESERVED = {"y", "n", "yes", "no", "on", "off", "true", "false", "null", "none"}


@dataclass(frozen=True)
class TestText:
    """One test of the proposed file; `channels` are those that differ from the campaign's."""

    __test__ = False

    name: str
    file: str
    channels: Mapping[str, Guess] = field(default_factory=dict)
    role: str = ""
    kind: str = ""
    law: str = ""
    mode: int | None = None
    doubt: str = ""
    segments: tuple[tuple[float, float], ...] = ()


def quoted(text: str) -> str:
    """Return a text as YAML: plain where it is a simple word, else in double quotes."""
    return text if _PLAIN.match(text) and text.lower() not in _RESERVED else json.dumps(text, ensure_ascii=False)


def campaign_text(
    *,
    name: str,
    rig: str,
    directory: str,
    sampling_rate_hz: float | None,
    channels: Mapping[str, Guess],
    tests: Sequence[TestText],
    why: str,
    doubt: str,
    unused: Sequence[str],
    unsure: Sequence[str],
    skipped: Sequence[str],
    columns: Sequence[tuple[str, str, str]],
) -> str:
    """Return the text of campaign.yaml; `why` gives the source of the roles, `doubt` what is unsure about them."""
    lines = [f"# Proposed by `mrpipe init --from` for the files in {directory}."]
    if unsure:
        lines += ["# CHECK THESE, because headers and samples do not settle them:"]
        lines += [f"#   - {_comment(item)}" for item in unsure]
    lines += ["# Columns found in the first file (name: quantity, unit as the header says):"]
    lines += [f"#   {_comment(column)}: {quantity or '?'}, {unit or '?'}" for column, quantity, unit in columns[:40]]
    if unused:
        lines += [f"# Columns not used: {_comment(', '.join(unused[:40]))}"]
    lines += [f"# File not used: {_comment(item)}" for item in skipped[:20]]
    lines += [f"campaign: {quoted(name)}", f"rig: {rig}", f"directory: {quoted(directory)}"]
    if sampling_rate_hz is not None:
        lines += [f"sampling_rate_hz: {sampling_rate_hz:g}   # UNSURE: no clock in the files, write the true rate"]
    if rig == "shear-frame":
        lines += ["# frame: {floor_masses_kg: [..., ...]}   # UNSURE: write the masses, lowest floor first, if known"]
    lines += ["channels:"]
    lines += [f"  {key}: {_channel(guess)}{_doubt(guess.unsure)}" for key, guess in channels.items()]
    if rig == "damper-bench":
        lines += [
            f"  # {key}: {{column: ..., unit: ...}}   # UNSURE: not found, complete this line"
            for key in ("displacement", "force")
            if key not in channels
        ]
    lines += [f"tests:{_doubt(doubt) or f'   # {_comment(why)}'}"]
    for test in tests:
        entry = [f"name: {quoted(test.name)}", f"file: {quoted(test.file)}"]
        entry += [f"role: {test.role}"] if test.role else []
        entry += [f"kind: {test.kind}"] if test.kind else []
        entry += [f"law: {test.law}"] if test.law else []
        entry += [f"mode: {test.mode}"] if test.mode else []
        entry += (
            [f"segments_s: [{', '.join(f'[{a:.10g}, {b:.10g}]' for a, b in test.segments)}]"] if test.segments else []
        )
        if test.channels:
            own = ", ".join(f"{key}: {_channel(guess)}" for key, guess in test.channels.items())
            entry += [f"channels: {{{own}}}"]
        doubts = [test.doubt, *(guess.unsure for guess in test.channels.values())]
        lines += [f"  - {{{', '.join(entry)}}}{_doubt('; '.join(item for item in doubts if item))}"]
    return "\n".join(lines) + "\n"


def _channel(guess: Guess) -> str:
    parts = [f"value: {guess.value:g}"] if guess.value is not None else [f"column: {quoted(guess.column)}"]
    parts += [f"unit: {quoted(guess.unit)}"]
    parts += ["set_point: true"] if guess.set_point else []
    return f"{{{', '.join(parts)}}}"


def _doubt(text: str) -> str:
    return f"   # UNSURE: {_comment(text)}" if text else ""


def _comment(text: str) -> str:
    return " ".join(text.split())
