"""Nothing is `solved` behind a snap: shallow arches and trusses beyond their limit load, and right ones next to it."""

import numpy as np
import pytest

import springtune as st
from arches import Arch, draw, limit
from springtune.mechanics.continuation import follow
from springtune.mechanics.dynamics import relax

from problems import pulled
from tables import cases

ARCHES = draw()


def statuses(arch, shares):
    """Status and message at shares of the load at which the path loses its stability, and how it does."""
    problem = arch.problem()
    load, how = limit(problem)
    return {share: problem.judge(share * load, problem.nonlinear(share * load))[:2] for share in shares}, how


def check(arch, shares):
    found, how = statuses(arch, shares)
    for share, (status, message) in found.items():
        if share < 1:
            assert (status, message) == (st.Status.SOLVED, ""), (arch, share)
        else:
            assert status in (st.Status.UNSTABLE, st.Status.NOT_CONVERGED) and message, (arch, share)
            if how == "limit point" and "turns back" in message:
                said = float(message.split("unstable at ")[1].split(" %")[0])
                assert said == pytest.approx(100 / share, rel=0.01), (arch, share)


@pytest.mark.parametrize(
    "arch",
    [arch for arch in ARCHES[::9] if arch.load != "follower-pressure"],
    ids=lambda arch: f"{arch.form}-{arch.ends}-{arch.load}-{arch.definition}",
)
def test_an_arch_beyond_its_limit_load_is_not_solved(arch):
    check(arch, (0.9, 1.05, 5.0))


@pytest.mark.slow
@pytest.mark.parametrize("arch", ARCHES, ids=lambda arch: f"{arch.form}-{arch.ends}-{arch.load}-{arch.definition}")
def test_no_arch_beyond_its_limit_load_is_solved(arch):
    check(arch, (0.9, 1.05, 1.5, 2.5, 5.0))


def sine_arch(sides=40, rise=0.03, strip=0.01):
    """Sine arch of span 1 m as a shape of straight sides, clamped at both ends."""
    x = np.linspace(0.0, 1.0, sides + 1)
    y = rise * np.sin(np.pi * x)
    lower = [st.Segment((a, b), group="lower") for a, b in zip(x[:-1], y[:-1], strict=True)]
    upper = [st.Segment((a, b + strip), group="upper") for a, b in zip(x[:0:-1], y[:0:-1], strict=True)]
    return st.Shape(
        "arch",
        "10 mm",
        [*lower, st.Segment((1.0, 0.0), group="right"), *upper, st.Segment((0.0, strip), group="left")],
        points={"crown": (0.5, rise + strip)},
        loads={
            "push": st.LoadCase(
                "push",
                [st.Support("left", x=0, y=0), st.Support("right", x=0, y=0)],
                [st.Traction("crown", (0, "-1 N"))],
                quantities=[st.Quantity("crown", "displacement", "crown", "y")],
            )
        },
    )


@pytest.fixture(scope="module")
def pushed():
    shape = sine_arch()
    mesh = st.mesh_shape(shape, "5 mm")
    material = st.Material("1 MPa", 1 / 3, name="soft")
    return lambda force: st.Scene(shape, mesh, material, "push", definition="lattice", scale=force).solve()


def test_a_shape_that_snaps_is_unstable_and_says_where(pushed):
    """It carries some 6 mN; 10 mN it carries 52 mm below, behind the snap."""
    below, beyond = pushed(5e-3), pushed(10e-3)
    assert below.status is st.Status.SOLVED and -15e-3 < below.values["crown"] < -5e-3
    assert beyond.status is st.Status.UNSTABLE and "limit point: the path from rest turns back" in beyond.message
    assert "after a snap the body reaches a stable equilibrium that carries the load" in beyond.message
    assert 5.5e-3 < 1e-4 * float(beyond.message.split("unstable at ")[1].split(" %")[0]) < 6.5e-3
    assert np.isnan(beyond.displacement)


@pytest.mark.parametrize("definition", ["patch", "lattice", "area"])
@cases
def test_one_event_has_one_status(definition, size, status, says):
    """A quarter of a strip with a hole, stretched to twice its length: cells at the hole collapse."""
    hole = st.Shape(
        "hole", "1 mm",
        [st.Segment((0.01, 0), group="lower"), st.Segment((0.1, 0), group="right"), st.Segment((0.1, 0.05)),
         st.Segment((0, 0.05), group="left"), st.Segment((0, 0.01), (0, 0))],
        loads={"pull": pulled("50 N", 0, supports=[st.Support("lower", y=0), st.Support("left", x=0)])},
    )  # fmt: skip
    result = st.Scene(
        hole, st.mesh_shape(hole, size), st.Material("1 MPa", 1 / 3), "pull", definition=definition
    ).solve()
    assert result.status is status and says in result.message


@pytest.mark.parametrize("share, says", [(0.8, ""), (3.0, "limit point: the path from rest turns back")])
def test_a_motion_that_snaps_says_so_where_it_comes_to_rest(share, says):
    arch = Arch("parabola", "clamped", "point", "patch", 2.8)
    problem = arch.problem()
    load = share * limit(problem)[0]
    run = relax(problem.network, load * problem.network.expand(problem.load))
    assert run.status == "rest" and (says in run.message if says else run.message == "")
    assert ("at rest where a load that grows slowly does not lead" in run.message) == bool(says)


@pytest.mark.parametrize("definition", ["uniform", "neo-hooke", "delingette"])
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_an_arch_that_only_softens_is_solved(definition, share):
    """So low that its path does not turn back, though the straight way from rest is unstable in its middle."""
    problem = Arch("truss", "mixed", "point", definition, 1.1).problem()
    guess = 0.02 / np.abs(problem.slope).max()
    path = follow(problem, 3 * guess, increment=float(np.linalg.norm(guess * problem.slope)) / 20)
    assert not path.negative_pivots.any() and (np.diff(path.loads) > 0).all() and not path.message
    place = int(share * (len(path.loads) - 1))
    found = problem.nonlinear(path.loads[place])
    assert problem.judge(path.loads[place], found)[:2] == (st.Status.SOLVED, "")
    assert np.abs(found.displacements - path.displacements[place]).max() <= 1e-6 * np.abs(found.displacements).max()
