"""Dampers that are typed into Newton and MuJoCo give a beam the decay that was measured."""

import re

import numpy as np
import pytest

import springtune as st
from swings import fit_swing

from tables import cases

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
    return fit_swing(*np.array(seen).T)


def started(one, name, setting):
    """Session of an engine without dampers."""
    return st.ENGINES[name].start(st.SpringNet.from_scene(one, errors=False), setting, 0.0)


def dampers(one, decrement, step=0.0):
    """Alpha [1/s] or beta [s], each alone, beside what steps of implicit Euler damp."""
    ratio, frequency = decrement / np.hypot(2 * np.pi, decrement), one.motion().loaded_frequency
    share = 1 - step * frequency / (2 * ratio)
    return 2 * share * ratio * frequency, 2 * share * ratio / frequency


def stiffness(one):
    """Of its springs [N/m]."""
    return st.SpringNet.from_scene(one, errors=False).stiffness


NEWTON = {"newton-xpbd": (0.1, st.Setting(1e-3, 5, 20), 0.01), "newton-vbd": (0.3, st.Setting(1e-3, 5, 60), 0.01)}
"""Decrement, setting and tolerance."""


@pytest.mark.parametrize("name", ["newton-xpbd", pytest.param("newton-vbd", marks=pytest.mark.slow)])
def test_springs_of_newton(name):
    """`kd` is a dashpot [N s/m]."""
    pytest.importorskip("newton")
    decrement, setting, tolerance = NEWTON[name]
    one = scene()
    _, beta = dampers(one, decrement, setting.step)
    session = started(one, name, setting)
    session.model.spring_damping.assign((beta * stiffness(one)).astype(np.float32))
    assert swing(one, session, setting, 1.5).decrement == pytest.approx(decrement, rel=tolerance)


@pytest.mark.slow
def test_triangles_of_newton_vbd():
    """`tri_kd`, beta mu t / 2, damps shear as beta does, and a strip by (1 + nu^2) / (1 + nu) of it."""
    pytest.importorskip("newton")
    one, setting = scene("delingette"), st.Setting(1e-3, 5, 60)
    session = started(one, "newton-vbd", setting)
    _, beta = dampers(one, 0.3, setting.step)
    materials = session.model.tri_materials.numpy()
    materials[:, 2] = beta * materials[:, 0] / 2 * 1.3 / 1.09
    session.model.tri_materials.assign(materials)
    assert swing(one, session, setting, 1.5).decrement == pytest.approx(0.3, rel=0.02)


SHORT = st.Setting(1e-3, 25)
"""Steps that stay stable with dampers over stiffness that are explicit."""


@cases
def test_mujoco(name, damper, tmp_path):
    """Also of what steps of `discrete` damp by themselves, as implicit Euler does."""
    mujoco = pytest.importorskip("mujoco")
    one = scene("delingette" if damper == "flex damping" else "patch", "0.1 mN")
    decrement, setting = (0.3, st.Setting(1e-3, 20)) if "joint" in damper or "discrete" in name else (0.03, SHORT)
    alpha, beta = dampers(one, decrement, setting.step if "discrete" in name else 0.0)
    session = started(one, name, setting)
    if damper == "joint damping":
        session.model.dof_damping[:] = np.repeat(alpha * one.boundary_problem.masses()[:, None], 2, axis=1)[~one.held]
    if damper == "tendon damping":
        session.model.tendon_damping[: len(stiffness(one))] = beta * stiffness(one)
    if damper == "flex damping":  # it is compiled into a model
        [path] = one.springs.write(tmp_path / "net.xml", errors=False)
        text = re.sub(' damping="[^"]*"', "", path.read_text())
        options = session.model.opt
        session.model = mujoco.MjModel.from_xml_string(text.replace("<elasticity ", f'<elasticity damping="{beta}" '))
        session.model.opt.timestep, session.model.opt.integrator = options.timestep, options.integrator
        session.data = mujoco.MjData(session.model)
    assert swing(one, session, setting, 1.5).decrement == pytest.approx(decrement, rel=3e-3)


def test_tendons_of_implicitfast_slow_a_beam():
    """Why no damper over springs is typed there: a damped tendon between two bodies acts as mass, too."""
    pytest.importorskip("mujoco")
    one, setting = scene(force="0.1 mN"), st.Setting(1e-3, 20)
    _, beta = dampers(one, 0.03)
    session = started(one, "mujoco-implicitfast", setting)
    session.model.tendon_damping[: len(stiffness(one))] = beta * stiffness(one)
    assert swing(one, session, setting, 1.5).period > 1.1 * 2 * np.pi / one.motion().loaded_frequency
