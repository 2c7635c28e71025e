"""`configs/thesis-letter.yaml` is the thesis to the letter, on the rig of `configs/thesis.yaml`."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from mrpipe.config.model import config_model

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def _settings(name: str):  # type: ignore[no-untyped-def]
    return config_model().model_validate(yaml.safe_load((CONFIGS / name).read_text(encoding="utf-8")))


@pytest.mark.literature
def test_networks_controller_and_identification_are_those_of_the_thesis() -> None:
    letter = _settings("thesis-letter.yaml")
    for training in (letter.train_forward, letter.train_inverse):
        assert training.hidden == (6, 6) and not training.biases
        assert (training.initial, training.method) == ("perceptron", "minpack")
    assert letter.train_inverse.averaged == 1
    controller = letter.simulate.controller
    assert (controller.inverse_request, controller.friction_rounding_m_s) == ("history", 0.0)
    assert (controller.rate_hz, controller.residual_force_n, controller.cutoff_hz) == (200.0, 18.0, 60.0)
    frame = letter.identify_frame
    assert (frame.modes_from, frame.decay_method) == ("peak-picking", "logarithmic-decrement")
    assert letter.identify_damper.method == "nelder-mead"


@pytest.mark.property
def test_both_configurations_have_the_same_rig_gains_and_excitation() -> None:
    letter, default = _settings("thesis-letter.yaml"), _settings("thesis.yaml")
    assert letter.laboratory == default.laboratory and letter.seed == default.seed
    assert letter.calibrate.published == default.calibrate.published
    first, second = letter.simulate.excitation, default.simulate.excitation
    assert first.frequency_rad_s == second.frequency_rad_s
    assert first.reference_rms_top_m == second.reference_rms_top_m


@pytest.mark.property
def test_main_job_simulates_the_neural_controller_and_the_regulator() -> None:
    default = _settings("thesis.yaml")
    assert {"simulate-nnc", "simulate-lqg"} <= set(default.stages)
    # each further law would add to the time of the comparison before and after the tracing
    assert not {"nnc", "lqg"} & set(default.close_loop.laws)
