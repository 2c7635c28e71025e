"""Gains that the thesis and P2 ran (Table 5.1); configs/thesis.yaml holds the same."""

from __future__ import annotations

from mrpipe.control.gains import Gains
from mrpipe.thesis.entries import printed_gains

THESIS_GAINS: dict[str, Gains] = {law: Gains(**gains) for law, gains in printed_gains().items()}
"""Law -> gains. The k of vdns is that of P2; the thesis prints it with another magnitude in one place."""
