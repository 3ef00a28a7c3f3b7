"""Textbook solvers: what they rest in, by closed forms; and how a run tells where a session ends."""

import dataclasses

import numpy as np
import pytest
import test_xpbd as of_energies
from scipy.linalg import expm

import springtune as st
from springtune.engines import pbd, run
from springtune.handover.simulation import network_of

from engine_scenes import CASES, TEN, scene
from tables import cases, slow_but

OURS = ("pbd", "projective", "vbd", "vbd-inertia", "implicit-cg")
SHEET = ("sheet", "structured", "traction", "foam")
BENT = ("sheet", "structured", "bending", "rubber")
QUICK = [case for case in CASES if case[0] == "sheet" and case[2] == "shear"]


def some(cases, quick=QUICK):
    """Parameters of a test, slow ones but for a few."""
    return [pytest.param(one, id="-".join(one), marks=() if one in quick else pytest.mark.slow) for one in cases]


def substeps_for(one, share):
    """Substeps of a frame of 1/60 s so that the largest k h^2 / m of a scene is below a share."""
    net = run.net_of(one)
    lightest = net.masses[~net.held.all(axis=1)].min()
    return int(np.ceil(np.sqrt(net.stiffness.max() / lightest / share) / 60))


def damping_of(one, case):
    """Damping that brings a scene to rest soon: on a free mesh a pull bends it, too, and that must not creep."""
    return one.motion().critical_damping if case[1] == "free" and case[2] in ("traction", "compression") else None


def relative(found):
    """Solver error over the network's own displacement."""
    return found.displacement / found.exact - 1


# -- many iterations ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", some(CASES))
@cases
def test_many_iterations_end_in_our_equilibrium(engine, share, iterations, case):
    """Relative error below 1e-6; the stiffest spring has `share` times the inertia of a step."""
    one = scene(*case, "patch")
    setting = st.Setting("1/60", substeps_for(one, share), iterations)
    found = st.in_engine(one, engine, setting, tolerance=1e-8, damping=damping_of(one, case))
    assert found.status == "rest", found.message
    assert abs(relative(found)) < 1e-6 and found.residual < 1e-6


@pytest.mark.parametrize("case", some(CASES))
def test_xpbd_ends_there_as_substeps_grow(case):
    """In XPBD pulls keep directions of the step's way, so that more iterations do not do; see the next test."""
    one = scene(*case, "patch")
    substeps = substeps_for(one, 0.003 if case[2] in ("traction", "compression") else 0.0005)
    setting = st.Setting("1/60", substeps, iterations=4)
    found = st.in_engine(one, "xpbd", setting, tolerance=1e-8, damping=damping_of(one, case))
    assert found.status == "rest", found.message
    assert abs(relative(found)) < 1e-6


def test_xpbd_is_left_with_the_turn_of_springs_in_a_step():
    """They turn by h^2 f / (m l): the error of many iterations falls with the square of the step, and with the load."""
    one = scene(*BENT, "patch")
    small = st.Scene(one.beam, one.mesh, one.material, one.load, one.force / 10, definition="patch")
    settings = ((one, 20, 100), (one, 20, 50), (one, 40, 50), (small, 20, 100))
    errors = [
        relative(st.in_engine(each, "xpbd", dt="1/60", substeps=substeps, iterations=iterations, tolerance=1e-8))
        for each, substeps, iterations in settings
    ]
    assert errors[0] == pytest.approx(-6.4e-5, rel=0.1) and errors[1] == pytest.approx(errors[0], rel=0.01)
    assert errors[0] / errors[2] == pytest.approx(4, rel=0.15) and errors[0] / errors[3] == pytest.approx(10, rel=0.15)


# -- few iterations -------------------------------------------------------------------------------------------------


def tiny(load="bending", share=1e-6):
    """A few particles under a load so small that all is linear; with net, mass, stiffness and directions of springs."""
    beam = st.Beam("40 mm", "20 mm")
    mesh = st.make_mesh(beam, "structured", "12 mm")
    rubber = st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    trial = st.Scene(beam, mesh, rubber, load, 1.0, definition="patch", kinematics="linear")
    force = share * beam.length / abs(trial.solve().displacement)
    one = st.Scene(beam, mesh, rubber, load, force, definition="patch")
    net = run.net_of(one)
    free = ~net.held.ravel()
    along = (net.points[net.springs[:, 1]] - net.points[net.springs[:, 0]]) / net.rest_lengths[:, None]
    slopes = np.zeros((len(net.springs), len(net.points), 2))
    for slope, (i, j), normal in zip(slopes, net.springs, along):
        slope[i], slope[j] = -normal, normal
    return one, net, np.repeat(net.masses, 2)[free], slopes.reshape(len(slopes), -1)[:, free], free


def step_matrix(engine, net, mass, slopes, free, h, n):
    """Matrix T of a linear step: x = T y, with y the inertial position."""
    stiff = np.diag(net.stiffness)
    inertia, tangent, one = np.diag(mass / h**2), slopes.T @ stiff @ slopes, np.eye(len(mass))
    system = inertia + tangent
    answer = np.linalg.solve(system, inertia)
    if engine == "xpbd":
        dual = slopes @ np.diag(1 / mass) @ slopes.T + np.diag(1 / net.stiffness / h**2)
        once = np.eye(len(dual)) - np.linalg.solve(np.tril(dual), dual)
        pulls = (np.eye(len(dual)) - np.linalg.matrix_power(once, n)) @ np.linalg.solve(dual, slopes)
        return one - slopes.T / mass[:, None] @ pulls
    if engine == "pbd":
        whole = one
        for share, slope in zip(pbd.shares(net, st.Setting(h, iterations=n)), slopes):
            if weight := slope**2 @ (1 / mass):
                whole = (one - share / weight * np.outer(slope / mass, slope)) @ whole
        return np.linalg.matrix_power(whole, n)
    if engine == "projective":
        links = np.zeros((len(net.points), len(net.points)))
        for (i, j), k in zip(net.springs, net.stiffness):
            links[[i, j], [i, j]] += k
            links[[i, j], [j, i]] -= k
        taken = inertia + np.kron(links, np.eye(2))[np.ix_(free, free)]
    else:  # all before a particle, and its own block
        places = np.flatnonzero(free) // 2
        taken = np.where(places[:, None] >= places, system, 0)
    power = np.linalg.matrix_power(one - np.linalg.solve(taken, system), n)
    return answer + power @ (one - answer)


@pytest.mark.parametrize("iterations", [1, 4])
@pytest.mark.parametrize("engine", ["xpbd", "pbd", "projective", "vbd-inertia"])
def test_it_rests_where_its_iterations_leave_it(engine, iterations):
    """A step falls back by what the load moves it: u = T (u + h^2 f / m), with T by linear algebra."""
    one, net, mass, slopes, free = tiny()
    h = 2e-3
    step = step_matrix(engine, net, mass, slopes, free, h, iterations)
    push = h**2 * net.forces.ravel()[free] / mass
    expected = np.zeros(free.size)
    expected[free] = np.linalg.solve(np.eye(len(step)) - step, step @ push)
    found = st.in_engine(one, engine, dt=h, iterations=iterations, tolerance=1e-9, frames=20000)
    assert found.status == "rest", found.message
    size = np.abs(expected).max()
    assert np.abs(found.displacements - expected.reshape(-1, 2)).max() < 1e-4 * size
    assert size > 1.05 * np.abs(found.network.displacements).max()  # there is an error to be found


@cases
def test_rate_in_the_step(engine, h, rates):
    """In short steps an iteration leaves a share of k h^2 / m of the way, n of them its n-th power.

    So the error falls as h^2n. That of position-based dynamics falls as h^2, since its own limit is off by that.
    """
    one, *_ = tiny("traction")
    for iterations, rate in zip((1, 2), rates):
        setting = {"iterations": iterations, "tolerance": 1e-10, "frames": 20000}
        errors = [relative(st.in_engine(one, engine, dt=step, **setting)) for step in (h, h / 2)]
        assert np.log2(abs(errors[0] / errors[1])) == pytest.approx(rate, abs=0.15)


@pytest.mark.parametrize("engine", ["xpbd", "vbd-inertia"])
def test_small_steps_are_better_than_iterations(engine):
    """Macklin 2019. In long steps a few iterations leave a share of h^2 f / m: the step counts by its square."""
    one, *_ = tiny("traction")
    settings = [(1, 1), (2, 1), (1, 2), (4, 1), (1, 4)]
    found = {
        (substeps, n): relative(st.in_engine(one, engine, dt="1/60", substeps=substeps, iterations=n, frames=20000))
        for substeps, n in settings
    }
    for more in (2, 4):
        assert found[1, 1] / found[more, 1] == pytest.approx(more**2, rel=0.01)
        assert more < found[1, 1] / found[1, more] < 0.75 * more**2


def test_position_based_dynamics_tend_to_a_limit_of_their_own():
    """(exp(A) - 1) u = h^2 f / m as iterations grow, A of springs of ln(1 + k w h^2) / w over the masses."""
    one, net, mass, slopes, free = tiny()
    h = 2e-3
    weights = slopes**2 @ (1 / mass)
    moving = weights > 0
    springs = np.log1p(net.stiffness * weights * h**2)[moving] / weights[moving]
    flow = (slopes[moving].T * springs) @ slopes[moving] / mass[:, None]
    expected = np.zeros(free.size)
    expected[free] = np.linalg.solve(expm(flow) - np.eye(len(flow)), h**2 * net.forces.ravel()[free] / mass)
    off = []
    for iterations in (50, 100):
        found = st.in_engine(one, "pbd", dt=h, iterations=iterations, tolerance=1e-9, frames=20000)
        off.append(np.abs(found.displacements.ravel() - expected).max() / np.abs(expected).max())
    assert off[1] < 0.01 and off[0] / off[1] == pytest.approx(2, rel=0.1)  # of first order in 1 / n
    assert abs(relative(found)) > 0.05


def one_spring(stiffness=30.0, mass=0.02, force=0.6):
    """A particle on a spring."""
    net = run.net_of(tiny()[0])
    held = np.array([[True, True], [False, True]])
    parts = {"points": np.array([[0.0, 0.0], [0.1, 0.0]]), "springs": np.array([[0, 1]])}
    parts["rest_lengths"] = np.array([0.1])
    loads = {"masses": np.full(2, mass), "held": held, "forces": np.array([[0.0, 0.0], [force, 0.0]])}
    return dataclasses.replace(net, stiffness=np.array([stiffness]), energies=(), **parts, **loads)


@pytest.mark.parametrize("engine", ["pbd", "xpbd", "projective", "vbd", "vbd-inertia"])
@pytest.mark.parametrize(("h", "iterations"), [(0.01, 1), (0.1, 3)])
def test_one_spring_is_exact_at_any_setting(engine, h, iterations):
    session = st.ENGINES[engine].start(one_spring(), st.Setting(h, iterations=iterations), damping=30.0)
    session.advance(3000)
    assert session.displacements()[1] == pytest.approx([0.02, 0], rel=1e-9)


@pytest.mark.parametrize(("share", "iterations"), [(0.3, 1), (0.3, 4), (0.9, 2)])
def test_stiffness_that_a_share_means(share, iterations):
    """((1 - s)^-n - 1) / (w h^2): the same share is any stiffness, and a rod in the end."""
    net, h = one_spring(), 0.01
    setting = st.Setting(h, iterations=iterations)
    session = st.ENGINES["pbd"].start(net, setting, damping=30.0)
    session.shares[:] = share
    session.advance(5000)
    meant = ((1 - share) ** -iterations - 1) * net.masses[1] / h**2
    assert session.displacements()[1, 0] == pytest.approx(net.forces[1, 0] / meant, rel=1e-9)
    typed = st.ENGINES["pbd"].numbers(
        dataclasses.replace(net, stiffness=np.array([meant])), st.Setting(h, iterations=iterations)
    )
    assert typed["stiffness"] == pytest.approx([share])


@pytest.mark.parametrize(("engine", "iterations"), [("vbd", 1), ("vbd", 3), ("implicit-cg", 3), ("implicit-cg", 8)])
def test_some_rest_in_our_equilibrium_with_few_iterations(engine, iterations):
    """Since they begin a step where the last one ended, and move while a force is left."""
    found = st.in_engine(scene(*SHEET, "patch"), engine, dt="1/60", substeps=4, iterations=iterations, frames=6000)
    assert found.status == "rest" and abs(relative(found)) < 1e-6
    other = st.in_engine(
        scene(*SHEET, "patch"), "vbd-inertia", dt="1/60", substeps=4, iterations=iterations, frames=6000
    )
    assert relative(other) > 1


@pytest.mark.parametrize("engine", ["projective", "vbd-inertia"])
def test_each_iteration_lowers_the_energy_of_a_step(engine):
    """By minimisation over directions and places in turn, or over a particle's place; the error at rest falls, too."""
    one = scene(*BENT, "patch")
    net = run.net_of(one)
    network, h = network_of(net, 1.0), 1 / 60
    push = np.where(net.held, 0, h**2 * net.forces / net.masses[:, None])
    energies = []
    for iterations in range(1, 40):
        session = st.ENGINES[engine].start(net, st.Setting(h, iterations=iterations), 0.0)
        session.advance(1)
        moved = session.displacements()
        energies.append(0.5 * (net.masses[:, None] * (moved - push) ** 2).sum() / h**2 + network.energy_over_k(moved))
    assert (np.diff(energies) < 0).all()
    errors = [relative(st.in_engine(one, engine, dt="1/60", substeps=4, iterations=n)) for n in (5, 10, 20, 40)]
    assert (np.diff(errors) < 0).all() and errors[-1] > 0


# -- energies, precision, refusals ----------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ["vbd", "vbd-inertia", "implicit-cg"])
@pytest.mark.parametrize("case", slow_but(("patch-area", "delingette", "neo-hooke"), of_energies.CASES))
def test_energies_besides_springs(engine, case):
    one = of_energies.scene(case)
    if lacking := [each for each in run.net_of(one).energies if each.kind not in st.ENGINES[engine].laws]:
        with pytest.raises(st.EngineError, match=f"engine '{engine}' has no rubber.*or engine .*implicit-cg"):
            st.in_engine(one, engine)
        assert lacking[0].kind in ("compressible", "incompressible") and engine != "implicit-cg"
        return
    found = st.in_engine(one, engine, dt="1/60", substeps=10, iterations=50, tolerance=1e-8)
    assert found.status == "rest" and found.residual < (5e-2 if engine == "vbd-inertia" else 1e-7)


@pytest.mark.parametrize("case", some(TEN))
@cases
def test_single_precision(engine, share, iterations, case):
    """Within 1e-3, about the middle of the net. What trembles by rounding has no rest below that."""
    one = scene(*case, "patch")
    setting = st.Setting("1/60", substeps_for(one, share), iterations, "float32")
    found, exact = (
        st.in_engine(one, engine, dataclasses.replace(setting, precision=kind), damping=damping_of(one, case))
        for kind in ("float32", "float64")
    )
    assert found.status == "rest" or found.swing < 1e-3 * np.abs(exact.displacements).max()
    assert 0 < abs(found.displacement / exact.displacement - 1) < 1e-3


@pytest.mark.parametrize("engine", OURS)
def test_negative_stiffness_is_for_conjugate_gradients_alone(engine):
    net = run.net_of(scene(*SHEET, "patch"))
    pushing = dataclasses.replace(net, stiffness=np.where(np.arange(len(net.springs)) == 3, -1e-3, 1) * net.stiffness)
    if engine == "implicit-cg":
        st.ENGINES[engine].start(pushing, st.Setting(), 0.0).advance(1)
    else:
        says = "'patch': has springs of negative stiffness, .*or engine 'implicit-cg'"
        with pytest.raises(st.EngineError, match=says):
            st.ENGINES[engine].start(pushing, st.Setting(), 0.0)


# -- where a session ends -------------------------------------------------------------------------------------------


class Prescribed:
    """A session of one particle whose displacement is a function of the frame."""

    def __init__(self, function):
        self.function, self.frame = function, 0

    def advance(self, frames):
        self.frame += frames

    def displacements(self):
        return np.array([[0.0, 0.0], [self.function(self.frame), 0.0]])


def followed(function, window=10, most=600, tolerance=1e-7):
    return run.follow(Prescribed(function), window, most, tolerance, extent=10.0)


@pytest.mark.parametrize("window", [1, 2, 3, 10])
@pytest.mark.parametrize("period", [np.inf, 20.0])
def test_it_rests(period, window):
    """A decay, and an oscillation that decays."""
    found = followed(lambda t: 1 - np.exp(-t / 5) * np.cos(2 * np.pi * t / period), window)
    assert (found.status, found.message, found.swing) == ("rest", "", 0.0)
    assert found.displacements[1, 0] == pytest.approx(1, abs=1e-7) and 80 <= found.frames <= 160


ENDED = {
    # displacement of a frame, options, and the end: its status, words, and frames at most
    "nothing": (lambda t: 0.0, {}, "rest", "", 40),
    "trembling below the tolerance": (lambda t: 1 - np.exp(-t / 5) + 4e-8 * np.sin(1.7 * t), {}, "rest", "", 400),
    "a pause": (lambda t: np.clip(t, 0, 20) + max(0, t - 45), {"most": 60}, "moving", "", 60),
    "a swing": (lambda t: 1 - np.exp(-t / 200) * np.cos(2 * np.pi * t / 17), {"most": 300}, "moving", "", 300),
    "growth": (lambda t: 1.1**t, {}, "diverged", "more substeps", 600),
    "no number": (lambda t: np.nan if t > 30 else 0.1 * t, {}, "diverged", "more substeps", 600),
} | {
    f"{most} frames": (lambda t: 1 - np.exp(-t / 5), {"most": most}, "moving", f"not at rest after {most} frames", most)
    for most in (1, 9, 15)
}


@pytest.mark.parametrize(("function", "options", "status", "said", "frames"), ENDED.values(), ids=ENDED)
def test_how_a_session_ends(function, options, status, said, frames):
    found = followed(function, **options)
    assert found.status == status and said in found.message and found.frames <= frames
    assert np.isnan(found.displacements).all() == np.isnan(found.swing) == (status == "diverged")


@pytest.mark.parametrize("slow", [1e3, 1e5])
def test_a_creep_is_no_rest(slow):
    """It is hidden below a fast decay, and changes by a twentieth of the tolerance in a window of ten frames."""
    share = 0.05 * 1e-7 * slow / 10
    found = followed(lambda t: 1 - np.exp(-t / 5) - share * np.exp(-t / slow), most=400)
    assert found.status == "moving" and "not at rest after 400 frames" in found.message
    ended = followed(lambda t: 1 - np.exp(-t / 5) - share * np.exp(-t / slow), most=10**6, tolerance=2 * share)
    assert ended.status == "rest" and abs(ended.displacements[1, 0] - 1) < 2 * share


@pytest.mark.parametrize("window", [2, 3, 10])
@pytest.mark.parametrize("periods", [0.37, 1, 2])
def test_it_swings(periods, window):
    """Also where the swing has whole periods between looks."""
    if window == 2 and periods == 2:
        pytest.skip("a swing within frames cannot be seen")
    swing = 0.1 * np.sin(0.3 + 2 * np.pi * periods * np.arange(1000) / window)
    found = followed(lambda t: 1 + swing[t] - np.exp(-t / 3), window)
    assert found.status == "swings" and "take more substeps or damping" in found.message
    assert found.displacements[1, 0] == pytest.approx(1, abs=2e-3)
    assert found.swing == pytest.approx(np.ptp(swing) / 2, rel=0.1)


def test_a_scene_that_swings_in_an_engine():
    """Without damping, in short steps of an implicit scheme that hardly damps."""
    found = st.in_engine(scene(*SHEET, "patch"), "vbd", dt="1 ms", substeps=20, iterations=3, damping=0.0, frames=300)
    assert found.status in ("swings", "moving") and found.swing > 0.05 * abs(found.exact)


def test_cells_turned_inside_out_are_no_rest():
    @st.engine("folds")
    class Folds:
        """Everything is mirrored, and stays so."""

        def __init__(self, net, setting, damping):
            self.moved = net.points * [-2.0, 0.0]

        def advance(self, frames):
            pass

        def displacements(self):
            return self.moved

    try:
        found = st.in_engine(scene(*CASES[0], "patch"), "folds")
    finally:
        st.ENGINES.discard("folds")
    assert found.status == "inverted" and "turned inside out" in found.message


BEAM = st.Beam("80 mm", "40 mm", thickness="2 mm")
E, NU, H = 1e6, 0.3, 2e-3


def net(definition="delingette", nu=NU):
    rubber = st.Material(E, nu, density=1000.0)
    one = st.Scene(BEAM, st.make_mesh(BEAM, "right", "20 mm"), rubber, "traction", "0.2 N", definition=definition)
    return st.SpringNet.from_scene(one, errors=False)


def test_triangles_of_vbd_have_lame_constants():
    shear, first = E * H / (2 * (1 + NU)), E * H * NU / (1 - NU**2)
    assert st.ENGINES["newton-vbd"].typed(net()) == pytest.approx({"tri_ke": shear, "tri_ka": first})


def test_xpbd_refuses_springs_that_it_leaves_out():
    given = net("patch")
    given.stiffness[0] *= -1
    with pytest.raises(st.EngineError, match="negative stiffness, and Newton's XPBD leaves these out"):
        st.ENGINES["newton-xpbd"].function(given, st.Setting(), 0.0)


def test_a_mixed_sheet_is_no_material_of_newton():
    """Triangles of one law in Newton have one material."""
    given = net()
    values = {name: one.copy() for name, one in given.energies[0].values.items()}
    values["tensile"][0] *= 2
    given.energies[0].values.update(values)
    with pytest.raises(ValueError, match="those of no material, and Newton has the law of a material alone"):
        st.ENGINES["newton-vbd"].typed(given)
    assert np.all(values["tensile"] > 0)
