"""Base of every configuration section."""

from __future__ import annotations

from mrpipe.options import Section

__all__ = ["Section"]
