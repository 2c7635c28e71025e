"""The stage says where the fit on the validation tests means nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from mrpipe.stages.identify_damper import _fit_doubt

pytestmark = pytest.mark.property


@pytest.mark.parametrize(
    ("role", "fit_percent", "expected"),
    [
        ("validation", 96.0, "None"),
        ("validation", np.nan, "the force of the validation tests is constant"),
        ("training", np.nan, "the campaign has no validation test"),
    ],
)
def test_the_doubt_about_the_fit_of_a_damper(role: str, fit_percent: float, expected: str) -> None:
    score = SimpleNamespace(nrmse=0.02, fit_percent=fit_percent)
    chosen = SimpleNamespace(tests=[SimpleNamespace(role=role)], validation=score)
    assert expected in str(_fit_doubt(chosen))  # type: ignore[arg-type]
