import numpy as np
import pytest

from mrpipe.modal.identify import identify_frame
from mrpipe.modal.records import FrameTests
from mrpipe.structures import frame_from_parameter_set
from tests.modal.rig import Rig, sweep_test


@pytest.mark.oracle
def test_sdypy_ema_finds_the_same_poles(tmp_path):
    ema = pytest.importorskip("sdypy.EMA", reason="sdypy-EMA is not installed")
    frame = frame_from_parameter_set("thesis")
    test = sweep_test(frame, np.random.default_rng(5), Rig(noise=0.01, rate=250.0, sweep_s=150.0))
    ours = identify_frame(FrameTests((test,), (), np.diag(frame.mass), tmp_path / "campaign.yaml"))
    lines = ours.in_frequency
    model = ema.Model(
        lines.measured.T,
        lines.frequency_hz,
        lower=0.5,
        upper=10.6,
        pol_order_high=30,
        frf_form="accelerance",
        driving_point=0,
    )
    model.get_poles(show_progress=False)
    frequency, ratio = (np.asarray(poles[20]) for poles in (model.pole_freq, model.pole_xi))
    line = float(np.median(np.diff(lines.frequency_hz)))
    for estimate, damping in zip(ours.frequencies, ours.damping, strict=True):
        natural = estimate.value / (2 * np.pi)
        nearest = int(np.argmin(np.abs(frequency - natural)))
        # it knows frequencies to a line
        assert abs(frequency[nearest] - natural) <= line
        assert ratio[nearest] == pytest.approx(damping.value, rel=0.05)
