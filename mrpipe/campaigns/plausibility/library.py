"""All plausibility checks, one per module of the package `checks`, and their findings on a campaign."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache

import mrpipe.campaigns.plausibility.checks as package
from mrpipe.campaigns.model import Campaign
from mrpipe.campaigns.plausibility.consequences import without_consequences
from mrpipe.campaigns.plausibility.finding import Finding

LOADS_FROM = ("mrpipe.campaigns.plausibility.checks",)

ALL_RIGS = ("damper-bench", "shear-frame")


@dataclass(frozen=True)
class Check:
    """One plausibility check.

    Attributes
    ----------
    name
        Short name.
    judge
        Campaign -> findings; pure, raises nothing on samples that were accepted by the reader.
    rigs
        Rigs to whose campaigns it applies.
    """

    name: str
    judge: Callable[[Campaign], Iterable[Finding]]
    rigs: tuple[str, ...] = ALL_RIGS


@cache
def all_checks() -> tuple[Check, ...]:
    """Return the CHECK of every module of the package `checks`, in the order of their names."""
    names = sorted(item.name for item in pkgutil.iter_modules(package.__path__))
    modules = (importlib.import_module(f"{package.__name__}.{name}") for name in names)
    return tuple(module.CHECK for module in modules if hasattr(module, "CHECK"))


def judge(campaign: Campaign) -> tuple[Finding, ...]:
    """Return the findings of all checks that apply to the rig, errors first.

    Findings on single tests that follow from a finding on the whole campaign are left out.
    """
    found = [item for check in all_checks() if campaign.rig in check.rigs for item in check.judge(campaign)]
    return tuple(sorted(without_consequences(found), key=lambda item: item.severity != "error"))
