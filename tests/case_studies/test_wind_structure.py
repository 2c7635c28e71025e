"""The tower's matrices and the synthesised wind."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.signal import csd, welch

from mrpipe.artifacts import public_data_directory
from mrpipe.case_studies.model import modal_model
from mrpipe.case_studies.options import WindClimate
from mrpipe.case_studies.wind.load import (
    AIR_DENSITY,
    lateral_spectrum,
    read_wind,
    shedding_correlation,
    shedding_spectrum,
    synthetic_wind,
)
from mrpipe.case_studies.wind.structure import (
    HEIGHT_M,
    WIDTH_M,
    Tower,
    condensed_cantilever,
    published_tower,
    surrogate_tower,
    with_outrigger,
    with_tuned_mass,
)
from mrpipe.errors import UserError

FIVE_HZ = [0.160, 0.765, 1.992, 3.790, 6.395]


@pytest.fixture(scope="module")
def tower() -> Tower:
    return surrogate_tower()


@pytest.mark.literature
def test_surrogate_has_the_five_frequencies_and_damping(tower: Tower) -> None:
    modal = modal_model(tower.model)
    np.testing.assert_allclose(modal.angular_frequencies[:5] / (2.0 * np.pi), FIVE_HZ, rtol=1e-3)
    np.testing.assert_allclose(modal.damping_ratios[:5], 0.01, rtol=1e-9)
    assert modal.classical
    assert tower.model.total_mass_kg == pytest.approx(300.0 * 42.0**2 * 306.1, rel=1e-12)


@pytest.mark.real
@pytest.mark.literature
def test_published_tower() -> None:
    folder = public_data_directory()
    if folder is None:
        pytest.skip("the public data are not there (MRPIPE_DATA)")
    tower = published_tower(folder / "tall76" / "76dof_MKC_matrix.mat")
    modal = modal_model(tower.model)
    np.testing.assert_allclose(modal.angular_frequencies[:5] / (2.0 * np.pi), FIVE_HZ, rtol=1e-3)
    np.testing.assert_allclose(modal.damping_ratios[:5], 0.01, rtol=1e-4)


@pytest.mark.planted
def test_files_that_are_no_tower(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such model"):
        published_tower(tmp_path / "nothing.mat")
    (tmp_path / "wrong.mat").write_bytes(b"no")
    with pytest.raises(UserError, match="not what its ending says"):
        published_tower(tmp_path / "wrong.mat")
    savemat(tmp_path / "wrong.mat", {"M76": np.eye(5), "K76": np.eye(5)})
    with pytest.raises(UserError, match="C76: is not in the file"):
        published_tower(tmp_path / "wrong.mat")
    savemat(tmp_path / "wrong.mat", {key: np.eye(5) for key in ("M76", "C76", "K76")})
    with pytest.raises(UserError, match="holds a structure of 5 degrees of freedom"):
        published_tower(tmp_path / "wrong.mat")


@pytest.mark.real
def test_the_common_route_gives_the_published_matrices() -> None:
    folder = public_data_directory()
    if folder is None:
        pytest.skip("the public data are not there (MRPIPE_DATA)")
    path = folder / "tall76" / "76dof_MKC_matrix.mat"
    model, content = published_tower(path).model, loadmat(path)
    for name, matrix in (("M76", model.mass), ("C76", model.damping), ("K76", model.stiffness)):
        np.testing.assert_allclose(matrix, 500.0 * (content[name] + content[name].T), rtol=1e-14)


@pytest.mark.literature
def test_uniform_cantilever_converges_to_bernoulli_euler() -> None:
    M, K = condensed_cantilever(np.full(40, 2e9), np.full(40, 300.0), 0.5)
    omega = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    exact = np.array([3.51602, 22.0345, 61.6972]) / 20.0**2 * np.sqrt(2e9 / 300.0)
    np.testing.assert_allclose(np.sort(omega)[:3], exact, rtol=1e-3)
    # tip load: v = F L^3/(3 E I), exact in beam elements
    force = np.zeros(40)
    force[-1] = 1.0
    assert np.linalg.solve(K, force)[-1] == pytest.approx(20.0**3 / (3.0 * 2e9), rel=1e-6)


@pytest.mark.literature
def test_tuned_mass_splits_the_first_mode(tower: Tower) -> None:
    tuned = with_tuned_mass(tower, 500e3, 1.0)
    assert tuned.model.degrees_of_freedom == 77
    first = modal_model(tower.model, 1)
    omega, top = first.angular_frequencies[0], first.shapes[75, 0]
    pair = modal_model(tuned.model, 2).angular_frequencies
    # two coupled oscillators of modal masses 1/top^2 and 500 t: split of sqrt(mu)
    mu = 500e3 * top**2
    expected = np.sqrt(1.0 + mu / 2.0 + np.array([-1.0, 1.0]) * np.sqrt(mu + mu**2 / 4.0))
    np.testing.assert_allclose(pair / omega, expected, rtol=2e-3)


@pytest.mark.property
def test_outrigger_needs_a_floor_between(tower: Tower) -> None:
    with pytest.raises(UserError, match="is not a floor for an outrigger"):
        with_outrigger(tower, 76, 21.0)


@pytest.mark.literature
def test_spectra_integrate_to_one() -> None:
    frequency = np.linspace(1e-5, 60.0, 1_500_000)
    shedding = shedding_spectrum(frequency, 40.0, 42.0, WindClimate())
    assert np.trapezoid(shedding, frequency) == pytest.approx(1.0, rel=1e-3)
    lateral = np.trapezoid(lateral_spectrum(frequency, 100.0, 40.0), frequency)
    # Kaimal's tail goes on above the last frequency
    assert lateral == pytest.approx(1.0, abs=0.02)


@pytest.mark.oracle
def test_synthetic_wind_has_its_spectrum_coherence_and_variance() -> None:
    climate = WindClimate(lateral_intensity=1e-6)
    load = synthetic_wind(
        np.random.default_rng(2), 10, HEIGHT_M, WIDTH_M, duration_s=20000.0, interval_s=0.5, climate=climate
    )
    pressure = 0.5 * AIR_DENSITY * climate.top_speed_m_s**2 * WIDTH_M * HEIGHT_M / 10
    top = load.forces_n[:, -1]
    assert top.std() == pytest.approx(climate.lift_coefficient * pressure, rel=0.05)
    frequency, density = welch(top, 2.0, nperseg=1024)
    wanted = shedding_spectrum(frequency, climate.top_speed_m_s, WIDTH_M, climate) * top.var()
    band = (frequency > 0.08) & (frequency < 0.15)
    assert np.mean(density[band]) == pytest.approx(np.mean(wanted[band]), rel=0.08)
    correlation = np.corrcoef(load.forces_n[:, -1], load.forces_n[:, -2])[0, 1]
    model = shedding_correlation(np.array([HEIGHT_M, 0.9 * HEIGHT_M]), WIDTH_M)[0, 1]
    # the local spectra of two heights overlap all but a little
    assert correlation == pytest.approx(model, abs=0.06)


@pytest.mark.oracle
def test_lateral_turbulence_has_davenports_coherence() -> None:
    climate = WindClimate(lift_coefficient=1e-9, decay=10.0)
    load = synthetic_wind(
        np.random.default_rng(5), 20, HEIGHT_M, WIDTH_M, duration_s=20000.0, interval_s=0.5, climate=climate
    )
    a, b = load.forces_n[:, 19], load.forces_n[:, 17]
    frequency, cross = csd(a, b, 2.0, nperseg=512)
    _, first = welch(a, 2.0, nperseg=512)
    _, second = welch(b, 2.0, nperseg=512)
    coherence = (cross / np.sqrt(first * second)).real
    speed = climate.top_speed_m_s * 0.975**climate.profile_exponent
    wanted = np.exp(-10.0 * frequency * 0.1 * HEIGHT_M / speed)
    band = (frequency > 0.02) & (frequency < 0.3)
    assert np.abs(coherence[band] - wanted[band]).mean() < 0.06


@pytest.mark.property
def test_synthetic_wind_is_seeded() -> None:
    first = synthetic_wind(np.random.default_rng(9), 8, 100.0, 20.0, duration_s=30.0)
    again = synthetic_wind(np.random.default_rng(9), 8, 100.0, 20.0, duration_s=30.0)
    other = synthetic_wind(np.random.default_rng(10), 8, 100.0, 20.0, duration_s=30.0)
    np.testing.assert_array_equal(first.forces_n, again.forces_n)
    assert np.abs(first.forces_n - other.forces_n).max() > 0.0


@pytest.mark.golden
def test_users_wind_file(tmp_path: Path) -> None:
    forces = np.random.default_rng(1).standard_normal((50, 4))
    clock = np.arange(50) * 0.1
    np.savetxt(tmp_path / "wind.csv", np.column_stack([clock, forces]), delimiter=",")
    load = read_wind(tmp_path / "wind.csv", 4)
    assert load.interval_s == pytest.approx(0.1)
    np.testing.assert_allclose(load.forces_n, forces * 1e3, rtol=1e-6)
    np.save(tmp_path / "wind.npy", forces)
    np.testing.assert_allclose(read_wind(tmp_path / "wind.npy", 4, unit="N", interval_s=0.2).forces_n, forces)


@pytest.mark.planted
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("nan", "line 4, column 2: is not finite"),
        ("array", "row 4, column 2: is not finite"),
        ("columns", "4 columns"),
        ("clock", "no clock"),
        ("words", "line 1, column 1: 'a' is not a number"),
        ("word", "line 5, column 3: '1x' is not a number"),
        ("ragged", "line 5: has 3 numbers, the first row 4"),
        ("matlab", "not a MATLAB file that can be read"),
        ("text", "holds no array of real numbers"),
        ("numpy", "is not an array of numbers"),
        ("missing", "no such wind"),
    ],
)
def test_bad_wind_files_get_one_line(tmp_path: Path, kind: str, words: str) -> None:
    forces = np.ones((30, 4))
    path = tmp_path / "wind.txt"
    if kind == "nan":
        forces[3, 1] = np.nan
    if kind == "columns":
        forces = forces[:, :3]
    contents = {
        "words": "a b c\nd e f\n",
        "word": "# north\n\n1 1 1 1\n1 1 1 1\n1 1 1x 1\n",
        "ragged": "# north\n\n1 1 1 1\n1 1 1 1\n1, 1; 1\n",
        "matlab": "no MATLAB file",
        "numpy": "no array",
    }
    if kind in contents:
        path = path.with_suffix({"matlab": ".mat", "numpy": ".npy"}.get(kind, ".txt"))
        path.write_text(contents[kind])
    elif kind == "text":
        path = path.with_suffix(".mat")
        savemat(path, {"name": "north"})
    elif kind == "array":
        forces[3, 1] = np.nan
        path = path.with_suffix(".npy")
        np.save(path, forces)
    elif kind != "missing":
        np.savetxt(path, forces)
    with pytest.raises(UserError, match=words):
        read_wind(path, 4, interval_s=None if kind == "clock" else 0.1)
