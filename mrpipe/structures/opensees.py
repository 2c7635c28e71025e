"""A linear structure as an OpenSees model: export as an openseespy script, and the matrices of a script.

Every entry of the matrices becomes an element between two degrees of freedom, or between one and the ground: springs
and dashpots (zeroLength with the material Elastic), inertias (InertiaTruss), and lumped masses. Row i of K is
K_ii = sum of all springs at i, K_ij = -spring between i and j, and so for C and M. This holds for every symmetric
matrix, so that structures which are not shear frames can be exported too.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrpipe.artifacts import FloatArray
from mrpipe.errors import UserError
from mrpipe.structures.frame import Frame
from mrpipe.structures.given_checks import SYMMETRY, largest_asymmetry

NEGLIGIBLE = 1e-12
"""Entries of a matrix below this share of the largest one get no element."""

LONGEST_IMPORT_S = 300.0


@dataclass(frozen=True)
class ViscousDevice:
    """A linear damper f = c v + k x between two degrees of freedom, or between one and the ground.

    Attributes
    ----------
    position
        Connectivity vector w, shape (n,), with one entry 1 and at most one entry -1.
    viscosity
        c [N s/m].
    stiffness
        k [N/m], in parallel with the dashpot.
    brace_n_m
        Stiffness of a brace in series [N/m]; infinite: rigid.
    """

    position: FloatArray
    viscosity: float
    stiffness: float = 0.0
    brace_n_m: float = math.inf


def opensees_script(frame: Frame, devices: Sequence[ViscousDevice] = (), notes: Sequence[str] = ()) -> str:
    """Return an openseespy script that builds the structure.

    The script has `build()`, which makes the model, and `shake(acceleration, interval, substeps)`, which returns the
    displacements relative to the ground under a ground acceleration, one row per sample. Node i + 1 is the degree of
    freedom i of the structure (from 1); node 1 is the ground.

    Parameters
    ----------
    frame
        The structure.
    devices
        Linear dampers.
    notes
        Sentences on what the model lacks; they become comments of the script.

    Raises
    ------
    UserError
        If a matrix is not symmetric, a device does not connect two degrees of freedom, or a braced device has its own
        stiffness.
    """
    for key in ("mass", "damping", "stiffness"):
        if largest_asymmetry(getattr(frame, key))[0] > SYMMETRY:
            remedy = "give a symmetric matrix, or export another format"
            raise UserError("opensees", key, "is not symmetric, so springs and dashpots cannot represent it", remedy)
    lines = [
        f'"""OpenSees model of the structure {frame.name}, written by mrpipe (SI units)."""',
        "",
        *(f"# {note}" for note in notes),
        *([""] if notes else []),
        "import openseespy.opensees as ops",
        "",
        f"NAMES = {list(frame.names)!r}",
        "# force of each degree of freedom under a ground acceleration of 1 m/s^2 [N s^2/m]",
        f"LOAD = {(-frame.mass @ frame.ground_influence).tolist()!r}",
        "# node, node, value; node 1 is the ground",
        f"LUMPED_MASSES = {_to_ground(frame.mass)!r}",
        f"INERTIAS = {_between(frame.mass)!r}",
        f"SPRINGS = {_links(frame.stiffness)!r}",
        f"DASHPOTS = {_links(frame.damping)!r}",
        "# node, node, c, k, brace; a brace of 0 is rigid",
        f"DAMPERS = {[_device(item, frame.floors) for item in devices]!r}",
        "",
        _FUNCTIONS,
    ]
    return "\n".join(lines)


def _to_ground(matrix: FloatArray) -> list[tuple[int, float]]:
    return [(i + 2, float(value)) for i, value in enumerate(matrix.sum(axis=1))]


def _between(matrix: FloatArray) -> list[tuple[int, int, float]]:
    least = NEGLIGIBLE * float(np.max(np.abs(matrix), initial=0.0))
    n = matrix.shape[0]
    return [
        (i + 2, j + 2, float(-matrix[i, j])) for i in range(n) for j in range(i + 1, n) if abs(matrix[i, j]) > least
    ]


def _links(matrix: FloatArray) -> list[tuple[int, int, float]]:
    least = NEGLIGIBLE * float(np.max(np.abs(matrix), initial=0.0))
    grounded = [(1, node, value) for node, value in _to_ground(matrix) if abs(value) > least]
    return grounded + _between(matrix)


def _device(item: ViscousDevice, floors: int) -> tuple[int, int, float, float, float]:
    w = item.position
    ends = np.flatnonzero(w)
    values = sorted(w[ends].tolist())
    if w.shape != (floors,) or values not in ([1.0], [-1.0, 1.0]):
        raise UserError(
            "opensees", "dampers", f"a position {w.tolist()}", "connect two degrees of freedom, or one and the ground"
        )
    if item.stiffness and not math.isinf(item.brace_n_m):
        raise UserError("opensees", "dampers", "stiffness behind a brace", "give a braced damper without stiffness")
    first = int(np.flatnonzero(w == 1.0)[0]) + 2
    second = int(np.flatnonzero(w == -1.0)[0]) + 2 if len(ends) == 2 else 1
    brace = 0.0 if math.isinf(item.brace_n_m) else item.brace_n_m
    return second, first, item.viscosity, item.stiffness, brace


_FUNCTIONS = '''\
def build():
    """Make the model."""
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(1, 0.0)
    ops.fix(1, 1)
    for node, mass in LUMPED_MASSES:
        # the distances have no meaning; an inertia truss needs two different places
        ops.node(node, 1e-9 * node)
        ops.mass(node, mass)
    element = 0
    for first, second, inertia in INERTIAS:
        element += 1
        ops.element("InertiaTruss", element, first, second, inertia)
    links = [(a, b, k, 0.0) for a, b, k in SPRINGS] + [(a, b, 0.0, c) for a, b, c in DASHPOTS]
    for first, second, c, k, brace in DAMPERS:
        if brace == 0.0:
            links.append((first, second, k, c))
            continue
        element += 1
        ops.uniaxialMaterial("ViscousDamper", element, brace, c, 1.0)
        ops.element("zeroLength", element, first, second, "-mat", element, "-dir", 1)
    for first, second, k, c in links:
        element += 1
        ops.uniaxialMaterial("Elastic", element, k, c)
        ops.element("zeroLength", element, first, second, "-mat", element, "-dir", 1)


def shake(acceleration, interval, substeps=10):
    """Return displacements relative to the ground [m], a row per sample, under a ground acceleration [m/s^2]."""
    ops.timeSeries("Path", 1, "-dt", interval, "-values", *acceleration)
    ops.pattern("Plain", 1, 1)
    for node, force in enumerate(LOAD, start=2):
        ops.load(node, force)
    ops.wipeAnalysis()
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-14, 20)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    nodes = [node for node, _ in LUMPED_MASSES]
    rows = [[0.0] * len(nodes)]
    for _ in range(len(acceleration) - 1):
        if ops.analyze(substeps, interval / substeps) != 0:
            raise RuntimeError("OpenSees does not converge")
        rows.append([ops.nodeDisp(node, 1) for node in nodes])
    return rows


if __name__ == "__main__":
    build()
    modes = max(len(LOAD) - 1, 1)
    for number, squared in enumerate(ops.eigen("-fullGenLapack", modes), start=1):
        print(f"mode {number}: {squared ** 0.5:.6g} rad/s")
'''

_READER = """\
import json, runpy, sys
sys.argv = [sys.argv[1]]
runpy.run_path(sys.argv[0], run_name="__main__")
import openseespy.opensees as ops
result = {"nodes": len(ops.getNodeTags())}
if result["nodes"]:
    ops.wipeAnalysis()
    ops.constraints("Transformation"); ops.numberer("Plain"); ops.system("FullGeneral"); ops.algorithm("Linear")
    for name, factors in (("M", (1.0, 0.0, 0.0)), ("C", (0.0, 1.0, 0.0)), ("K", (0.0, 0.0, 1.0))):
        ops.integrator("GimmeMCK", *factors)
        ops.analysis("Transient")
        ops.analyze(1, 0.0)
        size = ops.systemSize()
        values = ops.printA("-ret")
        result[name] = [values[row * size:(row + 1) * size] for row in range(size)]
print("\\nMATRICES " + json.dumps(result))
"""


def opensees_matrices(script: Path) -> dict[str, FloatArray]:
    """Return the matrices M, C and K of the model that an openseespy script builds.

    The script runs in a separate process; the model must still be there at its end. The rows are the free degrees of
    freedom in the order of the nodes. Source: integrator GimmeMCK of OpenSees.

    Parameters
    ----------
    script
        A Python file. It is executed.

    Raises
    ------
    UserError
        If openseespy is not installed, the script fails, or it leaves no model.
    """
    try:
        found = subprocess.run(
            [sys.executable, "-c", _READER, str(script)],
            capture_output=True,
            text=True,
            timeout=LONGEST_IMPORT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise UserError(script, "", f"runs longer than {LONGEST_IMPORT_S:g} s", "leave the analysis out") from error
    if found.returncode != 0:
        reason = (found.stderr.strip().splitlines() or ["it ended without a message"])[-1]
        if "No module named 'openseespy" in found.stderr:
            reason = "needs openseespy, which is not installed"
        raise UserError(script, "", f"cannot be run: {reason}", "pip install 'mrpipe[oracle]', or correct the script")
    lines = [line for line in found.stdout.splitlines() if line.startswith("MATRICES ")]
    content = json.loads(lines[-1].removeprefix("MATRICES ")) if lines else {"nodes": 0}
    if not content.get("M"):
        raise UserError(script, "", "leaves no OpenSees model", "build the model in the script and do not wipe it")
    return {name: np.array(content[name], dtype=np.float64) for name in ("M", "C", "K")}
