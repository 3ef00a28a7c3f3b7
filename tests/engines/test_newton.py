"""Newton's solvers: what is typed into each gives the equilibrium of its own law, at settings that converge."""

import numpy as np
import pytest

import springtune as st
from springtune.handover.newton import LAWS, membrane_energies
from springtune.handover.simulation import simulate

from engine_scenes import TEN, scene

pytest.importorskip("newton")

SETTINGS = {
    "newton-semi-implicit": (0.7, 1),
    "newton-style3d": (4, 20),
    "newton-vbd": (1, 10),
    "newton-xpbd": (0.7, 10),
}
"""Step over the largest one of explicit schemes, and iterations, that converge to 1e-3 at the least cost."""

TURNING = ("strip", "structured", "shear", "rubber")
"""In XPBD springs turn by the square of a step: it is 1.1e-3 off in double precision, too, at the setting of others."""

BUCKLING = ("strip", "free", "compression", "foam")
"""At a quarter of its buckling strain: rounding leaves springs of XPBD and VBD trembling there."""

SLENDER = ("slender", "free", "bending", "rubber")

LIMITS = {("newton-xpbd", BUCKLING): 1e-2, ("newton-style3d", SLENDER): 3e-3}
"""Errors where more than 1e-3 is left.

XPBD: rounding. Style3D: 1.9e-3 at 4 x 20, 8 x 60 and 10 x 40 alike.
"""

MAPPINGS = [(name, "delingette") for name in SETTINGS if name != "newton-xpbd"]
MAPPINGS += [(name, "patch") for name in SETTINGS if name != "newton-style3d"]
QUICK = ("sheet", "structured", "traction", "foam")


def style3d_forces(net, moved):
    """Forces on particles by Style3D's law: along, across and in shear."""
    (terms,) = net.energies
    along, across, shear = st.ENGINES["newton-style3d"].typed(net)["tri_aniso_ke"]
    edges = np.diff(net.points[terms.cells], axis=1)
    rest = np.stack([edges[:, 0], edges.sum(axis=1)], axis=2)
    now = (net.points + moved)[terms.cells]
    f = np.stack([now[:, 1] - now[:, 0], now[:, 2] - now[:, 0]], axis=2) @ np.linalg.inv(rest)
    length = np.linalg.norm(f, axis=1, keepdims=True)
    unit = f / length
    cosine = np.sum(unit[..., 0] * unit[..., 1], axis=1)[:, None, None]
    stress = unit * (length - 1) * [along, across] + shear * cosine * unit[..., ::-1]
    areas = 0.5 * np.linalg.det(rest)[:, None, None]
    pulls = -areas * stress @ np.swapaxes(np.linalg.inv(rest), 1, 2)
    forces = np.zeros_like(net.points)
    for corner, pull in ((1, pulls[..., 0]), (2, pulls[..., 1]), (0, -pulls.sum(axis=2))):
        np.add.at(forces, terms.cells[:, corner], pull)
    return forces


def style3d_equilibrium(net, guess):
    """Displacements in which forces of Style3D's law balance the load."""
    free, size = ~net.held, np.abs(guess).max()
    moved = guess.copy()

    def unbalanced(values):
        moved[free] = values
        return (style3d_forces(net, moved) + net.forces)[free]

    values, steps = guess[free], 1e-3 * size * np.eye(int(free.sum()))
    for _ in range(10):
        slopes = [(unbalanced(values + step) - unbalanced(values - step)) / (2e-3 * size) for step in steps]
        change = np.linalg.solve(np.transpose(slopes), unbalanced(values))
        values = values - change
    assert np.abs(change).max() < 1e-8 * size
    unbalanced(values)
    return moved


def equilibrium(one, engine):
    """Displacements at rest by the law that an engine has for a scene."""
    net = st.SpringNet.from_scene(one, errors=False)
    if engine == "newton-style3d":
        return style3d_equilibrium(net, one.solve().displacements)
    return simulate(net, "Newton", LAWS, membrane_energies).displacements


def off(engine, definition, case):
    """Largest error of a displacement in an engine, over the largest displacement by its law."""
    *parts, material = case
    one = scene(*parts, "felt" if engine == "newton-style3d" else material, definition)
    share, iterations = (0.5, 20) if (engine, case) == ("newton-xpbd", TURNING) else SETTINGS[engine]
    net = st.SpringNet.from_scene(one, errors=False)
    rest = simulate(net, "Newton", LAWS)
    frequency, periods = rest.frequency, 2.5  # of the slowest mode: its critical damping brings all to rest
    ratio, mean = 1.0, 0.0  # damping over the critical one, and the share of frames that a mean is of
    if (engine, definition, case) == ("newton-vbd", "patch", BUCKLING):
        share, iterations, periods, ratio, mean = 1.5, 20, 8.0, 0.1, 0.7
    elif engine == "newton-vbd" and rest.loaded_frequency > 4 * rest.frequency and "compression" not in case:
        frequency, periods = rest.loaded_frequency, 5.0  # slower modes hardly move
    dt = share * rest.largest_step
    frames = max(200, round(periods * 2 * np.pi / frequency / dt))  # reactions of single directions take steps
    session = st.ENGINES[engine].start(net, st.Setting(dt, iterations=iterations), ratio * 2 * frequency)
    session.advance(round((1 - mean) * frames))
    found = [session.displacements()]
    for _ in range(round(mean * frames)):
        session.advance(1)
        found.append(session.displacements())
    exact = equilibrium(one, engine)
    return np.abs(np.mean(found, axis=0) - exact).max() / np.abs(exact).max()


@pytest.mark.parametrize(("engine", "definition"), MAPPINGS)
def test_typed_numbers_give_the_equilibrium_of_the_law(engine, definition):
    assert off(engine, definition, QUICK) < 1e-3


@pytest.mark.parametrize("engine", ["newton-semi-implicit", "newton-vbd"])
def test_directions_held_singly_have_their_reaction(engine):
    assert off(engine, "patch", ("sheet", "structured", "shear", "foam")) < 1e-3


def test_steps_that_xpbd_cannot_take_are_said_to_diverge():
    """All springs at once in an iteration: more iterations do not help."""
    one = scene(*QUICK, "patch")
    found = st.in_engine(one, "newton-xpbd", dt="1/60", substeps=10, iterations=50)
    assert found.status == "diverged" and "take more substeps" in found.message


def test_newton_prints_nothing_and_keeps_its_log_level(capfd):
    import warp

    before = warp.config.log_level, warp.ScopedTimer.enabled
    one = scene(*QUICK[:3], "felt", "delingette")
    st.ENGINES["newton-style3d"].start(st.SpringNet.from_scene(one, errors=False), st.Setting(1e-3), 0.0).advance(1)
    assert not capfd.readouterr().out
    assert (warp.config.log_level, warp.ScopedTimer.enabled) == before


@pytest.mark.slow
@pytest.mark.parametrize("case", TEN, ids=" ".join)
@pytest.mark.parametrize(("engine", "definition"), MAPPINGS)
def test_typed_numbers_on_ten_scenes(engine, definition, case):
    assert off(engine, definition, case) < LIMITS.get((engine, case), 1e-3)
