"""Newton's solvers: what is typed into each gives the equilibrium of its own law, at settings that converge."""

import numpy as np
import pytest

import springtune as st
from springtune.handover.newton import LAWS, membrane_energies
from springtune.handover.simulation import simulate

from engine_scenes import TEN, scene

pytest.importorskip("newton")

SETTINGS = {"newton-vbd": (1, 10), "newton-xpbd": (0.7, 10)}
"""Step over the largest one of explicit schemes, and iterations, that converge to 1e-3 at the least cost."""

TURNING = ("strip", "structured", "shear", "rubber")
"""In XPBD springs turn by the square of a step: it is 1.1e-3 off in double precision, too, at the setting of others."""

BUCKLING = ("strip", "free", "compression", "foam")
"""At a quarter of its buckling strain: rounding leaves springs of XPBD and VBD trembling there."""

LIMITS = {("newton-xpbd", BUCKLING): 1e-2}
"""Errors where more than 1e-3 is left, by rounding."""

MAPPINGS = [("newton-vbd", "delingette"), ("newton-vbd", "patch"), ("newton-xpbd", "patch")]
QUICK = ("sheet", "structured", "traction", "foam")


def off(engine, definition, case):
    """Largest error of a displacement in an engine, over the largest displacement by its law."""
    *parts, material = case
    one = scene(*parts, material, definition)
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
    exact = simulate(net, "Newton", LAWS, membrane_energies).displacements
    return np.abs(np.mean(found, axis=0) - exact).max() / np.abs(exact).max()


@pytest.mark.parametrize(("engine", "definition"), MAPPINGS)
def test_typed_numbers_give_the_equilibrium_of_the_law(engine, definition):
    assert off(engine, definition, QUICK) < 1e-3


def test_directions_held_singly_have_their_reaction():
    assert off("newton-vbd", "patch", ("sheet", "structured", "shear", "foam")) < 1e-3


def test_steps_that_xpbd_cannot_take_are_said_to_diverge():
    """All springs at once in an iteration: more iterations do not help."""
    one = scene(*QUICK, "patch")
    found = st.in_engine(one, "newton-xpbd", dt="1/60", substeps=10, iterations=50)
    assert found.status == "diverged" and "take more substeps" in found.message


def test_newton_prints_nothing_and_keeps_its_log_level(capfd):
    import warp

    before = warp.config.log_level, warp.ScopedTimer.enabled
    one = scene(*QUICK[:3], "felt", "delingette")
    st.ENGINES["newton-vbd"].start(st.SpringNet.from_scene(one, errors=False), st.Setting(1e-3), 0.0).advance(1)
    assert not capfd.readouterr().out
    assert (warp.config.log_level, warp.ScopedTimer.enabled) == before


@pytest.mark.slow
@pytest.mark.parametrize("case", TEN, ids=" ".join)
@pytest.mark.parametrize(("engine", "definition"), MAPPINGS)
def test_typed_numbers_on_ten_scenes(engine, definition, case):
    assert off(engine, definition, case) < LIMITS.get((engine, case), 1e-3)
