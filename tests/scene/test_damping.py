"""Measured decays: dampers that give them, verified by released beams."""

import re
from functools import cache
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh

import springtune as st
from swings import fit_swing

from tables import cases, slow_but

BEAM, RUBBER = st.Beam("100 mm", "10 mm"), st.Material("1 MPa", 0.45, density="1100 kg/m^3")
DECREMENT = 0.3


@cache
def scene(definition="patch", load="bending", size="5 mm", kinematics="linear", mesh_type="structured", force="0.1 mN"):
    """A soft beam, moved so little that the length law is linear, too."""
    mesh = st.make_mesh(BEAM, mesh_type, size)
    return st.Scene(BEAM, mesh, RUBBER, load, force, definition=definition, kinematics=kinematics)


@cache
def bent(one):
    return one.solve().displacements


@cache
def momenta(one):
    """Network of a scene, and the masses times the shape of its loaded mode."""
    motion = one.motion()
    return motion.network, motion.mass * motion.loaded_mode[1]


def share(one, displacements):
    """Amplitude of the loaded mode."""
    network, momentum = momenta(one)
    return momentum @ network.reduce(displacements)


def swing(one, integrator, step, periods=3, **options):
    """Decay of the loaded mode of a beam that is let go of."""
    motion, seen = one.motion(released=True, **options), []
    steps = round(periods * 2 * np.pi / one.motion().loaded_frequency / step)
    watch = lambda time, u, v: seen.append((time, share(one, u)))  # noqa: E731
    motion.run(integrator, step, steps, bent(one), sample=1, watch=watch)
    return fit_swing(*np.array(seen).T)


def damped(one, decrement=DECREMENT, step=0.0):
    """Dampers that each alone give the loaded mode a decrement, beside what steps of implicit Euler damp."""
    ratio, frequency = decrement / np.hypot(2 * np.pi, decrement), one.motion().loaded_frequency
    share = 1 - step * frequency / (2 * ratio)
    alpha, beta = 2 * share * ratio * frequency, 2 * share * ratio / frequency
    stiffness = one.network.stiffness
    over = {"mass": {"mass_damping": alpha}, "springs": {"dampers": beta * stiffness}}
    over["both"] = {"mass_damping": alpha / 2, "dampers": beta * stiffness / 2}
    period = 2 * np.pi / (frequency * np.sqrt(1 - ratio**2))
    return SimpleNamespace(ratio=ratio, alpha=alpha, beta=beta, over=over, period=period)


# -- our integrators ---------------------------------------------------------------------------------------------------


@cases
def test_a_released_beam_decays_as_was_measured(definition, load, over):
    """The mode is alone where dampers are proportional. With x = omega h the midpoint rule has periods that are longer
    by x^2 / 12, and decrements that are smaller by x^2 / 6.
    """
    one = scene(definition, load)
    damping = damped(one)
    found = swing(one, "implicit-midpoint", damping.period / 100, **damping.over[over])
    square = (2 * np.pi / 100) ** 2
    assert found.period == pytest.approx(damping.period * (1 + square / 12), rel=2e-5)
    assert found.decrement == pytest.approx(DECREMENT * (1 - square / 6), rel=2e-5)


@pytest.mark.parametrize("mesh_type", ["right", "free"])
@pytest.mark.parametrize("load", ["pressure", "bending"])
@pytest.mark.parametrize("definition", ["area", "delingette"])
def test_the_loaded_mode_has_the_largest_share_of_all_modes(mesh_type, load, definition):
    beam = st.Beam("200 mm", "20 mm")
    material = st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    mesh = st.make_mesh(beam, mesh_type, 0.02 / 3)
    motion = st.Scene(beam, mesh, material, load, "1 N", definition=definition).motion()
    frequency, shape = motion.loaded_mode
    squares, modes = eigh(motion.stiffness_matrix.toarray(), np.diag(motion.mass))
    shares = (modes.T @ motion.network.reduce(motion.load)) ** 2 / squares
    assert frequency == pytest.approx(np.sqrt(squares[np.argmax(shares)]), rel=1e-9)
    assert shape @ (motion.mass * shape) == pytest.approx(1)
    inertia = frequency**2 * motion.mass * shape
    assert np.linalg.norm(motion.stiffness_matrix @ shape - inertia) < 1e-6 * np.linalg.norm(inertia)


@pytest.mark.parametrize("count", [20, 100])
def test_implicit_euler_damps_as_a_stiffness_damping_of_its_step(count):
    """Without dampers the ratio is x / 2, x = omega h; the decrement is exactly pi ln(1 + x^2) / atan(x)."""
    one = scene(size="10 mm")
    step = 2 * np.pi / one.motion().loaded_frequency / count
    found = swing(one, "backward-euler", step)
    x = 2 * np.pi / count
    assert found.decrement == pytest.approx(np.pi * np.log1p(x * x) / np.arctan(x), rel=1e-6)
    assert found.decrement == pytest.approx(2 * np.pi * x / 2, rel=x)


@pytest.mark.parametrize("over", ["mass", "springs", "both"])
def test_what_implicit_euler_damps_is_taken_off(over):
    """What is left to type gives the decrement that was measured, but for terms of the ratio times omega h."""
    one = scene(size="10 mm")
    measured = damped(one)
    step = measured.beta / 3
    found = swing(one, "backward-euler", step, 1.5, **damped(one, step=step).over[over])
    x = one.motion().loaded_frequency * step
    assert found.decrement == pytest.approx(DECREMENT, rel=measured.ratio * x + x**2)
    assert swing(one, "backward-euler", step, 1.5, **measured.over[over]).decrement > 1.3 * DECREMENT


# -- engines -----------------------------------------------------------------------------------------------------------


def with_dampers(one, typed, tendons):
    """Model of MuJoCo of a scene, its load let go of, with dampers in joints or tendons in place of its own."""
    [path] = one.springs.write("net.xml", errors=False)
    text = re.sub(r'biasprm="[^"]*"', 'biasprm="0 0 0"', path.read_text())
    text = re.sub(r' damping="[^"]*"', "", text)
    if tendons:
        dampers = iter(typed[st.SpringNet.from_scene(one, errors=False).stiffness != 0])
        text = re.sub("<spatial ", lambda found: f'<spatial damping="{float(next(dampers))!r}" ', text)
    else:
        text = re.sub(
            r'name="([xy])(\d+)"/>', lambda found: f'{found[0][:-2]} damping="{typed[int(found[2])]!r}"/>', text
        )
    return mujoco.MjModel.from_xml_string(text)


@pytest.mark.parametrize("tendons", [False, True])
def test_mujoco_decays_as_was_measured(tendons, tmp_path, monkeypatch):
    """Joints take alpha m, tendons beta k, both in N s/m; Euler's scheme does not damp by itself."""
    monkeypatch.chdir(tmp_path)
    one = scene(size="10 mm", kinematics="nonlinear")
    decrement = 0.03 if tendons else DECREMENT
    damping = damped(one, decrement)
    dashpots = damping.beta * st.SpringNet.from_scene(one, errors=False).stiffness
    typed = dashpots if tendons else (damping.alpha * one.boundary_problem.masses()).tolist()
    model = with_dampers(one, typed, tendons)
    free, data, seen = ~one.held, mujoco.MjData(model), []
    motion = one.motion(**damping.over["springs" if tendons else "mass"])
    model.opt.timestep = 0.5 * motion.step_limit("symplectic-euler")
    data.qpos[:] = bent(one)[free]
    moved = np.zeros(free.shape)
    while data.time < 2 * damping.period:
        moved[free] = data.qpos
        seen.append((data.time, share(one, moved)))
        mujoco.mj_step(model, data, 20)
    found = fit_swing(*np.array(seen).T)
    assert found.period == pytest.approx(damping.period, rel=1e-3)
    assert found.decrement == pytest.approx(decrement, rel=2e-3)


SOON = "xpbd", "projective", "implicit-cg"


@pytest.mark.parametrize("name", slow_but(SOON, (*SOON, "vbd", "vbd-inertia")))
def test_an_implicit_engine_is_given_what_its_steps_lack(name):
    """Iterated to the end it is implicit Euler: it swings with the measured decay about its loaded place."""
    one = scene(size="10 mm", kinematics="nonlinear")
    damping = damped(one)
    setting = st.Setting(damping.period / 250, iterations=40)
    net, typed = st.SpringNet.from_scene(one, errors=False), damped(one, step=setting.step).alpha
    session, place, seen = st.ENGINES[name].start(net, setting, typed), bent(one), []
    for number in range(300):
        seen.append((number * setting.step, share(one, session.displacements() - place)))
        session.advance(1)
    found = fit_swing(*np.array(seen).T)
    assert found.period == pytest.approx(damping.period, rel=1e-3)
    assert found.decrement == pytest.approx(DECREMENT, rel=2e-3)
