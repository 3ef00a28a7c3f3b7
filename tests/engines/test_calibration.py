"""Calibration to an engine's setting: what is typed is right, and what is said of other loads holds."""

import json
from functools import partial

import numpy as np
import pytest

import springtune as st
from springtune.engines.calibration import LOAD_SHARES, best_runnable_scene
from springtune.engines.run import reordered
from springtune.handover.newton import LAWS, membrane_energies
from springtune.handover.simulation import simulate

import engine_scenes
from problems import asked, pulled

QUESTIONS = 50


def strip(load="traction", force=0.2, size="10 mm", **options):
    """A scene of a soft strip."""
    beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    return st.Scene(beam, st.make_mesh(beam, "structured", size), rubber, load, force, **options)


def question(number):
    """A random scene and setting: body, mesh, load and its size, material, definition, substeps, iterations."""
    random = np.random.default_rng([31, number])

    def pick(those):
        return list(those)[random.integers(len(those))]

    body, load = pick(engine_scenes.BODIES), pick(engine_scenes.LOADS)
    scene = engine_scenes.scene(
        body, pick(("structured", "free", "right")), load, pick(engine_scenes.MATERIALS), pick(("patch", "lattice"))
    )
    force = scene.boundary_problem.size * random.uniform(0.2, 1.5)
    scene = st.Scene(scene.beam, scene.mesh, scene.material, load, force, definition=scene.definition)
    setting = st.Setting(
        pick((1 / 60, 1 / 120)), int(random.integers(4, 40)), int(random.integers(2, 20)), pick(("float64", "float32"))
    )
    return scene, setting, random


def answered(number):
    """Check what is said of a random question; return whether there is a factor."""
    scene, setting, random = question(number)
    loads = random.permutation(list(st.LOADS)[:5])[:2]
    fit = st.fit_engine(scene, "xpbd", setting, loads=loads, needed=False)

    def run(scene, factor):
        damping = 2 * scene.motion().loaded_frequency
        return st.in_engine(scene, "xpbd", setting, factor=factor, damping=damping, frames=1200, tolerance=1e-5)

    if "orders of the same particles" in fit.message:
        return False
    if fit.factor != fit.factor:
        target = abs(fit.untuned.reference)
        for factor in 10 ** random.uniform(0, 5, 2):
            assert not abs(run(scene, factor).displacement) < target, fit.message
        return False
    found = run(scene, fit.factor)
    assert abs(found.error) < 0.02, (number, found)
    for band in fit.bands:
        at = random.integers(len(LOAD_SHARES))
        other = st.Scene(scene.beam, scene.mesh, scene.material, band.load, band.sizes[at], definition=scene.definition)
        assert not abs(run(other, fit.factor).error - band.errors[at]) > 0.02, (number, band)
    return True


class Saturated:
    """An engine of the closed form u = (1 / s + softest) u0 with a factor s on stiffness."""

    softest, explodes = 0.3, np.inf

    def __init__(self, net, setting, damping):
        self.factor = net.stiffness.max() / BASE.springs.reference / BASE.springs.relative.max()
        size = net.forces.sum() / BASE.forces.sum()
        left = self.softest * (10 / setting.iterations) * (1 / setting.substeps) ** 2
        share = size * (1 / self.factor + left * (1 + self.bent * size))
        share *= 1 + self.unordered * (net.points[0] != BASE.mesh.points[0]).any()
        self.rows = np.empty(len(MOVED), int)  # of the particles in the mesh
        self.rows[np.lexsort(net.points.T)] = np.lexsort(BASE.mesh.points.T)
        self.moved = share * MOVED[self.rows] if self.factor < self.explodes else np.full(MOVED.shape, 1e9)

    bent = unordered = 0.0

    def advance(self, frames):
        pass

    def displacements(self):
        return self.moved


BASE = strip(size="20 mm", definition="lattice")
MOVED = BASE.solve().displacements


@pytest.fixture
def engine(monkeypatch):
    """Declare the closed form as engine ``late`` for a test."""
    kind = type("Late", (Saturated,), {})
    st.engine("late", precisions=("float64",))(kind)
    yield kind
    st.ENGINES.discard("late")


class TestClosedForm:
    """A factor on an engine whose displacement is known."""

    def test_the_factor_is_exact(self, engine):
        fit = st.fit_engine(BASE, "late", loads=["traction"], needed=False)
        exact = BASE.solve().displacement / fit.result.reference
        assert fit.factor == pytest.approx(1 / (1 / exact - 0.3), rel=5e-3) and abs(fit.error) < 1e-3
        assert fit.untuned.error == pytest.approx(1.3 * exact - 1, rel=1e-3)
        assert fit.net().stiffness == pytest.approx(fit.factor * st.SpringNet.from_scene(BASE).stiffness)
        assert fit.typed["stiffness"] == pytest.approx(fit.net().stiffness) and fit.message == ""
        assert fit.net().header["reference_stiffness"] == pytest.approx(fit.factor * BASE.springs.reference)
        assert fit.net().header["expected_error"].startswith("not computed: the stiffness is that for engine 'late'")

    def test_too_stiff_takes_a_softer_one(self, engine):
        engine.softest = -0.4
        fit = st.fit_engine(BASE, "late", loads=["traction"], needed=False)
        assert fit.factor < 1 and abs(fit.error) < 1e-3

    def test_saturation_is_said_with_numbers(self, engine):
        engine.softest = 1.5
        fit = st.fit_engine(BASE, "late", loads=["traction"])
        assert fit.factor != fit.factor and not fit.bands and not fit.typed
        assert fit.result.displacement == pytest.approx(1.5 * BASE.solve().displacement, rel=0.01)
        assert fit.message.startswith("no stiffness reaches 0.997555 mm by finite elements: ")
        assert fit.message.endswith("; take more substeps or iterations")
        with pytest.raises(st.EngineError, match="no stiffness reaches"):
            fit.net()

    def test_settings_that_converge(self, engine):
        needed = {one.raised: one for one in st.fit_engine(BASE, "late", loads=["traction"]).needed}
        substeps, iterations = needed["substeps"], needed["iterations"]
        for one, left in (
            (substeps, 1 / substeps.setting.substeps**2),
            (iterations, 10 / iterations.setting.iterations),
        ):
            exact = 0.3 * left * BASE.solve().displacement / BASE.reference().displacement
            assert one.found and one.solver_error == pytest.approx(exact, rel=1e-3)
            assert one.solver_error <= 0.01
        assert (substeps.setting.substeps, iterations.setting.iterations) == (8, 640)

    def test_divergence_of_stiff_ones_is_said(self, engine):
        engine.softest, engine.explodes = 0.9, 2.0
        fit = st.fit_engine(BASE, "late", loads=["traction"], needed=False)
        assert fit.factor != fit.factor and " times diverges" in fit.message
        engine.softest = 0.3
        fit = st.fit_engine(BASE, "late", loads=["traction"], needed=False)
        assert 1.8 < fit.factor < engine.explodes and abs(fit.error) < 1e-3

    def test_the_error_of_a_band_grows_with_its_size(self, engine):
        engine.bent = 0.4
        (band,) = st.fit_engine(BASE, "late", loads=["traction"], needed=False).bands
        assert band.sizes == pytest.approx([share * 0.2 for share in LOAD_SHARES])
        slope = 0.3 * 0.4 * BASE.solve().displacement / BASE.reference().displacement  # of the error, over the load
        assert np.diff(band.errors) == pytest.approx(slope * np.diff(LOAD_SHARES), rel=0.25)


def test_a_shape_is_calibrated_under_its_load_cases():
    work, side = asked(work="energy", end="displacement right x")
    pulls = {"pull": pulled("0.2 N", 0, others=[work])}
    pulls["lift"] = pulled(0, "1 mN", name="lift", components="y", others=[work])
    pulls["move"] = st.LoadCase("move", [st.Support("left", x=0, y=0), st.Support("right", x=1e-3)], quantities=[side])
    plate = st.Shape.rectangle("200 mm", "40 mm", loads=pulls)
    foam = st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    scene = st.Scene(plate, st.mesh_shape(plate, "20 mm"), foam, "pull", definition="lattice")
    fit = st.fit_engine(scene, "xpbd", substeps=20, needed=False)
    assert abs(fit.error) < 1e-3 and fit.result.reference == pytest.approx(1e-3, rel=0.02)
    pull, lift, move = fit.bands
    assert pull.sizes == LOAD_SHARES and np.isfinite(lift.errors).all()
    assert "prescribes displacements" in move.message and np.isnan(move.errors).all()


def test_no_engine_moves_what_its_order_decides(engine):
    """A factor is right for any order of the particles, or there is none."""
    engine.unordered = 0.01
    fit = st.fit_engine(BASE, "late", loads=["traction"], needed=False)
    assert fit.spread == pytest.approx((fit.error, 1.01 * (1 + fit.error) - 1), abs=2e-3)
    engine.unordered = 0.2
    fit = st.fit_engine(BASE, "late", loads=["traction"])
    assert fit.factor != fit.factor and "in 4 orders of the same particles" in fit.message and not fit.bands
    assert not any(one.found for one in fit.needed)
    engine.unordered = 0.0
    assert all("stiffness" in one.typed for one in st.fit_engine(BASE, "late", loads=["traction"]).needed)


def test_an_order_is_that_of_a_mesh():
    net = st.SpringNet.from_scene(strip(size="20 mm", definition="delingette"), errors=False)
    exact = simulate(net, "nobody", ("biquadratic",)).displacements
    for order in (1, 2, 3):
        other, places = reordered(net, order)
        assert not np.array_equal(other.points, net.points) and np.array_equal(other.points[places], net.points)
        assert simulate(other, "nobody", ("biquadratic",)).displacements[places] == pytest.approx(exact, rel=1e-6)


def test_errors_are_of_the_definition_the_law_and_the_solver(engine):
    """An engine that rests by Newton's law has no error of its solver."""

    def by_law(net, setting, damping):
        kind = type("ByLaw", (Saturated,), {"__init__": lambda self: None})()
        kind.moved = simulate(net, "late", LAWS, membrane_energies).displacements
        return kind

    st.engine("by-law", precisions=("float64",), laws=LAWS, law=membrane_energies)(by_law)
    rubber, sheet = st.Material("5 MPa", 0.3, density=1000.0), st.Beam("300 mm", "200 mm", thickness="1 mm")
    mesh = st.make_mesh(sheet, "structured", "20 mm")
    found = st.in_engine(st.Scene(sheet, mesh, rubber, "traction", "10 N", definition="delingette"), "by-law")
    assert found.definition_error == pytest.approx(-0.0156, abs=1e-3)
    assert found.law_error == pytest.approx(0.0188, abs=1e-3) and abs(found.solver_error) < 1e-9
    assert found.error == pytest.approx(found.definition_error + found.law_error + found.solver_error, rel=1e-9)
    assert all(f"from the {part}" in str(found) for part in ("definition", "law", "solver"))
    st.ENGINES.discard("by-law")


def test_a_drift_is_said_and_not_recommended():
    """On squares with one diagonal springs alone move aside."""
    pulled = {"beam": st.Beam("100 mm", "20 mm"), "material": st.Material("5 MPa", 0.3, density=1000.0)}
    mesh = st.make_mesh(pulled["beam"], "right", "10 mm")
    case = pulled["beam"], mesh, pulled["material"], "traction", "1 N"
    fit = st.fit_engine(st.Scene(*case, definition="patch"), "implicit-cg", loads=["traction"], needed=False)
    assert fit.result.drift < -0.5 and "moves across by -" in fit.message
    engine, setting = st.ENGINES["implicit-cg"], st.Setting()
    best, *_ = best_runnable_scene(partial(st.Scene, *case), ["traction"], engine, setting, False)
    assert best.springs.energies
    with pytest.raises(st.EngineError, match="moves across by .*; .*another type such as 'structured'"):
        best_runnable_scene(partial(st.Scene, *case), ["traction"], engine, setting, True)


def test_files_run_at_the_setting_or_are_refused(tmp_path):
    fit = st.fit_engine(strip(size="13 mm"), "xpbd", substeps=16, loads=["traction"], needed=False)
    [path] = fit.net().write(tmp_path / "net.xpbd.json")
    found = json.loads(path.read_text())
    assert found["time_step"] == fit.result.setting.step and found["mass_damping"] == fit.result.damping
    assert found["sweeps"] == 10 and found["displacements"] is None
    for name in ("net.newton.py", "net.xml", "net.mjcf", "net.py"):
        says = r"runs .* at a step of its own, .* for xpbd at .*; give .*\.xpbd\.json or"
        with pytest.raises(ValueError, match=says):
            fit.net().write(tmp_path / name)


def test_an_absent_engine_is_refused_with_the_command_that_installs_it(engine):
    st.ENGINES.discard("late")
    st.engine("late", needs=("no_such_program",), extra="newton")(engine)
    with pytest.raises(st.EngineError, match="engine 'late' needs no_such_program; .*newton"):
        st.fit_engine(BASE, "late")


@pytest.mark.parametrize("number", [6, 37])
def test_what_is_said_of_a_random_question_holds(number):
    assert answered(number) is (number != 6)


@pytest.mark.slow
def test_what_is_said_of_random_questions_holds():
    assert sum(answered(number) for number in range(QUESTIONS)) > QUESTIONS / 2
