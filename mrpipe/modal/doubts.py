"""Findings that put an identified structure in doubt."""

from __future__ import annotations


class Doubt(str):
    """A finding because of which M, C, K or the modes may be wrong; stages that use the structure repeat it."""

    __slots__ = ()
