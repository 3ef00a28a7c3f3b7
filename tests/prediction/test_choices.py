"""What `predict` says of a mesh, against solutions of the same networks by other means."""

import itertools
from functools import partial

import numpy as np
import pytest

import springtune as st
from springtune.linalg.factors import SingularError
from springtune.mechanics.network import Network
from springtune.prediction.choices import USUAL_LOADS, predictable_loads, references
from springtune.problem.boundary import held_directions, weights

from problems import pulled
from tables import slow_but

# Random beams may be thicker than they are high: thickness is a factor.
pytestmark = pytest.mark.filterwarnings("ignore::springtune.problem.shapes.AssumptionWarning")


def springs_of(choice, mesh, beam, material):
    """Springs that a row of a prediction stands for."""
    return st.DEFINITIONS[choice.definition].springs(mesh, material, beam.thickness)


def solved(mesh, beam, springs, load):
    """Displacement of a load of 1 N [m] by dense matrices; None where the network is not positive definite."""
    kind = st.LOADS[load].kind
    network = Network(mesh, held_directions(mesh, kind), springs.relative, springs.energies)
    pattern = weights(mesh, kind)
    tangent = network.tangent().toarray()
    try:
        np.linalg.cholesky(tangent)
    except np.linalg.LinAlgError:
        return None
    moved = network.expand(np.linalg.solve(tangent, network.reduce(pattern)))
    return float((moved * pattern).sum()) / springs.reference


def random_beam(random):
    """Beam, material, mesh type and mesh: aspects of .5 to 20, one to fourteen cells across, every nu."""
    height = np.exp(random.uniform(np.log(5e-3), np.log(0.1)))
    length = height * np.exp(random.uniform(np.log(0.5), np.log(20)))
    beam = st.Beam(length, height, random.uniform(1e-4, 1e-2), "any")
    material = st.Material(np.exp(random.uniform(np.log(1e3), np.log(1e12))), random.uniform(0, 0.5), name="any")
    if random.random() < 0.3:
        material = st.Material(material.young_modulus, float(random.choice([0.0, 1 / 3, 0.5])), name="any")
    mesh_type = str(random.choice(list(st.MESH_TYPES)))
    size = min(length, height) / np.exp(random.uniform(0, np.log(14)))
    while (
        st.MESH_TYPES[mesh_type].particles(length, height, size) > 300
    ):  # dense matrices are of twice as many unknowns
        size *= 1.2
    return beam, material, mesh_type, st.MESH_TYPES[mesh_type](length, height, min(size, length, height))


def check(beam, material, mesh):
    """Every number of a prediction, and its order, against dense solutions."""
    known = references(beam, material)
    choices = st.predict(beam, mesh, material, known)
    worst = []
    for choice in choices:
        if "springs" in choice.failures:
            with pytest.raises(st.DefinitionError):
                springs_of(choice, mesh, beam, material)
            worst.append(np.inf)
            continue
        try:
            springs, errors = springs_of(choice, mesh, beam, material), []
        except SingularError:  # of the patch test that scales them
            assert "unstable" in choice.failures["patch test"] and np.isnan(choice.errors["traction"])
            worst.append(np.inf)
            continue
        for load in USUAL_LOADS:
            moved = solved(mesh, beam, springs, load)
            if moved is None or load in choice.failures:
                assert moved is None and load in choice.failures
                errors.append(np.inf)
            elif not isinstance(known[load], str):
                errors.append(moved / known[load].value - 1)
                # Far inside of .2 points or a tenth: the same equations, solved in another way.
                assert choice.errors[load] == pytest.approx(errors[-1], abs=1e-6, rel=1e-6)
            else:
                assert np.isnan(choice.errors[load])
        worst.append(np.inf if choice.failures else np.abs(errors).max())
        assert choice.worst == pytest.approx(worst[-1], abs=1e-6, rel=1e-6)
    assert worst[0] <= min(worst) * (1 + 1e-6)
    assert sorted(worst) == pytest.approx(worst, rel=1e-6)
    return len(worst)


class TestWhatClosedFormsGotWrong:
    def choices(self, mesh_type, nu, length=0.1, height=0.02, size=5e-3, also=()):
        beam, material = st.Beam(length, height, 1e-3, "b"), st.Material(1e9, nu, name="m")
        mesh = st.MESH_TYPES[mesh_type](length, height, size)
        found = {choice.definition: choice for choice in st.predict(beam, mesh, material, also=also)}
        # Errors that differ by less than the references' estimates are equal: names are their order.
        errors = [choice.worst for choice in found.values()]
        assert all(before <= after + 1e-6 for before, after in itertools.pairwise(errors))
        return beam, material, mesh, found

    def test_exact_where_the_theory_says_so(self):
        """Between rollers triangles of any shape have the material's moduli, and so have rectangles with `area`."""
        for mesh_type, name in (("free", "delingette"), ("right", "delingette"), ("braced", "area")):
            for nu in (0.0, 0.3, 0.5):
                choice = self.choices(mesh_type, nu, also=[name])[-1][name]
                assert choice.poisson_ratio == pytest.approx(nu, abs=1e-9)
                assert choice.young_modulus_error == pytest.approx(0, abs=1e-9)

    def test_springs_that_are_the_same_are_named_once(self):
        for mesh_type, others in (("structured", ["area", "lloyd"]), ("braced", ["area", "patch"])):
            *_, found = self.choices(mesh_type, 1 / 3, also=["lattice", *others])
            assert "lattice" in found and not {*others} & {*found} and {*others} < {*found["lattice"].tried}

    def test_an_unstable_network_has_no_number(self):
        """A sheet that grows wider as it is pulled: its area energies are large and negative."""
        *_, found = self.choices("structured", -0.6, also=["area", "patch-area"])
        assert set(found["area"].failures) == {*USUAL_LOADS, "patch test"}
        assert all("unstable" in reason for reason in found["area"].failures.values())
        area = found["area"]
        assert np.isnan([*area.errors.values(), area.young_modulus_error, area.poisson_ratio]).all()
        assert "unstable" in found["patch-area"].failures["patch test"]
        assert set(list(found)[-2:]) == {"area", "patch-area"} and found["area"].worst == np.inf

    def test_no_reference_no_number(self):
        beam, material = st.Beam(0.1, 0.02, 1e-3, "b"), st.Material(1e9, 0.3, name="m")
        known = references(beam, material) | {"bending": "it did not converge"}
        mesh = st.MESH_TYPES["structured"](0.1, 0.02, 5e-3)
        choices = st.predict(beam, mesh, material, known)
        for choice in choices:
            assert np.isnan(choice.errors["bending"]) and not choice.failures
            assert choice.worst == max(abs(choice.errors["traction"]), abs(choice.errors["shear"]))
        nothing = st.predict(beam, mesh, material, dict.fromkeys(USUAL_LOADS, "none"))
        assert all(choice.worst == np.inf for choice in nothing)

    def test_cells_that_no_definition_takes_are_refused(self):
        """Squares beside triangles: springs fitted to elements take them; one that is asked for says why not."""
        mesh = st.MESH_TYPES["braced"](0.1, 0.02, 5e-3)
        half = mesh.points[mesh.quads].mean(axis=1)[:, 0] < 0.05
        triangles = np.vstack([mesh.quads[half][:, [0, 1, 2]], mesh.quads[half][:, [0, 2, 3]]])
        beam, material = st.Beam(0.1, 0.02, 1e-3, "b"), st.Material(1e9, 0.3, name="m")
        mixed = type(mesh)(mesh.points, triangles, mesh.quads[~half])
        assert "element-fit" in st.predict(beam, mixed, material)[0].tried
        *solved, refused = st.predict(beam, mixed, material, also=["baudet"])
        assert "needs rectangles" in refused.failures["springs"] and not any(one.failures for one in solved)
        assert "baudet" not in refused.tried


@pytest.mark.parametrize(("seed", "beams"), [(17, 6), pytest.param(18, 200, marks=pytest.mark.slow)])
def test_every_number_is_solved_and_the_first_is_the_best(seed, beams):
    random = np.random.default_rng(seed)
    assert sum(check(*(one := random_beam(random))[:2], one[3]) for _ in range(beams)) > 4 * beams


@pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
def test_particles_are_counted_before_the_mesh_is_made(mesh_type):
    for length, height, size in ((0.2, 0.04, 2e-3), (0.1, 0.1, 4e-3), (0.3, 0.02, 1e-3)):
        made = len(st.MESH_TYPES[mesh_type](length, height, size).points)
        assert st.MESH_TYPES[mesh_type].particles(length, height, size) == pytest.approx(made, rel=0.2)


def random_case(random, most=2000):
    """Beam of 1 mm to 1 m, aspect .3 to 12; material; mesh type; size: one cell across to so many particles."""
    aspect = np.exp(random.uniform(np.log(0.3), np.log(12)))
    material = st.Material(np.exp(random.uniform(np.log(1e3), np.log(1e12))), random.uniform(0, 0.5), name="any")
    return aspect, material, *random_mesh(random, aspect, most)


def random_mesh(random, aspect, most):
    """Beam of an aspect ratio, mesh type and size."""
    height = np.exp(random.uniform(np.log(1e-3), np.log(1)))
    length = aspect * height
    if length > 1:
        length, height = 1.0, 1 / aspect
    beam = st.Beam(length, height, np.exp(random.uniform(np.log(1e-4), np.log(1e-2))), "any")
    mesh_type, particles = str(random.choice(list(st.MESH_TYPES))), np.exp(random.uniform(np.log(4), np.log(most)))
    return beam, mesh_type, min(length, height, np.sqrt(length * height / particles))


def compared(beam, mesh, material, choices, loads):
    """Numbers that predictions and scenes agree on, within .2 points or a tenth and in truth far better."""
    cache, count = None, 0
    for choice in choices:
        if "springs" in choice.failures:
            continue
        for load in loads:
            options = {"definition": choice.definition, "kinematics": "linear", "cache": cache}
            scene = st.Scene(beam, mesh, material, load, 1.0, **options)
            cache, result, said = scene.cache, scene.solve(), choice.errors[load]
            if result.status is not st.Status.SOLVED:
                assert np.isnan(said) and choice.failures
                continue
            assert said == pytest.approx(result.error, abs=2e-3, rel=0.1)
            assert said == pytest.approx(result.error, abs=1e-9, rel=1e-9)
            count += 1
    return count


class TestWhatScenesSay:
    """A prediction states no number that a scene of the same definition contradicts."""

    @pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
    @pytest.mark.parametrize("height", ["8 mm", "40 mm"])
    def test_of_every_definition_and_load(self, mesh_type, height):
        """Bending of one row of cells is too stiff by much, but never by all of it."""
        beam, material = st.Beam("200 mm", height), st.Material("210 GPa", 0.3)
        mesh = st.make_mesh(beam, mesh_type, "8 mm")
        choices = st.predict(beam, mesh, material, loads=predictable_loads())
        assert compared(beam, mesh, material, choices, predictable_loads()) >= 3 * len(predictable_loads())
        assert all(one.failures or one.errors["bending"] > -1 for one in choices)

    def test_of_random_beams(self):
        """Of four shapes, as a reference scales with size, thickness and modulus."""
        random, count = np.random.default_rng(14), 0
        for number in range(4):
            aspect, material, *_ = random_case(random)
            load = predictable_loads()[number % len(predictable_loads())]
            one = references(st.Beam(aspect, 1.0, 1.0), st.Material(1.0, material.poisson_ratio), [load])[load]
            for largest in (1000, *4 * (200,)):
                beam, mesh_type, size = random_mesh(random, aspect, largest)
                material = st.Material(np.exp(random.uniform(np.log(1e3), np.log(1e12))), material.poisson_ratio)
                mesh = st.MESH_TYPES[mesh_type](beam.length, beam.height, size)
                known = {load: one._replace(value=one.value / (material.young_modulus * beam.thickness))}
                choices = st.predict(beam, mesh, material, known, loads=[load])
                count += compared(beam, mesh, material, [choices[random.integers(len(choices))]], [load])
        assert count > 16  # some are unstable


class TestLoads:
    def test_a_load_and_its_opposite_are_one(self):
        """In small strain."""
        beam, material = st.Beam(0.1, 0.02), st.Material(1e9, 0.3)
        mesh = st.MESH_TYPES["free"](0.1, 0.02, 5e-3)
        choices = st.predict(beam, mesh, material, loads=["compression", "traction"])
        assert [list(choice.errors) for choice in choices] == [["compression", "traction"]] * len(choices)
        assert all(choice.errors["compression"] == -choice.errors["traction"] for choice in choices)


def materials_of(random):
    """An isotropic material of any nu, one in plane strain, rubber, and of shapes an orthotropic one and a laminate."""
    return {
        "stress": st.Material("1 GPa", random.uniform(-0.4, 0.5)),
        "strain": st.Material("1 GPa", random.uniform(0, 0.45), plane="strain"),
        "rubber": st.Rubber([0.2e6, -1e3, 50.0]),
        "wood": st.AnisotropicMaterial.orthotropic("12 GPa", "0.6 GPa", 0.4, "0.7 GPa", angle="30 deg"),
    }


def seeded(seed):
    """Body, mesh, material and loads to predict; every third is a shape."""
    random = np.random.default_rng(seed)
    length, height = np.sort(random.uniform(20, 80, 2))[::-1] * 1e-3
    material = list(materials_of(random).values())[seed % (4 if seed % 3 == 2 else 3)]
    size = height / random.uniform(2, 9)
    if seed % 3 == 2:
        hole = st.Hole.circle((length / 2, height / 2), height / 6)
        shape = st.Shape.rectangle(length, height, holes=[hole], loads={"pull": pulled("10 N", "5 N", components="xy")})
        return shape, st.mesh_shape(shape, size), material, {"load": "pull"}
    beam, mesh_type = st.Beam(length, height, 1e-3), list(st.MESH_TYPES)[seed % len(st.MESH_TYPES)]
    loads = [str(one) for one in random.choice(predictable_loads(), random.integers(1, 4), replace=False)]
    return beam, st.MESH_TYPES[mesh_type](length, height, size), material, {"loads": loads}


def worst_by_scenes(body, mesh, material, about, name):
    """Whether a definition has energies, and its worst error by scenes; None where it is refused."""
    worst, cache, options = [], None, {"definition": name, "kinematics": "linear"}
    for load in about.get("loads", [about.get("load")]):
        force = () if "load" in about else (1.0,)
        try:
            scene = st.Scene(body, mesh, material, load, *force, **options, cache=cache)
            result, cache, energies = scene.solve(), scene.cache, bool(scene.springs.energies)
        except st.DefinitionError:
            return None
        except SingularError:
            return False, np.inf
        errors = result.errors.values() if "load" in about else [result.error]
        worst += [abs(one) if result.status is st.Status.SOLVED else np.inf for one in errors]
    return energies, np.nanmax(worst)


class TestAllDefinitionsCount:
    @pytest.mark.parametrize("seed", slow_but((1, 3, 5), range(8)))
    def test_nothing_left_out_is_better(self, seed):
        """Of all definitions that are no search and are given nothing, by scenes."""
        body, mesh, material, about = seeded(seed)
        choices = st.predict(body, mesh, material, **about)
        given = [name for name, one in st.DEFINITIONS.items() if one.needs or one.uniaxial or one.cost > 1]
        found = {name: worst_by_scenes(body, mesh, material, about, name) for name in {*st.DEFINITIONS} - {*given}}
        solved = {name: one for name, one in found.items() if one is not None}
        assert {*choices[0].tried} == {*solved}
        for springs_alone in (False, True):
            rows = [one.worst for one in choices if not (springs_alone and one.energies)]
            others = sorted(worst for energies, worst in solved.values() if not (springs_alone and energies))
            assert rows[0] == pytest.approx(others[0], rel=1e-6, abs=1e-5)
            assert len(rows) >= min(4, len({round(one, 7) for one in others}))

    def test_those_of_others_count(self):
        """A definition from outside can be the best one; a faulty one of another package is left out."""
        beam, material = st.Beam(0.1, 0.02), st.Material(1e9, 0.3)
        mesh = st.MESH_TYPES["free"](0.1, 0.02, 5e-3)
        best = st.best_springs(mesh, material, 1e-3, starts=["van-gelder"], evaluations=100).springs

        @st.definition("theirs")
        def theirs(mesh, material, thickness):
            return best

        @st.definition("faulty")
        def faulty(mesh, material, thickness):
            return 1 / 0

        try:
            with pytest.raises(ZeroDivisionError):
                st.predict(beam, mesh, material)
            st.DEFINITIONS.packages["faulty"] = "other"
            choices = st.predict(beam, mesh, material)
            assert choices[0].definition == "theirs" and "faulty" not in choices[0].tried
        finally:
            st.DEFINITIONS.packages.pop("faulty", None)
            for name in ("theirs", "faulty"):
                st.DEFINITIONS.discard(name)

    @pytest.mark.parametrize("engine", ["xpbd", "implicit-cg"])
    def test_what_an_engine_takes(self, engine):
        """The best one of all that an engine takes."""
        from springtune.engines.base import ENGINES, EngineError, Setting
        from springtune.engines.calibration import best_runnable_scene
        from springtune.engines.run import net_of

        beam, rubber = st.Beam("60 mm", "20 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
        make = partial(st.Scene, beam, st.make_mesh(beam, "free", "5 mm"), rubber, "traction", "0.2 N")
        chosen, setting, worst = ENGINES[engine], Setting(), {}
        for choice in st.predict(*make.args[:3], also=st.predict(*make.args[:3])[0].tried):
            try:
                chosen.start(net_of(make(definition=choice.definition)), setting, 1.0)
                worst[choice.definition] = choice
            except EngineError:
                continue
        for springs_alone in (False, True):
            scene, tried = best_runnable_scene(make, USUAL_LOADS, chosen, setting, springs_alone)
            assert {*worst} <= {*tried}
            able = [one.worst for one in worst.values() if not (springs_alone and one.energies)]
            assert worst[scene.definition.name].worst == pytest.approx(min(able), rel=1e-5)
