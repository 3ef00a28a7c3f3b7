"""MuJoCo as an engine: where it comes to rest, what it refuses, and what diverges."""

from importlib import metadata

import mujoco
import numpy as np
import pytest

import springtune as st
from springtune.engines.base import EngineAbsentError, version_numbers
from springtune.handover.mujoco import elasticity

from engine_scenes import TEN, scene

RELEASE = version_numbers(mujoco.__version__)
EXPLICIT = ("mujoco-euler", "mujoco-implicitfast", "mujoco-rk4")
STRIP = next(case for case in TEN if case[0] == "strip" and case[2] == "bending")

discrete = pytest.mark.skipif(RELEASE < (3, 13), reason="MuJoCo has no integrator 'discrete' before 3.13")


def ended(case, definition, engine):
    """A scene in an engine, in stable steps."""
    one = scene(*case, definition)
    if one.springs.energies and RELEASE < (4,):
        pytest.skip("a flex needs MuJoCo 4")
    if engine == "mujoco-discrete":
        substeps = np.ceil(50 * one.motion().loaded_frequency / 2 / np.pi / 60)
    else:
        share = 0.9 if definition == "patch" else 0.6  # squared lengths stiffen
        substeps = np.ceil(1 / 60 / one.motion().step_limit("symplectic-euler") / share)
    return st.in_engine(one, engine, dt="1/60", substeps=int(substeps), iterations=100)


@pytest.mark.parametrize("case", TEN, ids="-".join)
@pytest.mark.parametrize("engine", ["mujoco-euler", pytest.param("mujoco-discrete", marks=discrete)])
@pytest.mark.parametrize("definition", ["patch", "delingette"])
def test_it_rests_in_our_equilibrium(engine, definition, case):
    """Springs as tendons, squared lengths as a flex; the system of `discrete` is left at 1e-4 of the load."""
    found = ended(case, definition, engine)
    assert found.status == "rest", found.message
    assert abs(found.solver_error) < (1e-3 if engine == "mujoco-discrete" else 1e-7)
    assert found.residual < (1e-3 if engine == "mujoco-discrete" else 1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("case", TEN, ids="-".join)
@pytest.mark.parametrize("engine", EXPLICIT[1:])
def test_it_rests_there_by_the_other_integrators(engine, case):
    assert abs(ended(case, "patch", engine).solver_error) < 1e-7


@pytest.mark.parametrize("engine", EXPLICIT)
def test_steps_beyond_the_stable_one_diverge_and_are_not_put_back(engine, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = st.in_engine(scene(*STRIP, "patch"), engine, dt="1/60", substeps=20)
    assert found.status == "diverged" and "more substeps" in found.message and np.isnan(found.error)
    assert not list(tmp_path.iterdir())  # no log of MuJoCo


@discrete
def test_few_iterations_of_discrete_leave_it_on_its_way():
    options = {"substeps": 8, "frames": 150}
    found = [st.in_engine(scene(*STRIP, "patch"), "mujoco-discrete", iterations=n, **options) for n in (2, 50)]
    assert found[0].status == "moving" and found[1].status == "rest"
    assert abs(found[0].solver_error) > 1e-2 > 100 * abs(found[1].solver_error)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45])
def test_constants_of_a_flex_are_those_of_the_material(nu):
    first, second = 5e6 * 1e-3 * nu / (1 - nu**2), 5e6 * 1e-3 / 2 / (1 + nu)
    assert elasticity(first, second) == pytest.approx((5e3, nu))
    case = ("strip", "free", "traction", "rubber")
    typed = st.ENGINES["mujoco-euler"].typed(st.SpringNet.from_scene(scene(*case, "delingette"), errors=False))
    assert typed == pytest.approx({"young": 1e6, "poisson": 0.45, "thickness": 1e-3})
    assert set(typed) <= set(st.ENGINES["mujoco-euler"].parameters)


def test_an_integrator_that_came_later_is_absent_by_name(monkeypatch):
    monkeypatch.setattr(metadata, "version", lambda name: "3.12.0")
    assert st.ENGINES["mujoco-discrete"].absent.startswith("engine 'mujoco-discrete' needs mujoco>=3.13; install the")
    with pytest.raises(EngineAbsentError, match="needs mujoco>=3.13"):
        st.in_engine(scene(*STRIP, "patch"), "mujoco-discrete")
    assert not st.ENGINES["mujoco-euler"].absent
