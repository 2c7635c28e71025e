"""Printed results of the closed loop, for comparison with ours (thesis Table 5.1; errata section B)."""

from __future__ import annotations

PRINTED: dict[str, dict[str, dict[str, float]]] = {
    "vd": {
        "ideal": {"rms_x5_m": 24.3e-3, "rms_x1_m": 6.60e-3, "rms_a5_m_s2": 1.56, "rms_a1_m_s2": 0.42},
        "set C": {"rms_x5_m": 24.3e-3, "rms_x1_m": 6.22e-3, "rms_a5_m_s2": 1.57, "rms_a1_m_s2": 0.72},
        "thesis simulated": {"rms_x5_m": 24.3e-3, "rms_x1_m": 6.1e-3, "rms_a5_m_s2": 1.60, "rms_a1_m_s2": 0.64},
        "thesis measured": {"rms_x5_m": 24.3e-3, "rms_x1_m": 6.6e-3, "rms_a5_m_s2": 1.81, "rms_a1_m_s2": 0.87},
    },
    "vdps": {
        "ideal": {"rms_x5_m": 35.1e-3, "rms_x1_m": 8.8e-3, "rms_a5_m_s2": 2.29, "rms_a1_m_s2": 1.24},
        "set C": {"rms_x5_m": 31.7e-3, "rms_x1_m": 8.2e-3, "rms_a5_m_s2": 2.15, "rms_a1_m_s2": 1.06},
        "thesis simulated": {"rms_x5_m": 35.4e-3, "rms_x1_m": 8.8e-3, "rms_a5_m_s2": 2.28, "rms_a1_m_s2": 0.93},
        "thesis measured": {"rms_x5_m": 23.0e-3, "rms_x1_m": 6.7e-3, "rms_a5_m_s2": 1.84, "rms_a1_m_s2": 1.27},
    },
    "vdns": {
        "ideal": {"rms_x5_m": 13.6e-3, "rms_x1_m": 7.9e-3, "rms_a5_m_s2": 1.09, "rms_a1_m_s2": 2.05},
        "set C": {"rms_x5_m": 21.4e-3, "rms_x1_m": 8.2e-3, "rms_a5_m_s2": 1.71, "rms_a1_m_s2": 1.74},
        "thesis simulated": {"rms_x5_m": 13.8e-3, "rms_x1_m": 6.3e-3, "rms_a5_m_s2": 0.98, "rms_a1_m_s2": 1.40},
        "thesis measured": {"rms_x5_m": 15.5e-3, "rms_x1_m": 4.9e-3, "rms_a5_m_s2": 1.25, "rms_a1_m_s2": 1.02},
    },
    "fdns": {
        "ideal": {"rms_x5_m": 15.9e-3, "rms_x1_m": 8.85e-3},
        "set C": {"rms_x5_m": 18.85e-3, "rms_x1_m": 7.6e-3},
        "thesis simulated": {"rms_x5_m": 13.6e-3, "rms_x1_m": 5.5e-3, "rms_a5_m_s2": 1.16, "rms_a1_m_s2": 1.36},
        "thesis measured": {"rms_x5_m": 11.2e-3, "rms_x1_m": 3.5e-3, "rms_a5_m_s2": 1.02, "rms_a1_m_s2": 0.94},
    },
}
"""Law -> source -> index. Of FDNS the errata gives ranges; their middle stands here."""
