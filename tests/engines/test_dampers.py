"""Dampers that are typed into Newton, MuJoCo and PyBullet give a beam the decay that was measured."""

import re

import numpy as np
import pytest

import springtune as st
from springtune.mechanics.dynamics import Motion

BEAM, RUBBER = st.Beam("100 mm", "20 mm"), st.Material("1 MPa", 0.3, density="1100 kg/m^3")


def scene(definition="patch", force="10 mN", **options):
    """A beam that is bent by some percents of its length, so that single precision is enough."""
    mesh = st.make_mesh(BEAM, "structured", "10 mm")
    return st.Scene(BEAM, mesh, RUBBER, "bending", force, definition=definition, **options)


def swing(one, session, setting, periods):
    """Decay of the loaded mode of a scene about its equilibrium, the load switched on at rest."""
    motion = one.motion()
    frequency, shape = motion.loaded_mode
    place, seen = one.solve().displacements, []
    for frame in range(round(periods * 2 * np.pi / frequency / setting.dt)):
        moved = session.displacements() - place
        seen.append((frame * setting.dt, (motion.mass * shape) @ motion.network.reduce(moved)))
        session.advance(1)
    return st.fit_decay(*np.array(seen).T)


def started(one, name, setting):
    """Session of an engine without dampers."""
    return st.ENGINES[name].start(st.SpringNet.from_scene(one, errors=False), setting, 0.0)


NEWTON = {
    "newton-semi-implicit": (0.05, st.Setting(1e-3, 20), 0.01),
    "newton-xpbd": (0.1, st.Setting(1e-3, 5, 20), 0.01),
    "newton-vbd": (0.3, st.Setting(1e-3, 5, 60), 0.01),
}
"""Decrement, setting and tolerance."""


@pytest.mark.parametrize(
    "name",
    [
        "newton-semi-implicit",
        pytest.param("newton-xpbd", marks=pytest.mark.slow),  # compiles for 20 s, which test_newton.py does meanwhile
        pytest.param("newton-vbd", marks=pytest.mark.slow),
    ],
)
def test_springs_of_newton(name):
    """`kd` is a dashpot [N s/m]."""
    pytest.importorskip("newton")
    decrement, setting, tolerance = NEWTON[name]
    one = scene()
    typed = st.ENGINES[name].typed_dampers(st.damping_of(one, decrement=decrement), setting)
    session = started(one, name, setting)
    session.model.spring_damping.assign(typed["kd"].astype(np.float32))
    assert swing(one, session, setting, 1.5).decrement == pytest.approx(decrement, rel=tolerance)


@pytest.mark.slow
def test_triangles_of_newton_vbd():
    """`tri_kd`, beta mu h / 2, damps shear as beta does, and a strip by (1 + nu^2) / (1 + nu) of it."""
    pytest.importorskip("newton")
    one, setting = scene("delingette"), st.Setting(1e-3, 5, 60)
    session = started(one, "newton-vbd", setting)
    typed = st.ENGINES["newton-vbd"].typed_dampers(st.damping_of(one, decrement=0.3), setting)["tri_kd"]
    materials = session.model.tri_materials.numpy()
    materials[:, 2] = typed * 1.3 / 1.09
    session.model.tri_materials.assign(materials)
    assert swing(one, session, setting, 1.5).decrement == pytest.approx(0.3, rel=0.02)


SHORT = st.Setting(1e-3, 25)
"""Steps that stay stable with dampers over stiffness that are explicit."""


@pytest.mark.parametrize(
    "name, damper",
    [
        ("mujoco-euler", "joint damping"),
        ("mujoco-implicitfast", "joint damping"),
        ("mujoco-discrete", "joint damping"),
        ("mujoco-discrete", "tendon damping"),
        ("mujoco-discrete", "flex damping"),
        ("mujoco-rk4", "tendon damping"),
        ("mujoco-euler", "flex damping"),
    ],
)
def test_mujoco(name, damper, tmp_path):
    """Also of what steps of `discrete` damp by themselves, as implicit Euler does."""
    mujoco = pytest.importorskip("mujoco")
    one = scene("delingette" if damper == "flex damping" else "patch", "0.1 mN")
    decrement, setting = (0.3, st.Setting(1e-3, 20)) if "joint" in damper or "discrete" in name else (0.03, SHORT)
    measured = st.damping_of(one, decrement=decrement)
    typed = st.ENGINES[name].typed_dampers(measured, setting)[damper]
    session = started(one, name, setting)
    if damper == "joint damping":
        session.model.dof_damping[:] = np.repeat(typed[:, None], 2, axis=1)[~one.held]
    if damper == "tendon damping":
        session.model.tendon_damping[: len(typed)] = typed
    if damper == "flex damping":  # it is compiled into a model
        [path] = one.springs.write(tmp_path / "net.xml", errors=False)
        text = re.sub(' damping="[^"]*"', "", path.read_text())
        options = session.model.opt
        session.model = mujoco.MjModel.from_xml_string(text.replace("<elasticity ", f'<elasticity damping="{typed}" '))
        session.model.opt.timestep, session.model.opt.integrator = options.timestep, options.integrator
        session.data = mujoco.MjData(session.model)
    assert swing(one, session, setting, 1.5).decrement == pytest.approx(decrement, rel=3e-3)


def test_tendons_of_implicitfast_slow_a_beam():
    """Why no damper over springs is typed there: a damped tendon between two bodies acts as mass, too."""
    pytest.importorskip("mujoco")
    one, setting = scene(force="0.1 mN"), st.Setting(1e-3, 20)
    damping = st.damping_of(one, decrement=0.03)
    assert list(st.ENGINES["mujoco-implicitfast"].typed_dampers(damping, setting)) == ["joint damping"]
    session = started(one, "mujoco-implicitfast", setting)
    session.model.tendon_damping[: len(damping.dashpots)] = damping.dashpots
    assert swing(one, session, setting, 1.5).period > 1.1 * damping.period


@pytest.mark.parametrize("step", [5e-5, 1e-4])
def test_pybullet(step, tmp_path):
    """`springDampingStiffness` is a dashpot [N s/m]; steps do not damp by themselves. Nodes weigh the same there."""
    program = pytest.importorskip("pybullet")
    one = scene("paper", stiffness="800 N/m")
    net = st.SpringNet.from_scene(one, errors=False)
    equal = np.full(len(net.points), net.masses.mean() / one.springs.reference)
    motion = Motion(one.network, equal, one.forces / one.springs.reference)
    frequency, shape = motion.loaded_mode
    measured = st.damping_of(one, decrement=0.3)
    typed = st.ENGINES["pybullet"].typed_dampers(measured, st.Setting(step))["springDampingStiffness"]
    assert typed == pytest.approx(measured.stiffness_damping * 800)
    path = tmp_path / "net.obj"
    rows = [f"v {x!r} {y!r} 0\n" for x, y in net.points.tolist()]
    path.write_text("".join(rows + [f"f {a} {b} {c}\n" for a, b, c in (net.triangles + 1).tolist()]))
    client = {"physicsClientId": program.connect(program.DIRECT)}
    program.resetSimulation(program.RESET_USE_DEFORMABLE_WORLD, **client)
    program.setTimeStep(step, **client)
    program.setPhysicsEngineParameter(numSubSteps=1, **client)
    program.setGravity(0, -0.2, 0, **client)
    springs = {"springElasticStiffness": 800, "springBendingStiffness": 0, "springDampingStiffness": typed}
    apart = {"springDampingAllDirections": 0, "useSelfCollision": 0, "useFaceContact": 0, "collisionMargin": 1e-6}
    mass = float(net.masses.sum())
    body = program.loadSoftBody(str(path), mass=mass, useMassSpring=1, **springs, **apart, **client)
    program.changeDynamics(body, -1, activationState=program.ACTIVATION_STATE_DISABLE_SLEEPING, **client)
    for node in np.flatnonzero(net.held.all(axis=1)).tolist():
        program.createSoftBodyAnchor(body, node, -1, -1, **client)
    seen = []
    for number in range(int(1.5 * 2 * np.pi / frequency / step)):
        places = program.getMeshData(body, -1, flags=program.MESH_DATA_SIMULATION_MESH, **client)[1]
        moved = np.array(places)[:, :2] - net.points
        seen.append((number * step, (motion.mass * shape) @ one.network.reduce(moved)))
        program.stepSimulation(**client)
    program.disconnect(**client)
    found = st.fit_decay(*np.array(seen).T)
    ratio = measured.stiffness_damping * frequency / 2
    assert found.period == pytest.approx(2 * np.pi / frequency / np.sqrt(1 - ratio**2), rel=1e-3)
    assert found.decrement == pytest.approx(2 * np.pi * ratio / np.sqrt(1 - ratio**2), rel=2e-3)
