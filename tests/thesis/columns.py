"""Printed values of the harmonic closed loop under a law: Table 5.1 and the errata page."""

from __future__ import annotations

from mrpipe.thesis.entries import INDICES, all_entries, printed_columns


def loop_columns(law: str) -> dict[str, dict[str, float]]:
    """Return source -> index -> value; empty for a law that neither of them lists."""
    found = {
        f"thesis {name}": columns[law]
        for name, part in (("simulated", "T5.1s"), ("measured", "T5.1m"))
        if law in (columns := printed_columns("Table 5.1", part))
    }
    known = {entry.id: entry.printed for entry in all_entries()}
    for name, prefix in (("ideal", "B-ideal"), ("set C", "B-set-c")):
        values = known.get(f"{prefix}-{law}")
        if values is None:
            continue
        found[name] = dict(zip(INDICES, values, strict=False))
        if f"{prefix}-{law}-a1" in known:
            found[name]["rms_a1_m_s2"] = known[f"{prefix}-{law}-a1"]
    return found
