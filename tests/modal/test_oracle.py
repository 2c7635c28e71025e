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
        lines.measured.T, lines.frequency_hz, lower=0.5, upper=11.0, pol_order_high=40, frf_type="accelerance", driving_point=0
    )
    model.get_poles(show_progress=False)
    natural = [item.value / (2 * np.pi) for item in ours.frequencies]
    model.select_closest_poles(natural)
    np.testing.assert_allclose(model.nat_freq, natural, rtol=2e-3)
    np.testing.assert_allclose(model.nat_xi, [item.value for item in ours.damping], rtol=0.1)
