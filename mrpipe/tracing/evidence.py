"""Evidence for an effect, before it is calibrated; the same rule for bench and structure."""

from __future__ import annotations

from mrpipe.tracing.gain import Gain
from mrpipe.tracing.options import NamingRules


def evidence_of(share: float, support: float, gain: Gain | None, rules: NamingRules) -> float:
    """Return the evidence for an effect, 0 to 1; `close_loop.calibration` converts it to a probability.

    Parameters
    ----------
    share
        Share of the recoverable residual that the chosen effects recover.
    support
        Share of bootstrap samples of the training tests in which the effect is needed with every base form.
    gain
        Gain on left-out tests; None if it was not computed.
    rules
        When a cause is named.
    """
    proven = min(1.0, share / rules.named_share)
    held = 1.0 if gain is None or gain.significant else rules.doubtful
    return round(float(proven * support * held * rules.most_confidence), 3)
