"""Forces that a damper cannot give, and negative stiffness beyond the static limit."""

from __future__ import annotations

import pytest

from mrpipe.control.calibration import Calibration, CalibrationOptions, calibrate
from mrpipe.control.gains import Gains
from mrpipe.control.laws import law_named
from mrpipe.control.validity import force_demands, needed_force, validity_warnings
from mrpipe.thesis.gains import THESIS_GAINS


def warnings_of(calibration: Calibration, amplitude_m: float, residual_n: float, largest_n: float) -> list[str]:
    demands = force_demands(
        calibration, amplitude_m=amplitude_m, residual_force_n=residual_n, largest_force_n=largest_n
    )
    return validity_warnings(calibration, demands)


@pytest.fixture(scope="module")
def published(thesis_frame, floor_one):
    return calibrate(thesis_frame, floor_one, CalibrationOptions(source="published", published=THESIS_GAINS))


@pytest.mark.literature
def test_negative_stiffness_near_and_beyond_the_static_limit_is_reported(published, thesis_frame, floor_one):
    said = warnings_of(published, 0.0093, 22.0, 300.0)
    assert any("vdns" in line and "beyond the static limit of -4123" in line and "+1.29" in line for line in said)
    near = CalibrationOptions(overrides={"vdns": Gains(250.0, -4000.0)})
    said = warnings_of(calibrate(thesis_frame, floor_one, near), 0.0093, 22.0, 300.0)
    assert any("vdns" in line and "97 %" in line for line in said)


@pytest.mark.literature
def test_residual_force_is_the_limit_and_not_saturation(published):
    assert needed_force(law_named("vd"), Gains(650.0), 0.0093, 8.0) == pytest.approx(48.0, abs=0.5)
    said = warnings_of(published, 0.0093, 22.0, 300.0)
    assert any(line.startswith("vd: the residual force of 22 N") for line in said)
    weak = warnings_of(published, 0.0093, 1.0, 40.0)
    assert any("vd: needs 48 N, but the damper gives at most 40 N" in line for line in weak)


@pytest.mark.property
def test_demands_state_the_forces_and_what_limits_each_law(published):
    found = force_demands(published, amplitude_m=0.0093, residual_force_n=22.0, largest_force_n=40.0)["vd"].as_json()
    assert found.pop("needed_force_n") == pytest.approx(48.0, abs=0.5)
    assert found == {
        "amplitude_m": 0.0093,
        "residual_force_n": 22.0,
        "largest_force_n": 40.0,
        "exceeds_damper": True,
        "limited_by_residual_force": True,
    }
    strong = force_demands(published, amplitude_m=0.0093, residual_force_n=1.0, largest_force_n=300.0)["vd"]
    assert not strong.exceeds_damper and not strong.limited_by_residual
    assert strong.warnings("vd") == []


@pytest.mark.property
def test_only_laws_with_negative_stiffness_are_compared_with_the_static_limit(thesis_frame, floor_one):
    """Friction in proportion to an extremum has none, however strong it is."""
    laws = [law_named(name) for name in ("fdns", "homogeneous-friction")]
    options = CalibrationOptions(overrides={law.name: {"alpha_n_m": 5000.0} for law in laws})
    said = warnings_of(calibrate(thesis_frame, floor_one, options, laws), 0.01, 1.0, 1e6)
    assert [line.split(":")[0] for line in said if "static limit" in line] == ["fdns"]
