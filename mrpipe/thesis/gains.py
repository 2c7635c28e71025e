"""Gains that the thesis and P2 ran (Table 5.1); configs/thesis.yaml holds the same."""

from __future__ import annotations

from mrpipe.control.gains import Gains

THESIS_GAINS: dict[str, Gains] = {
    "vd": Gains(c_n_s_m=650.0),
    "vdps": Gains(c_n_s_m=400.0, k_n_m=2500.0),
    "vdns": Gains(c_n_s_m=250.0, k_n_m=-4500.0),
    "fdns": Gains(alpha_n_m=3000.0),
    "nnc": Gains(alpha_n_m=3000.0),
}
"""Law -> gains. The k of vdns is that of P2; the thesis prints it with another magnitude in one place."""
