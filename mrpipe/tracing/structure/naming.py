"""Names of the effects of a structure: where each acts, values of its parameters, rivals and confidence."""

from __future__ import annotations

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.tracing.evidence import evidence_of
from mrpipe.tracing.options import NamingRules
from mrpipe.tracing.structure.candidates import Fitted
from mrpipe.tracing.structure.model import FrameModel
from mrpipe.tracing.structure.rounds import FrameSelection, projected
from mrpipe.tracing.structure.ties import rivals_of
from mrpipe.tracing.verdict import Estimate, Interval, LeftOutGain, NamedEffect

STANDARD_ERRORS = 3.0
"""Numerical technique: an amplitude of a storey below this multiple of its standard error counts as zero."""

BY_STOREY = 3
"""Numerical technique: with fewer storeys their largest amplitude is reported, else the median of acting storeys."""


def named_effects(
    selection: FrameSelection, after: FrameModel, rules: NamingRules, *, explained: bool
) -> list[NamedEffect]:
    """Return the effects that were chosen, with their places, parameters, rivals and confidence.

    Parameters
    ----------
    selection
        Linear frame and effects, as chosen on the training records.
    after
        Model with all chosen effects; its amplitudes are in the order of the effects.
    rules
        Rules for naming an effect.
    explained
        Whether the effects explain the error on the validation tests. If they leave a part of it, the form of an effect
        may stand for another effect, so that their probability is lower.
    """
    found = []
    total = selection.share(selection.residual)
    proven = explained and total >= rules.named_share
    for place, (item, own) in enumerate(by_effect(selection, after.amplitudes)):
        most = _most_probable(selection, place, proven)
        if place < selection.declared:
            continue
        candidates = selection.rounds[place - selection.declared]
        lead = min((other.behind for other in candidates[1:]), default=1.0)
        rivals = [other.name for other in rivals_of(candidates, rules)]
        gain = selection.gains[place - selection.declared] if selection.gains else None
        effect = item.placed.effect
        interval = None if gain is None else LeftOutGain(gain.share, Interval(*gain.interval))
        found.append(
            NamedEffect(
                effect.name,
                item.placed.form.name,
                parameters_of(item, own, selection.rules.acting),
                min(most, evidence_of(total, 0.5 + 0.5 * min(1.0, 2.0 * lead), None, rules)),
                effect.physics,
                effect.remedy,
                effect.source,
                "structure",
                place_in_words(item, own, selection.rules.acting),
                tuple(rivals),
                {name: effect.separated_by[name].advice for name in rivals if name in effect.separated_by},
                interval,
            )
        )
    return found


def _most_probable(selection: FrameSelection, place: int, proven: bool) -> float:
    """Return the probability of effects of this kind on planted campaigns, which the evidence does not exceed.

    An effect that acts on other storeys leaves the evidence for those before it as it is.
    """
    frame = selection.rules
    alone = len(selection.chosen) - selection.elsewhere
    if place >= alone or alone - selection.declared > 1:
        return frame.probability_of_several
    if selection.below_noise is not None:
        return frame.probability_below_noise
    return frame.probability_alone if proven else frame.probability_in_part


def by_effect(selection: FrameSelection, amplitudes: FloatArray) -> list[tuple[Fitted, FloatArray]]:
    """Return each chosen effect with those of its amplitudes that exceed the noise.

    Parameters
    ----------
    selection
        The chosen effects.
    amplitudes
        Their amplitudes, concatenated.
    """
    found, first = [], 0
    for item in selection.chosen:
        count = _amplitudes_of(item, selection.design.spectra[0].record.floors)
        found.append((item, certain_amplitudes(item, amplitudes[first : first + count], selection)))
        first += count
    return found


def certain_amplitudes(item: Fitted, amplitudes: FloatArray, selection: FrameSelection) -> FloatArray:
    """Return the amplitudes of storeys without those that the noise of the sensors explains, if any remain.

    A storey whose drift hardly leaves the range in which an effect is linear determines its amplitude badly. The
    columns are weighted by the noise, so that their products give the standard errors.

    Parameters
    ----------
    item
        The effect.
    amplitudes
        Its amplitudes, storey after storey.
    selection
        Linear frame with the records.
    """
    if item.placed.effect.acts_on != "storey":
        return amplitudes
    columns = projected(selection.design, (item,), selection.about).reshape(len(amplitudes), -1)
    acting = np.flatnonzero((amplitudes > 0.0) & np.any(columns, axis=1))
    errors = np.full(len(amplitudes), np.inf)
    errors[acting] = np.sqrt(np.diag(np.linalg.pinv(columns[acting] @ columns[acting].T, hermitian=True)))
    kept = amplitudes > STANDARD_ERRORS * errors
    return np.where(kept, amplitudes, 0.0) if np.any(kept) else amplitudes


def _amplitudes_of(item: Fitted, floors: int) -> int:
    kinds = len(item.placed.form.amplitudes)
    return kinds * floors if item.placed.effect.acts_on == "storey" else kinds


def place_in_words(item: Fitted, amplitudes: FloatArray, acting: float) -> str:
    """Return where an effect acts: a floor, every storey, or the storeys with a large amplitude.

    Parameters
    ----------
    item
        The effect.
    amplitudes
        Amplitudes of the effect, storey after storey.
    acting
        Share of the largest amplitude from which on a storey is named.
    """
    if item.placed.floor:
        return f"floor {item.placed.floor}"
    if item.placed.effect.acts_on == "base":
        return "base"
    strong = strong_storeys(item, amplitudes, acting)
    if len(strong) * len(item.placed.form.amplitudes) == len(amplitudes):
        return "every storey"
    return "storey " + ", ".join(str(k + 1) for k in strong)


def strong_storeys(item: Fitted, amplitudes: FloatArray, acting: float) -> list[int]:
    """Return the storeys, from 0, on which an effect of storeys acts with a large amplitude.

    Parameters
    ----------
    item
        The effect.
    amplitudes
        Amplitudes of the effect, storey after storey.
    acting
        Share of the largest amplitude from which on a storey counts.
    """
    by_storey = amplitudes.reshape(-1, len(item.placed.form.amplitudes)).sum(axis=1)
    return [int(k) for k in np.flatnonzero(by_storey > acting * float(by_storey.max()))]


def acting_on(item: Fitted, amplitudes: FloatArray, selection: FrameSelection) -> list[int]:
    """Return the storeys, from 0, in whose equations the force of an effect is large.

    The equation of each mode contains the forces of all storeys.

    Parameters
    ----------
    item
        The effect.
    amplitudes
        Its amplitudes, storey after storey.
    selection
        Linear frame with the records.
    """
    first = selection.design.spectra[0]
    if item.placed.effect.acts_on == "base" or first.modes is not None:
        return list(range(first.record.floors))
    if item.placed.floor:
        return list(range(item.placed.floor))
    return strong_storeys(item, amplitudes, selection.rules.acting)


def parameters_of(item: Fitted, amplitudes: FloatArray, acting: float) -> dict[str, Estimate]:
    """Return value and unit of every parameter; amplitudes of several storeys by storey, with their median as value.

    Parameters
    ----------
    item
        The effect.
    amplitudes
        Amplitudes of the effect, storey after storey.
    acting
        Share of the largest amplitude below which a storey does not count in the median.
    """
    found = {
        parameter.name: Estimate(float(value), parameter.unit, Interval.point(float(value)))
        for parameter, value in zip(item.placed.form.searched, item.numbers, strict=True)
    }
    kinds = len(item.placed.form.amplitudes)
    for k, parameter in enumerate(item.placed.form.amplitudes):
        own = amplitudes[k::kinds]
        value = float(np.max(own)) if len(own) < BY_STOREY else _typical(own, acting)
        interval = Interval(float(np.min(own)), float(np.max(own)), "range", None)
        storeys = tuple(float(number) for number in own) if len(own) > 1 else ()
        found[parameter.name] = Estimate(value, parameter.unit, interval if storeys else Interval.point(value), storeys)
    if item.placed.floor:
        found["floor"] = Estimate(item.placed.floor, "1", Interval.point(item.placed.floor))
    return found


def _typical(values: FloatArray, acting: float) -> float:
    strong = values[values > acting * float(values.max())] if float(values.max()) > 0.0 else values
    return float(np.median(strong))
