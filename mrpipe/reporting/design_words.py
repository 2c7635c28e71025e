"""The result of a design in words, made from its summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mrpipe.words import in_percent

_UNITS = {"c_n_s_m": ("c", "N s/m"), "k_n_m": ("k", "N/m"), "alpha_n_m": ("alpha", "N/m")}


def in_plain_words(summary: Mapping[str, Any]) -> str:
    """Return the conclusion in a few sentences."""
    best = summary["laws"][summary["best"]]
    gains = gains_in_words(best["gains"]) or "no gains"
    sentences = [
        f"The best law is {summary['best']} ({gains}): over the frequency band and all amplitudes its largest RMS top "
        f"displacement is {1e3 * best['peak_rms_x_top_m']:.1f} mm, at {best['resonance_rad_s']:.2f} rad/s."
    ]
    sentences.append(f"The objective is {summary['objective']}; it is {best['objective']:.3f}.")
    if best["improvement"] > 0.005:
        sentences.append(f"This is {in_percent(best['improvement'])} better than at its calibrated gains.")
    sentences += [f"{line[0].upper()}{line[1:]}." for line in exceeded_limits(best["exceeds_limits"])]
    others = sorted(
        ((name, item) for name, item in summary["laws"].items() if name != summary["best"]),
        key=lambda entry: float(entry[1]["objective"]),
    )
    if others:
        name, item = others[0]
        larger = in_percent(item["objective"] / best["objective"] - 1.0)
        sentences.append(f"The second best law is {name}; its objective is {larger} larger.")
    sentences.append(_confirmed(summary["confirmation"]))
    if "before_tracing" in summary:
        sentences.append(_against_untraced(summary["before_tracing"]))
    uncertainty = summary.get("uncertainty")
    if uncertainty and uncertainty["draws"] == 1:
        sentences.append("Structure and damper are given without uncertainty, so that no others are drawn.")
    elif uncertainty:
        sentences.append(
            f"In {uncertainty['draws']} structures and dampers drawn from their uncertainty, {summary['best']} is the "
            f"best law with probability {best['probability_best']:.2f}; "
            f"its mean regret is {in_percent(uncertainty['regret'], 1)}."
        )
        if uncertainty["sensitivities"] and best["probability_best"] < 0.95:
            first = uncertainty["sensitivities"][0]
            sentences.append(
                f"The lead depends most on {first['parameter']}. The test that determines it: {first['test']}."
            )
    return " ".join(sentences)


def exceeded_limits(excesses: Mapping[str, float]) -> list[str]:
    """Return a clause for each limit that the best design does not keep.

    Parameters
    ----------
    excesses
        Name of the limit -> excess of the best design over the limit [1], as `exceeds_limits` in the JSON.
    """
    return [
        f"no design keeps all limits: the best one exceeds that of {name} by {in_percent(excess, 1)}"
        for name, excess in excesses.items()
    ]


def _confirmed(found: Mapping[str, Any]) -> str:
    design, calibrated = found["design"], found["calibrated"]
    return (
        f"At half the step of the simulation and with other sensor noise, the best design of all ({design['law']}, "
        f"{gains_in_words(design['gains']) or 'no gains'}) has a largest RMS top displacement of "
        f"{1e3 * design['peak_rms_x_top_m']:.1f} mm and top acceleration of {design['peak_rms_a_top_m_s2']:.2f} m/s²; "
        f"the best law at its calibrated gains ({calibrated['law']}) has {1e3 * calibrated['peak_rms_x_top_m']:.1f} mm "
        f"and {calibrated['peak_rms_a_top_m_s2']:.2f} m/s². The displacement of the design is "
        f"{_smaller(found['improvement_x_top'])}, its acceleration {_smaller(found['improvement_a_top'])}."
    )


def _smaller(improvement: float) -> str:
    """Return by how much a value is smaller, or larger where the improvement is negative."""
    return f"{in_percent(abs(improvement), 1)} {'smaller' if improvement >= 0.0 else 'larger'}"


def _against_untraced(found: Mapping[str, Any]) -> str:
    design, with_traced = found["design"], found["with_traced_damper"]
    return (
        f"For the damper before the tracing the best design would be {design['law']} "
        f"({gains_in_words(design['gains']) or 'no gains'}). With the traced damper in the loop that design has a "
        f"largest RMS top displacement of {1e3 * with_traced['peak_rms_x_top_m']:.1f} mm; its objective is "
        f"{in_percent(found['regret'], 1)} above that of the best design for the traced damper."
    )


def gains_in_words(gains: Mapping[str, float]) -> str:
    """Return gains with their symbols and units, such as `c = 650 N s/m`; empty for a law without gains."""
    parts = []
    for name, value in gains.items():
        symbol, unit = _UNITS.get(name, (name, ""))
        parts.append(f"{symbol} = {value:.4g} {unit}".strip())
    return ", ".join(parts)


def in_lines(summary: Mapping[str, Any]) -> list[str]:
    """Return the table of the laws, best first, and the conclusion sentence by sentence.

    Parameters
    ----------
    summary
        Summary of a design for one damper.
    """
    head = ("law", "best gains", "x_top [mm]", "a_top [m/s²]", "calibrated gains", "x_top [mm]", "a_top [m/s²]")
    rows = [head, *(_row(name, item) for name, item in _ordered(summary))]
    widths = [max(len(row[column]) for row in rows) for column in range(len(head))]
    table = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    title = "largest RMS values over frequency, amplitudes and motions at the best gains and at the calibrated gains:"
    sentences = [f"{part.rstrip('.')}." for part in in_plain_words(summary).split(". ")]
    return [title, *table, *sentences]


def _ordered(summary: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Return label and result of every law, also of the searches with all gains free, best first."""
    found = []
    for name, item in summary["laws"].items():
        found.append((name, item))
        if "unrestricted" in item:
            found.append((f"{name}, unrestricted", item["unrestricted"]))
    return sorted(found, key=lambda entry: float(entry[1]["objective"]))


def _row(name: str, item: Mapping[str, Any]) -> tuple[str, ...]:
    cells = [name]
    for entry in (item, item["calibrated"]):
        peaks = (1e3 * entry["peak_rms_x_top_m"], entry["peak_rms_a_top_m_s2"])
        cells += [gains_in_words(entry["gains"]) or "-", f"{peaks[0]:.1f}", f"{peaks[1]:.2f}"]
    return tuple(cells)
