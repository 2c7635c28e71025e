"""Settings of the stage `identify-frame`."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from mrpipe.config.section import Section


class IdentifyFrameSettings(Section):
    """How the frame is identified from its sweep and decay tests."""

    band_low_hz: float = Field(
        0.2, gt=0.0, description="Lower end of the band in which modes are looked for (section 3.2.1)."
    )
    band_high_hz: float = Field(
        0.0,
        ge=0.0,
        description="Upper end of the band (14 Hz in the thesis); 0 means up to where the excitation ends.",
    )
    damping_from: Literal["decay", "sweep"] = Field(
        "decay",
        description="Damping ratios that go into C: `decay` (where a mode has such a test, else the sweep) or `sweep`.",
    )
    stiffness_form: Literal["modal", "tridiagonal"] = Field(
        "modal", description="K from the modes, (3.14) to (3.16), or the tri-diagonal shear frame nearest to them."
    )
    orthogonal_shapes: bool = Field(
        True,
        description="Take the measured shapes to the nearest ones orthogonal to the mass, each by its certainty; "
        "not done where they contradict it or are given.",
    )
    mode_matrix: str = Field(
        "",
        description="Mode shapes to use in place of the measured ones: a set in configs/frames or a YAML file; "
        "empty for the measured ones.",
    )
    segment_s: float = Field(
        16.0, gt=0.0, description="Length of a segment of the averaged frequency responses that the report shows."
    )
