"""Figures of the stages: one unit for a motion everywhere, no empty panel, and texts that nothing crosses."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from mrpipe.networks.assembly import join, samples
from mrpipe.networks.network import FeatureSpec
from mrpipe.reporting.bench_tracing import candidate_ranking
from mrpipe.reporting.dampers import damper_loops
from mrpipe.reporting.front.figures import last_cycles, model_errors, shapes_on_frame
from mrpipe.reporting.front.laws import History
from mrpipe.reporting.networks import drive_histories
from mrpipe.reporting.signals import campaign_overview, loops, prepared_history, spectra_before_and_after
from mrpipe.reporting.structure_tracing import storey_maps
from mrpipe.reporting.style import as_svg
from tests.networks.rig import bench_test

pytestmark = pytest.mark.property

TIME = np.arange(0.0, 4.0, 0.002)
MOTION = 0.004 * np.sin(6.0 * TIME)
SPEED = 0.024 * np.cos(6.0 * TIME)
FORCE = 90.0 * np.tanh(100.0 * SPEED)


def _texts(figure: Figure) -> list[str]:
    return re.findall(r"<text[^>]*>([^<]*)</text>", as_svg(figure))


def _figures() -> dict[str, Figure]:
    channels = {"displacement": MOTION, "velocity": SPEED, "force": FORCE}
    units = {"displacement": "m", "velocity": "m/s", "force": "N"}
    spectrum = (np.linspace(0.1, 100.0, 50), np.linspace(1.0, 2.0, 50))
    drawn = SimpleNamespace(name="a", displacement=MOTION, velocity=SPEED, measured=FORCE, modelled=FORCE)
    return {
        "history": prepared_history(TIME, {}, channels, units, np.zeros(0, dtype=np.int64)),
        "spectra": spectra_before_and_after({"displacement": (spectrum, spectrum)}, units, {}),
        "overview": campaign_overview([("a", TIME, channels)], units),
        "damper": damper_loops([drawn]),
        "storeys": storey_maps([(1, MOTION, SPEED, FORCE)]),
    }


@pytest.mark.parametrize("name", _figures())
def test_motions_are_in_millimetres(name: str) -> None:
    texts = _texts(_figures()[name])
    assert any("mm" in text for text in texts)
    assert not [text for text in texts if re.search(r"[\[(]m(/s)?[\])]", text)]


def test_numbers_of_the_history_are_those_of_the_unit_and_all_ticks_differ() -> None:
    axis = _figures()["history"].axes[0]
    assert np.max(axis.lines[0].get_ydata()) == pytest.approx(4.0, rel=1e-3)
    spectra = _figures()["spectra"].axes[0]
    assert spectra.lines[0].get_ydata()[-1] == pytest.approx(2e6)
    figure = prepared_history(TIME, {}, {"force": 1e-3 * FORCE / 90.0}, {"force": "N"}, np.zeros(0, dtype=np.int64))
    as_svg(figure)
    labels = [text.get_text() for text in figure.axes[0].get_yticklabels()]
    assert len(set(labels)) == len(labels) > 2
    # those at the ends may lie outside of the axis and are not drawn
    assert set(labels[1:-1]) <= set(_texts(figure))


def test_the_names_of_loops_stand_outside_of_the_curves() -> None:
    figure = loops([(name, MOTION, SPEED, FORCE) for name in ("a", "b")])
    assert all(axis.get_legend() is None for axis in figure.axes)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["a", "b"]


def test_a_panel_without_a_test_is_not_drawn() -> None:
    history = join([bench_test(f"{u}", 1.0, u, cycles=4) for u in (0.0, 1.0, 2.0)], cycles=3, sampling_rate_hz=200.0)
    rows = samples(history, FeatureSpec(("velocity", "force"), 2, True, history.sampling_rate_hz, "drive"))
    figure = drive_histories(history, rows, rows.target)
    assert [bool(axis.lines) for axis in figure.axes if axis.get_visible()] == [True] * 3


def test_errors_on_a_logarithmic_axis_are_points() -> None:
    figure = model_errors([("noise alone", 0.0036, "noise"), ("linear model", 0.66, "linear")])
    axis = figure.axes[0]
    assert axis.get_xscale() == "log" and not axis.patches
    assert list(axis.collections[-1].get_offsets()[:, 0]) == pytest.approx([0.36, 66.0])


def test_no_line_crosses_the_texts_of_the_ranking() -> None:
    rows = [{"name": "a", "form": "b", "share": share, "nrmse": 0.01} for share in (0.97, 0.47)]
    axis = candidate_ranking(rows, 0.9, 0.5).axes[0]
    assert all(line.get_zorder() < axis.patches[0].get_zorder() for line in axis.lines)
    outside = axis.texts[1]
    assert outside.get_bbox_patch() is not None and outside.get_zorder() > max(line.get_zorder() for line in axis.lines)


def test_a_constant_drive_has_no_desired_force_and_numbers_have_the_same_digits() -> None:
    history = History(TIME, MOTION, MOTION, SPEED, FORCE, 0.0 * FORCE, 0.0 * FORCE)
    figure = last_cycles({"passive-on": history, "vd": history})
    passive, active = figure.axes[1].lines[0], figure.axes[4].lines[0]
    assert not np.any(np.isfinite(passive.get_ydata())) and np.all(np.isfinite(active.get_ydata()))
    shapes = _texts(shapes_on_frame(np.eye(2), [1.0, 2.0], [0.003, 0.0024]))
    assert "0.30 %" in shapes and "0.24 %" in shapes
