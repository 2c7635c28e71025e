"""Findings of `mrpipe check` on closed-loop tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mrpipe.config.sections.campaigns import LABORATORY

if TYPE_CHECKING:
    from mrpipe.campaigns import Campaign
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.config.loader import LoadedConfig


def without_law(campaign: Campaign) -> list[Finding]:
    """Return closed-loop tests that do not state their law, or not the gains of a law that has gains."""
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.control.laws import law_named, law_names

    findings = []
    for test in campaign.recordings:
        if test.kind != "closed-loop":
            continue
        law = str(test.details.get("law") or "")
        wanted = law_named(law).gain_names if law in law_names() else ()
        if law and (test.details.get("gains") or not wanted):
            continue
        sentence = "its control law is not stated, so close-loop does not compare this test"
        remedy = "write law: and gains: of this test"
        if law:
            sentence = f"the gains of law {law} are not stated, so the calibrated ones are taken"
            remedy = f"write gains: {{{', '.join(f'{name}: ...' for name in wanted)}}} as they were in this test"
        findings.append(Finding("law-unknown", "warning", sentence, remedy, test=test.name))
    return findings


def without_modes(loaded: LoadedConfig, campaign: Campaign) -> list[Finding]:
    """Return a finding where the frame would be identified, and the only tests of it are closed-loop tests.

    Parameters
    ----------
    loaded
        The configuration, which names this campaign as `campaigns.closed_loop`.
    campaign
        The campaign.
    """
    from mrpipe.campaigns.plausibility import Finding
    from mrpipe.cli.checking import measured_campaigns, needed_stages
    from mrpipe.stages.registry import stages_for

    frame = stages_for(loaded.config)["identify-frame"]
    identified = "identify-frame" in needed_stages(loaded) and "campaign:frame" in frame.inputs
    if not identified or "frame" in measured_campaigns(loaded):
        return []
    if any(test.kind != "closed-loop" for test in campaign.recordings):
        return []
    virtual = loaded.config.campaigns.frame == LABORATORY
    taken = "takes the frame of the virtual laboratory" if virtual else "has no data"
    return [
        Finding(
            name="no-frame-tests",
            severity="warning",
            sentence=f"closed-loop tests do not show the modes, so identify-frame cannot use them: it {taken}",
            remedy="name a campaign with tests of kind sweep, random, ambient or free-decay as campaigns.frame",
        )
    ]
