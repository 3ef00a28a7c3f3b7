"""Boxes of docs/which-numbers.md, each in a plain script: at rest they have the displacement of finite elements."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = (Path(__file__).parents[2] / "docs/which-numbers.md").read_text()
BOXES = {
    re.match(r"# (\w+)", code)[1]: code for code in re.findall(r"^```py\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
}

A, COLUMNS, ROWS = 0.05, 6, 4
NODES = np.arange((COLUMNS + 1) * (ROWS + 1)).reshape(COLUMNS + 1, ROWS + 1)
POINTS = A * np.array([[i + j / 2, j * 0.75**0.5] for i in range(COLUMNS + 1) for j in range(ROWS + 1)])
LOW, HIGH = (
    np.stack([one.ravel() for one in corners], axis=1)
    for corners in ((NODES[:-1, :-1], NODES[1:, :-1], NODES[:-1, 1:]), (NODES[1:, :-1], NODES[1:, 1:], NODES[:-1, 1:]))
)
TRIANGLES = np.concatenate([LOW, HIGH])
"""Equilateral triangles in a sheet with slanted ends."""

SIDES, SHARED = np.unique(
    np.sort(TRIANGLES[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_counts=True
)
NAMES = {
    "E": 5e6, "nu": 0.3, "t": 1e-3, "rho": 1000.0, "points": POINTS, "triangles": TRIANGLES, "held": NODES[0].tolist(),
    "springs": SIDES, "k": 0.433 * 5e6 * 1e-3 * SHARED, "np": np,
}  # fmt: skip
FORCES = np.zeros_like(POINTS)
FORCES[NODES[-1], 0] = np.array([0.5, 1, 1, 1, 0.5]) * 5.0 / 4  # 0.5 % of stretch
MASSES = np.bincount(TRIANGLES.ravel(), minlength=len(POINTS)) * 0.75**0.5 * A**2 / 2 / 3


def solved(matrix, forces=FORCES):
    """Mean displacement of the right end along x by a stiffness matrix, its left end held."""
    free = np.setdiff1d(np.arange(2 * len(POINTS)), np.array([[2 * n, 2 * n + 1] for n in NODES[0]]))
    moved = np.zeros(2 * len(POINTS))
    moved[free] = np.linalg.solve(matrix[np.ix_(free, free)], forces.ravel()[free])
    return moved.reshape(-1, 2)


def by_triangles(E, nu):
    """Linear triangles in plane stress."""
    law = E * 1e-3 / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    matrix = np.zeros((2 * len(POINTS),) * 2)
    for cell in TRIANGLES:
        slopes = np.linalg.inv(np.column_stack([np.ones(3), POINTS[cell]]))[1:]
        b = np.zeros((3, 6))
        b[0, ::2], b[1, 1::2], b[2, ::2], b[2, 1::2] = slopes[0], slopes[1], slopes[1], slopes[0]
        places = np.ravel([[2 * n, 2 * n + 1] for n in cell])
        matrix[np.ix_(places, places)] += 0.75**0.5 * A**2 / 2 * b.T @ law @ b
    return matrix


def by_springs(k):
    """Springs at small strain."""
    matrix = np.zeros((2 * len(POINTS),) * 2)
    for (i, j), one in zip(SIDES, k):
        along = (POINTS[j] - POINTS[i]) / A
        row = np.zeros(2 * len(POINTS))
        row[[2 * i, 2 * i + 1, 2 * j, 2 * j + 1]] = *-along, *along
        matrix += one * np.outer(row, row)
    return matrix


def end(moved):
    return moved[NODES[-1], 0].mean()


SPRINGS, SHEET = end(solved(by_springs(NAMES["k"]))), end(solved(by_triangles(5e6, 0.3)))


def test_springs_of_the_page_are_linear_triangles_of_a_third():
    assert end(solved(by_triangles(5e6, 1 / 3))) == pytest.approx(SPRINGS, rel=1e-3)


@pytest.mark.parametrize("solver", ["VBD", "VBD springs", "SemiImplicit"])
def test_newton(solver):
    pytest.importorskip("newton")
    solver, _, springs = solver.partition(" ")
    names = NAMES | ({"E": 0.0} if springs else {"springs": [], "k": []})
    code = BOXES["Newton"]
    if solver == "SemiImplicit":  # as the comment says
        code = code.replace("tri_ka=lam * t", "tri_ka=(lam + G) * t").replace(
            "SolverVBD(model, iterations=20)", "SolverSemiImplicit(model)"
        )
    exec(code.replace("SolverVBD", f"Solver{solver}"), names)
    model, made = names["model"], names["solver"]
    assert model.particle_mass.numpy()[NODES[1:]] == pytest.approx(MASSES[NODES[1:]], rel=1e-5)
    step, control = 1 / 60 / (40 if solver == "VBD" else 80), model.control()
    now, after = model.state(), model.state()
    rest, forces = now.particle_q.numpy().copy(), np.pad(FORCES, ((0, 0), (0, 1))).astype(np.float32)
    for _ in range(round(0.4 / step)):
        now.particle_f.assign(forces)
        made.step(now, after, control, None, step)
        after.particle_qd.assign(after.particle_qd.numpy() / (1 + 40 * step))
        now, after = after, now
    assert end(now.particle_q.numpy() - rest) == pytest.approx(SPRINGS if springs else SHEET, rel=0.01)


@pytest.mark.parametrize(("step", "reset"), [(1 / 60, False), (2e-3, True)])
def test_mujoco(step, reset, tmp_path, monkeypatch):
    """At MuJoCo's own step and integrator the sheet explodes, and is put back every few steps."""
    mujoco = pytest.importorskip("mujoco", minversion="4")
    monkeypatch.chdir(tmp_path)  # MuJoCo writes a log
    code = BOXES["MuJoCo"]
    names = NAMES | {"dt": step}
    exec(code.replace("discrete", "Euler") if reset else code, names)
    model, data = names["model"], mujoco.MjData(names["model"])
    for _ in range(round(0.5 / step)):
        for node, force in zip(NODES[-1], FORCES[NODES[-1]]):
            data.xfrc_applied[names["body"][node], :2] = force
        mujoco.mj_step(model, data)
        data.qvel /= 1 + 40 * step
    moved = data.flexvert_xpos[:, :2] - POINTS
    if reset:
        assert data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number and data.time < 0.05
    else:
        assert end(moved) == pytest.approx(SHEET, rel=0.015)  # its law is St. Venant-Kirchhoff's


def test_xpbd():
    names = NAMES | {"dt": 1 / 60 / 40, "iterations": 20, "rest": np.full(len(SIDES), A)}
    names |= {"x": POINTS.copy(), "v": np.zeros_like(POINTS), "forces": FORCES, "w": 1 / MASSES}
    names["w"][NODES[0]] = 0
    code = compile(BOXES["XPBD"], "box", "exec")
    for _ in range(round(0.2 / names["dt"])):
        exec(code, names)
        names["v"] /= 1 + 40 * names["dt"]
    assert end(names["x"] - POINTS) == pytest.approx(SPRINGS, rel=0.01)


def test_pybullet(tmp_path, monkeypatch):
    """All springs and nodes alike, pulled by gravity."""
    pytest.importorskip("pybullet")
    monkeypatch.chdir(tmp_path)
    rows = [f"v {x!r} {y!r} 0\n" for x, y in POINTS.tolist()] + [
        f"f {a} {b} {c}\n" for a, b, c in (TRIANGLES + 1).tolist()
    ]
    (tmp_path / "sheet.obj").write_text("".join(rows))
    names = NAMES | {"dt": 1e-4, "k": 4000.0, "mass": MASSES.sum()}
    exec(BOXES["PyBullet"], names)
    p, pull = names["p"], 50.0
    p.setGravity(pull, 0, 0)
    for _ in range(5000):
        p.stepSimulation()
    places = np.array(p.getMeshData(names["sheet"], -1, flags=p.MESH_DATA_SIMULATION_MESH)[1])[:, :2]
    p.disconnect()
    forces = np.tile([MASSES.mean() * pull, 0.0], (len(POINTS), 1))
    exact = end(solved(by_springs(np.full(len(SIDES), 4000.0)), forces))
    assert end(places - POINTS) == pytest.approx(exact, rel=0.02)
