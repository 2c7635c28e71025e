"""OpenSees as an oracle: the same structure, its matrices, and its response with dampers."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrpipe.control.controller import build_controller
from mrpipe.control.controller_options import ControllerOptions
from mrpipe.control.gains import Gains
from mrpipe.errors import UserError
from mrpipe.simulation.excitation import recorded
from mrpipe.simulation.loop import LoopOptions
from mrpipe.simulation.several_dampers import LoopDamper, simulate_dampers
from mrpipe.structures import Frame, shear_frame
from mrpipe.structures.given import structure_from_settings
from mrpipe.structures.given_storage import read_matrix
from mrpipe.structures.opensees import ViscousDevice, opensees_matrices, opensees_script
from mrpipe.structures.options import MatrixEntry, StructureSettings
from mrpipe.structures.places import device_position

needs_opensees = pytest.mark.skipif(
    importlib.util.find_spec("openseespy") is None, reason="openseespy is not installed (pip install 'mrpipe[oracle]')"
)


def coupled_structure() -> Frame:
    """Return a structure that is not a shear frame: full M, C and K, and a degree of freedom without ground motion."""
    rng = np.random.default_rng(3)
    plain = shear_frame([25.0] * 4, [3.0e4] * 4, np.full(4, 0.01), name="storeys", source="test")
    part = 0.05 * rng.standard_normal((4, 4))
    change = np.eye(4) + part
    matrices = (change.T @ matrix @ change for matrix in (plain.mass, plain.damping, plain.stiffness))
    return Frame(*matrices, "coupled", influence=np.array([1.0, 1.0, 0.8, 0.0]))


@pytest.mark.oracle
@needs_opensees
def test_displacements_with_viscous_dampers_agree_within_a_thousandth(tmp_path: Path) -> None:
    frame = coupled_structure()
    first, second = device_position(frame, 1), device_position(frame, 3, 2)
    interval = 0.02
    time = np.arange(0.0, 4.0 + interval / 2, interval)
    ground = np.random.default_rng(5).standard_normal(time.size) * np.exp(-(((time - 1.5) / 1.0) ** 2))
    devices = [ViscousDevice(first, 300.0), ViscousDevice(second, 400.0, brace_n_m=4.0e4)]
    script = tmp_path / "model.py"
    script.write_text(
        opensees_script(frame, devices).split("if __name__")[0]
        + f"import json\nbuild()\nprint('ROWS ' + json.dumps(shake({ground.tolist()!r}, {interval}, 40)))\n",
        encoding="utf-8",
    )
    shown = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True).stdout
    rows = next(line for line in shown.splitlines() if line.startswith("ROWS "))
    expected = np.array(json.loads(rows.removeprefix("ROWS ")))

    options = LoopOptions(plant_rate_hz=4000.0, tracking="unclipped", record_rate_hz=50.0)
    dampers = [
        LoopDamper(
            f"damper {place}",
            item.position,
            None,
            build_controller("vd", Gains(c_n_s_m=item.viscosity), ControllerOptions()),
            item.brace_n_m,
        )
        for place, item in enumerate(devices)
    ]
    ours = simulate_dampers(frame, dampers, recorded(time, ground), options).first.displacement
    assert np.abs(ours - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.oracle
@needs_opensees
def test_matrices_come_back(tmp_path: Path) -> None:
    frame = coupled_structure()
    script = tmp_path / "model.py"
    script.write_text(opensees_script(frame), encoding="utf-8")
    found = opensees_matrices(script)
    for name, matrix in (("M", frame.mass), ("C", frame.damping), ("K", frame.stiffness)):
        np.testing.assert_allclose(found[name], matrix, atol=1e-9 * np.abs(matrix).max())


@pytest.mark.oracle
@needs_opensees
def test_a_script_can_be_the_file_of_a_structure(tmp_path: Path) -> None:
    script = tmp_path / "building.py"
    script.write_text(
        "import openseespy.opensees as ops\n"
        "ops.wipe(); ops.model('basic', '-ndm', 1, '-ndf', 1)\n"
        "ops.node(1, 0.0); ops.fix(1, 1); ops.node(2, 0.0); ops.node(3, 0.0)\n"
        "ops.mass(2, 20.0); ops.mass(3, 10.0)\n"
        "ops.uniaxialMaterial('Elastic', 1, 3.0e4); ops.uniaxialMaterial('Elastic', 2, 2.0e4)\n"
        "ops.element('zeroLength', 1, 1, 2, '-mat', 1, '-dir', 1)\n"
        "ops.element('zeroLength', 2, 2, 3, '-mat', 2, '-dir', 1)\n",
        encoding="utf-8",
    )
    settings = StructureSettings(file=str(script), mass=MatrixEntry(name="M"), stiffness=MatrixEntry(name="K"))
    frame = structure_from_settings(settings, read_matrix)
    np.testing.assert_allclose(frame.mass, np.diag([20.0, 10.0]))
    np.testing.assert_allclose(frame.stiffness, [[5.0e4, -2.0e4], [-2.0e4, 2.0e4]])


@pytest.mark.property
def test_a_script_that_fails_is_one_line(tmp_path: Path) -> None:
    script = tmp_path / "broken.py"
    script.write_text("raise ValueError('no model today')\n", encoding="utf-8")
    with pytest.raises(UserError, match="no model today"):
        opensees_matrices(script)


@pytest.mark.property
def test_the_elements_add_up_to_the_matrices() -> None:
    """The script's own numbers give the matrices, whether OpenSees is installed or not."""
    frame = coupled_structure()
    namespace: dict[str, object] = {}
    text = opensees_script(frame).replace("import openseespy.opensees as ops", "").split("def build")[0]
    exec(text, namespace)
    for name, matrix in (("SPRINGS", frame.stiffness), ("DASHPOTS", frame.damping)):
        built = np.zeros_like(matrix)
        for one, two, value in namespace[name]:  # type: ignore[attr-defined]
            row = np.zeros(5)
            row[one - 1], row[two - 1] = 1.0, -1.0
            built += value * np.outer(row[1:], row[1:])
        np.testing.assert_allclose(built, matrix, atol=1e-9 * np.abs(matrix).max())


@pytest.mark.property
def test_what_springs_and_dashpots_cannot_represent_is_refused() -> None:
    frame = coupled_structure()
    gyroscopic = 0.1 * float(np.max(frame.damping)) * (np.eye(4, k=1) - np.eye(4, k=-1))
    with pytest.raises(UserError, match="damping: is not symmetric"):
        opensees_script(replace(frame, damping=frame.damping + gyroscopic))
