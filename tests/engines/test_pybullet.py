"""PyBullet as an engine: uniform springs at rest, rollers, and what one body cannot have."""

import numpy as np
import pytest

import springtune as st

from engine_scenes import TEN, scene

pybullet = pytest.importorskip("pybullet")

QUICK = [case for case in TEN if case[0] == "sheet"]


def uniform(case):
    """A scene with one stiffness for all springs."""
    one = scene(*case, "patch")
    return st.Scene(one.beam, one.mesh, one.material, one.load, abs(one.statement.force), definition="uniform")


def ended(case):
    """A scene in PyBullet, in stable steps."""
    one = uniform(case)
    substeps = np.ceil(1 / 60 / one.motion().step_limit("symplectic-euler") / 0.8)
    return st.in_engine(one, "pybullet", dt="1/60", substeps=int(substeps))


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


def test_dampers_are_beta_times_stiffness(tmp_path):
    """A clamped beam that falls into its own weight swings with the decrement of the dampers that are typed."""
    beam, rubber = st.Beam("100 mm", "10 mm"), st.Material("1 MPa", 0.45, density="1100 kg/m^3")
    mesh = st.make_mesh(beam, "structured", "5 mm")
    one = st.Scene(beam, mesh, rubber, "bending", "0.1 mN", definition="uniform", kinematics="linear")
    measured = st.damping_of(one, decrement=0.3)
    dampers = st.ENGINES["pybullet"].typed_dampers(measured, st.Setting())["springDampingStiffness"]
    lines = [f"v {x} {y} 0" for x, y in mesh.points] + [f"f {a} {b} {c}" for a, b, c in mesh.triangles + 1]
    (tmp_path / "beam.obj").write_text("\n".join(lines))
    client, step = pybullet.connect(pybullet.DIRECT), 0.5 * one.motion().step_limit("symplectic-euler")
    pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD)
    pybullet.setTimeStep(step)
    springs = {"springElasticStiffness": one.springs.reference, "springDampingStiffness": dampers.mean()}
    springs |= {"springBendingStiffness": 0.0, "springDampingAllDirections": 0, "useMassSpring": 1, "useNeoHookean": 0}
    mass = one.statement.masses().sum()
    body = pybullet.loadSoftBody(str(tmp_path / "beam.obj"), mass=mass, collisionMargin=1e-6, **springs)
    for node in np.flatnonzero(one.held.all(axis=1)).tolist():
        pybullet.createSoftBodyAnchor(body, node, -1, -1)
    pybullet.setGravity(0, -1, 0)
    seen = []
    for _ in range(300):
        places = np.array(pybullet.getMeshData(body, -1, flags=pybullet.MESH_DATA_SIMULATION_MESH)[1])
        seen.append(places[np.argmax(mesh.points[:, 0]), 1])
        for _ in range(30):
            pybullet.stepSimulation()
    pybullet.disconnect(client)
    found = st.fit_decay(30 * step * np.arange(300), np.array(seen))
    # All nodes have the same mass, so it swings more slowly.
    assert found.decrement == pytest.approx(0.3 * measured.period / found.period, rel=0.02)
