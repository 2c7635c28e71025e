"""Weights of the regulator pass from the settings to the design by name."""

from __future__ import annotations

from dataclasses import fields

import pytest
from pydantic import ValidationError

from mrpipe.control.calibration_settings import CalibrationSettings, NeuralReferenceSettings, RegulatorSettings
from mrpipe.control.lqg import Weights

pytestmark = pytest.mark.property


def test_every_weight_has_the_name_of_the_design() -> None:
    given = RegulatorSettings(
        energy_weight=2.0, top_displacement_weight=3.0, force_weight=4.0, ground_noise_m_s2=5.0, force_noise_n=6.0
    ).known()
    assert sorted(given.values()) == [2.0, 3.0, 4.0, 5.0, 6.0]
    assert set(given) <= {item.name for item in fields(Weights)}
    assert Weights(**given).force == 4.0


def test_what_is_not_given_is_left_to_the_design() -> None:
    assert not {"force", "force_noise_n"} & set(RegulatorSettings().known())


@pytest.mark.parametrize(
    ("section", "values"),
    [
        (CalibrationSettings, {"negative_stiffness_n_m": 100.0}),
        (CalibrationSettings, {"positive_stiffness_n_m": -100.0}),
        (CalibrationSettings, {"target_mode": 0}),
        (CalibrationSettings, {"gains": "best"}),
        (NeuralReferenceSettings, {"hidden": ()}),
        (RegulatorSettings, {"force_weight": 0.0}),
    ],
)
def test_values_of_the_wrong_sign_are_refused(section: type, values: dict) -> None:
    with pytest.raises(ValidationError):
        section(**values)
