"""PyBullet as an engine: uniform springs at rest, rollers, and what one body cannot have."""

import numpy as np
import pytest

import springtune as st

from engine_scenes import TEN, scene

pytest.importorskip("pybullet")

QUICK = [case for case in TEN if case[0] == "sheet"]


def uniform(case):
    """A scene with one stiffness for all springs."""
    one = scene(*case, "patch")
    return st.Scene(one.beam, one.mesh, one.material, one.load, abs(one.statement.force), definition="uniform")


def ended(case):
    """A scene in PyBullet, in stable steps.

    Slender rubber swings on by 4e-7 of its displacement: at rest is what moves by a tenth of the bounds, or less.
    """
    one = uniform(case)
    substeps = np.ceil(1 / 60 / one.motion().step_limit("symplectic-euler") / 0.8)
    return st.in_engine(one, "pybullet", dt="1/60", substeps=int(substeps), tolerance=1e-6)


@pytest.mark.parametrize("case", QUICK, ids="-".join)
def test_it_rests_in_our_equilibrium(case):
    """Traction, bending, compression; and shear, whose sides are rollers."""
    found = ended(case)
    assert found.status == "rest" and abs(found.solver_error) < 1e-5 and found.residual < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("case", TEN, ids="-".join)
def test_it_rests_in_our_equilibrium_in_all_cases(case):
    found = ended(case)
    assert found.status == "rest" and abs(found.solver_error) < 1e-3 and found.residual < 5e-3


def test_squares_with_both_diagonals():
    beam, rubber = st.Beam("80 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    mesh = st.make_mesh(beam, "braced", "20 mm")
    one = st.Scene(beam, mesh, rubber, "traction", "0.4 N", definition="paper", stiffness="500 N/m")
    found = st.in_engine(one, "pybullet", substeps=40)
    assert found.status == "rest" and abs(found.solver_error) < 1e-5


def test_steps_beyond_the_stable_one_diverge():
    assert st.in_engine(uniform(QUICK[0]), "pybullet", substeps=4).status == "diverged"


def test_several_stiffnesses_are_refused():
    with pytest.raises(st.EngineError, match="'patch': has springs of .* one stiffness for all .*; take 'uniform', or"):
        st.in_engine(scene(*QUICK[0], "patch"), "pybullet")
