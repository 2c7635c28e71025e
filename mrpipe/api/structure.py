"""Vibration tests of a structure in a notebook."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mrpipe.campaigns import Campaign
from mrpipe.modal.identification import FrameIdentification
from mrpipe.structures import Frame
from mrpipe.words import in_percent

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class IdentifiedFrame:
    """An identified structure.

    Attributes
    ----------
    frame
        Mass, damping and stiffness.
    summary
        The summary that `mrpipe identify-frame --json` prints.
    result
        Everything that was found.
    """

    frame: Frame
    summary: dict[str, Any]
    result: FrameIdentification

    def __str__(self) -> str:
        rows = zip(self.summary["frequencies_hz"], self.summary["damping_ratios"], strict=True)
        modes = ", ".join(f"{frequency:.3f} Hz ({in_percent(ratio, 2)})" for frequency, ratio in rows)
        return f"{self.frame.floors} floors; modes and damping: {modes}"

    def to_frame(self) -> pd.DataFrame:
        """Return the modes: frequency, damping ratio and shape, a row for each mode."""
        import pandas as pd

        shapes = np.array(self.summary["mode_shapes"])
        table = {"frequency_hz": self.summary["frequencies_hz"], "damping_ratio": self.summary["damping_ratios"]}
        table.update({f"shape_{floor + 1}": shapes[floor] for floor in range(shapes.shape[0])})
        return pd.DataFrame(table)

    def plot(self) -> Figure:
        """Return the mode shapes over the floors."""
        from mrpipe.reporting.style import COLOURS, figure_with_axes, label

        shapes = np.array(self.summary["mode_shapes"])
        figure, axes = figure_with_axes(1, 1, width=5.0, height=3.6)
        floors = np.arange(shapes.shape[0] + 1)
        for mode in range(shapes.shape[1]):
            line = np.concatenate([[0.0], shapes[:, mode]])
            axes[0, 0].plot(line, floors, "o-", color=COLOURS[mode % len(COLOURS)], label=f"mode {mode + 1}")
        label(axes[0, 0], "mode shape [1]", "floor")
        axes[0, 0].legend(fontsize=7)
        return figure


def identify_frame(campaign: Campaign | str | Path, **settings: Any) -> IdentifiedFrame:
    """Identify mass, damping, stiffness and modes of a structure.

    Parameters
    ----------
    campaign
        A campaign of the rig `shear-frame`, or its folder.
    settings
        Settings of the section `identify_frame`.

    Raises
    ------
    UserError
        If the tests do not determine a structure.
    """
    from mrpipe.api.bench import load_campaign
    from mrpipe.api.options import settings_of, silent
    from mrpipe.config.sections.identify_frame import IdentifyFrameSettings
    from mrpipe.errors import UserError
    from mrpipe.modal.identify import identify_frame as identify
    from mrpipe.modal.recordings import frame_tests
    from mrpipe.modal.storage import summary

    loaded = campaign if isinstance(campaign, Campaign) else load_campaign(campaign)
    result = identify(frame_tests(loaded), settings_of(IdentifyFrameSettings, "identify_frame", settings), silent)
    if result.frame is None:
        raise UserError(
            loaded.file,
            "frame",
            "the tests determine modes, but no mass and stiffness",
            "give frame.floor_masses_kg, or record the force of the excitation",
        )
    return IdentifiedFrame(result.frame, {"campaign": loaded.name, **summary(result)}, result)
