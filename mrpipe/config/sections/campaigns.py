"""Sources of the measurements."""

from __future__ import annotations

from pydantic import Field

from mrpipe.options import Section

LABORATORY = "laboratory"


class CampaignsSettings(Section):
    """One entry a rig: a directory or campaign file, `laboratory` for the virtual rig, or null for none."""

    bench: str | None = Field(
        LABORATORY,
        description="Damper bench campaign: path of a directory with campaign.yaml or of a campaign file (relative to "
        "the configuration), `laboratory` to record it on the virtual rig, or null if there is none.",
    )
    frame: str | None = Field(
        LABORATORY, description="Frame campaign (sweeps, free decays): path, `laboratory` or null, as for bench."
    )
    closed_loop: str | None = Field(
        LABORATORY, description="Closed-loop campaign on the shaking table: path, `laboratory` or null, as for bench."
    )
