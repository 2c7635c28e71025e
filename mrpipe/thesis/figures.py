"""Figures and tables of the thesis that correspond to those of the report.

Only the report of a run that recomputes the thesis names them: in the report of another rig they mean nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

STAGE = "reproduce"
"""Stage that recomputes the thesis; a run whose configuration lists it is compared with the thesis."""

CORRESPONDING: Mapping[str, str] = {
    "prepare-history": "Figures 2.10 and 2.11 a",
    "assemble-history": "Figure 2.11 b",
    "sweep-findings": "section 2.3.2",
    "train-forward-loops": "Figures 2.17 to 2.20",
    "train-inverse-drive": "Figures 2.21 to 2.23",
    "train-inverse-viscous": "Figure 2.24",
    "identify-damper-loops": "Figures 2.7 to 2.9",
    "identify-damper-classical-parameters": "Table 2.2",
    "simulate-vd-decay": "Figure 5.7",
    "simulate-vdps-decay": "Figure 5.7",
    "simulate-vdns-decay": "Figure 5.7",
    "simulate-fdns-decay": "Figure 5.7",
}
"""File of a figure or table, without folder and ending -> what the thesis shows in its place."""


def with_citations(items: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return items of a report section whose captions name the corresponding figures of the thesis.

    Parameters
    ----------
    items
        Texts, tables and figures; those with `file` and `caption` may get a citation.
    """
    return [{**item, **_cited(item)} for item in items]


def _cited(item: Mapping[str, Any]) -> dict[str, str]:
    name = str(item.get("file", "")).rpartition("/")[2].rpartition(".")[0]
    if name not in CORRESPONDING:
        return {}
    return {"caption": f"{str(item['caption']).rstrip('.')} (thesis {CORRESPONDING[name]})."}
