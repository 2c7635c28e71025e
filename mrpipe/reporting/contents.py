"""What `mrpipe show` describes and draws of an artifact or a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from matplotlib.figure import Figure

from mrpipe.artifacts import Artifact, atomic_path
from mrpipe.artifacts.dimension_scales import is_scale
from mrpipe.campaigns import describe, load_campaign
from mrpipe.campaigns.describe import unit_of
from mrpipe.campaigns.plausibility import judge
from mrpipe.errors import UserError
from mrpipe.reporting.signals import campaign_overview
from mrpipe.reporting.style import figure_with_axes, label

_PANELS = 12
_TESTS = 4
_CHANNELS = 5


def describe_file(path: Path) -> dict[str, Any]:
    """Return what is inside an artifact (its root notes and datasets) or a campaign (its tests and channels).

    Raises
    ------
    UserError
        If it is neither, or cannot be read.
    """
    if _is_campaign(path):
        campaign = load_campaign(path)
        return {"kind": "campaign", **describe(campaign, judge(campaign))}
    artifact = Artifact(path)
    root = {key: value for key, value in artifact.root.items() if key != "config"}
    return {"kind": "artifact", "file": str(path), **root, "datasets": _datasets(path)}


def _is_campaign(path: Path) -> bool:
    return path.is_dir() or path.suffix in {".yaml", ".yml"}


def _datasets(path: Path) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []

    def visit(name: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or is_scale(item):
            return
        row: dict[str, Any] = {"name": name, "shape": list(item.shape), "unit": str(item.attrs.get("unit", ""))}
        row["dims"] = [str(name) for name in np.atleast_1d(item.attrs.get("dims", "")) if str(name)]
        if item.size and np.issubdtype(item.dtype, np.number):
            values = np.asarray(item[()], dtype=np.float64)
            finite = values[np.isfinite(values)]
            if finite.size:
                row["minimum"], row["maximum"] = float(finite.min()), float(finite.max())
        rows.append(row)

    try:
        with h5py.File(path, "r") as handle:
            handle.visititems(visit)
    except (OSError, RuntimeError) as error:
        said = " ".join(str(error).split())
        raise UserError(path, "", f"is damaged ({said})", "run the stage that writes it; it is built again") from error
    return rows


def plot_file(path: Path, picture: Path) -> None:
    """Draw the channels of a campaign's first tests, or the larger datasets of an artifact, into one picture."""
    figure = _campaign_figure(path) if _is_campaign(path) else _artifact_figure(path)
    with atomic_path(picture) as temporary:
        figure.savefig(temporary, format=picture.suffix.lower().lstrip("."), dpi=110)


def _campaign_figure(path: Path) -> Figure:
    """Draw a few tests spread over the campaign, each with its first channels."""
    campaign = load_campaign(path)
    step = max(1, len(campaign.recordings) // _TESTS)
    chosen = campaign.recordings[::step][:_TESTS]
    names = list(dict.fromkeys(name for item in chosen for name in item.channels))[:_CHANNELS]
    return campaign_overview(
        [
            (item.name, item.time_s, {name: item.channels[name] for name in names if name in item.channels})
            for item in chosen
        ],
        {name: unit_of(campaign, name) for name in names},
    )


def _artifact_figure(path: Path) -> Figure:
    panels = _artifact_panels(path)
    rows = max(1, (len(panels) + 1) // 2)
    figure, axes = figure_with_axes(rows, 2 if len(panels) > 1 else 1, width=11.0, height=2.0)
    for axis, (title, x, y, x_label, y_label) in zip(axes.ravel(), panels, strict=False):
        axis.plot(x, y, linewidth=0.6)
        label(axis, x_label, y_label, title)
    for axis in axes.ravel()[len(panels) :]:
        axis.set_visible(False)
    return figure


def _artifact_panels(path: Path) -> list[tuple[str, Any, Any, str, str]]:
    panels: list[tuple[str, Any, Any, str, str]] = []

    def visit(name: str, item: Any) -> None:
        if len(panels) < _PANELS and isinstance(item, h5py.Dataset) and item.ndim == 1 and item.size >= 8:
            if is_scale(item) or not np.issubdtype(item.dtype, np.number):
                return
            panels.append((name, np.arange(item.size), item[()], "index", f"[{item.attrs.get('unit', '')}]"))

    with h5py.File(path, "r") as handle:
        handle.visititems(visit)
    return panels
