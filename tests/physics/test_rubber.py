"""Laws of rubber fitted to a uniaxial test: they give back what they are made of, and say where they end."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import springtune
from springtune.mechanics.energies import YeohEnergy
from springtune.mechanics.network import Network
from springtune.mechanics.statics import StaticProblem
from springtune.mesh import Mesh
from springtune.problem.materials import RUBBER_TESTS, Rubber
from springtune.problem.rubber import TensileTest, TestDataError, fit_rubber
from springtune.springs import DEFINITIONS
from springtune.springs.rubber import FLAT, SpringLaw

TRELOAR = Path(__file__).parents[2] / "config/treloar"


def treloar(test):
    return TensileTest.read(TRELOAR / f"{test.replace(' ', '-')}.csv")


def errors(law, test, most=np.inf):
    data = treloar(test)
    there = data.stretch <= most
    return law.stress(test, data.stretch[there]) / data.stress[there] - 1


@given(st.floats(0.05, 2.0), st.floats(0.0, 0.02), st.floats(0.0, 1e-3), st.floats(1.5, 7.0))
def test_a_fit_gives_back_the_law_that_made_the_data(first, second, third, most):
    law = Rubber((1e6 * first, 1e6 * second, 1e6 * third))
    q = np.linspace(1.02, most, 30)
    found = fit_rubber(TensileTest(q, law.stress("uniaxial", q)))
    for test in RUBBER_TESTS:  # within the data's I1
        stretch = np.linspace(1.01, 1 + 0.3 * (most - 1), 5)
        assert found.stress(test, stretch) == pytest.approx(law.stress(test, stretch), rel=1e-6)
    assert found.errors["uniaxial"] < 1e-8 and found.largest == pytest.approx(float(Rubber.excess("uniaxial", most)))


def test_treloars_rubber():
    """What a fit to the uniaxial test alone promises for the others; laws of I1 are too soft in equibiaxial tension."""
    rubber = fit_rubber(treloar("uniaxial"))
    spread = {test: float(np.sqrt((errors(rubber, test) ** 2).mean())) for test in RUBBER_TESTS}
    compared = fit_rubber(
        treloar("uniaxial"), equibiaxial=treloar("equibiaxial"), pure_shear=TRELOAR / "pure-shear.csv", name="treloar"
    )
    assert compared.errors == pytest.approx(spread, rel=1e-5)
    assert compared.name == "treloar" and compared.coefficients == rubber.coefficients
    assert spread == pytest.approx({"uniaxial": 0.074, "equibiaxial": 0.225, "pure shear": 0.070}, abs=2e-3)
    one_term = fit_rubber(treloar("uniaxial"), terms=1)
    assert float(np.sqrt((errors(one_term, "uniaxial") ** 2).mean())) > 0.25
    springs = SpringLaw.fitted(treloar("uniaxial"), 2)
    spread = {test: float(np.sqrt((errors(springs, test, springs.largest) ** 2).mean())) for test in RUBBER_TESTS}
    assert spread == pytest.approx({"uniaxial": 0.023, "equibiaxial": 0.180, "pure shear": 0.107}, abs=2e-3)


@pytest.mark.parametrize("stretch", [1.05, 1.5, 3.0, 6.0])
@pytest.mark.parametrize("test", RUBBER_TESTS)
def test_a_network_answers_with_the_fitted_stress(test, stretch):
    """A square of two triangles, pulled as in each of the tests, by Newton's method; to 1e-10 of its stretch."""
    rubber = Rubber((2e5, -5e2, 40.0))
    mesh = Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]), np.array([[0, 1, 2], [0, 2, 3]]))
    held = np.array([[True, True], [False, True], [False, False], [True, False]])
    springs = DEFINITIONS["yeoh"].springs(mesh, rubber, 1e-3)
    along = float(rubber.stress(test, stretch)) * 1e-3 / springs.reference
    other = {"uniaxial": stretch**-0.5, "equibiaxial": stretch, "pure shear": 1.0}[test]
    across = along if test == "equibiaxial" else 0.0
    if test == "pure shear":
        held[2:, 1] = True
    pattern = np.array([[0, 0], [along / 2, 0], [along / 2, across / 2], [0, across / 2]])
    found = StaticProblem(Network(mesh, held, springs.relative, springs.energies), pattern).nonlinear(1.0)
    assert found.converged
    exact = mesh.points * [stretch - 1, other - 1]
    assert np.abs(found.displacements - exact).max() <= 1e-10 * stretch


@given(st.integers(0, 2**31))
def test_forces_and_tangent_are_derivatives(seed):
    random = np.random.default_rng(seed)
    mesh = springtune.make_mesh(springtune.Beam("20 mm", "10 mm"), "free", "5 mm")
    energy = YeohEnergy(
        mesh.points, mesh.triangles, random.uniform([0.1, -0.01, 0.0], [1, 0.05, 0.01], (len(mesh.triangles), 3))
    )
    here, direction = 5e-4 * random.standard_normal(mesh.points.shape), random.standard_normal(mesh.points.shape)
    step = 1e-7  # 2e-5 of an edge, squared, and rounding over it
    each = direction[energy.corners].reshape(len(energy.corners), -1)
    ends = [energy.forces(here + sign * step * direction).reshape(each.shape) for sign in (1, -1)]
    tangent = energy.tangent(here)
    assert (
        np.abs((ends[0] - ends[1]) / (2 * step) - np.einsum("nij,nj->ni", tangent, each)).max()
        <= 1e-6 * np.abs(tangent).max()
    )
    slope = (energy.value(here + step * direction) - energy.value(here - step * direction)) / (2 * step)
    exact = (energy.forces(here).reshape(each.shape) * each).sum()
    assert abs(slope - exact) <= 1e-6 * np.abs(tangent).max() * 5e-3 * np.linalg.norm(direction)


def test_an_answer_beyond_the_data_says_so():
    rubber = fit_rubber(treloar("uniaxial"))
    beam = springtune.Beam("100 mm", "20 mm")
    mesh = springtune.make_mesh(beam, "structured", "5 mm")
    said = {}
    for force in ("60 N", "120 N"):
        scene = springtune.Scene(beam, mesh, rubber, "traction", force, definition="yeoh")
        result = scene.solve()
        assert result.status == springtune.Status.SOLVED
        said[force] = result.message
        # F / A is the nominal stress, and the clamp holds little of so long a sheet.
        stretch = 1 + result.displacement / beam.length
        assert float(rubber.stress("uniaxial", stretch)) == pytest.approx(scene.force / 2e-5, rel=0.1)
    assert said["60 N"] == ""
    assert said["120 N"].startswith("extrapolated: ") and "the data end at 55" in said["120 N"]


def test_springs_alone_on_a_lattice():
    """A lattice pulled along a row carries by its rows alone; equally in all directions 1.5 times that."""
    law = SpringLaw.fitted(treloar("uniaxial"), 2)
    q = np.linspace(1.05, 1.9, 10)
    assert law.stress("equibiaxial", q) == pytest.approx(1.5 * law.stress("uniaxial", q))
    assert np.isnan(law.stress("uniaxial", FLAT)) and law.largest < FLAT
    # At small strain nu = 1/3: E, E / (1 - nu) and E / (1 - nu^2) of a lattice.
    slopes = [float(law.stress(test, 1 + 1e-6)) for test in RUBBER_TESTS]
    assert slopes[1] / slopes[0] == pytest.approx(3 / 2, rel=1e-4)
    assert slopes[2] / slopes[0] == pytest.approx(9 / 8, rel=1e-4)


def test_a_row_of_springs_gives_back_its_law():
    """Three terms s - s^-p, of p = 2, 5 and 8, from a test that goes on after the lattice lies flat."""
    terms, q = np.array([0.3e6, 0.2e6, 0.1e6]), np.linspace(1.02, 2.4, 70)
    stress = terms @ [q - q**-2, q - q**-5, q - q**-8]
    law = SpringLaw.fitted(TensileTest(q, stress))
    assert law.coefficients == pytest.approx(terms, rel=1e-6) and law.largest == q[q < 2].max()
    soft = SpringLaw.fitted(TensileTest(q, 1e-6 * stress))  # what is stable is so in any unit
    assert soft.coefficients == pytest.approx(1e-6 * terms, rel=1e-6)
    four, three = ([*range(count), -2, -1] for count in (4, 3))  # and two beyond
    assert len(SpringLaw.fitted(TensileTest(q[four], stress[four])).coefficients) == 3
    with pytest.raises(TestDataError, match="3 terms need more than 3 points below a stretch of 2,"):
        SpringLaw.fitted(TensileTest(q[three], stress[three]))
    with pytest.raises(TestDataError, match="the law of 2 terms is unstable"):
        SpringLaw.fitted(TensileTest(q, 1e6 * np.exp(-3 * q)), 2)
    with pytest.raises(TestDataError, match="the law of 2 terms is unstable"):
        SpringLaw.fitted(TensileTest(q, np.exp(-3 * q)), 2)


@pytest.mark.parametrize(("test", "across"), [("equibiaxial", 1.0), ("pure shear", 0.0)])
def test_stress_of_a_lattice_is_the_derivative_of_its_springs_energy(test, across):
    """A row spring and two oblique ones for each particle; the rows apart by the other stretch."""
    law, q, step = SpringLaw((0.3, 0.2, 0.1)), np.linspace(1.1, 1.9, 5), 1e-5

    def energy(along, other):
        lengths = np.array([along, *2 * [np.sqrt(along**2 + 3 * other**2) / 2]])
        return sum(
            a * (lengths**2 / 2 + lengths ** (1 - p) / (p - 1)).sum(0) for a, p in zip((0.3, 0.2, 0.1), (2, 5, 8))
        )

    other = 1 + across * (q - 1)
    slope = (energy(q + step, other) - energy(q - step, other)) / (2 * step)
    assert law.stress(test, q) == pytest.approx(slope, rel=1e-8)


HEAD = "stretch,nominal stress [MPa]\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "cannot be read"),
        ("", "is empty"),
        ("1.1,0.2\n1.2,0.3\n", "no head of a test"),
        ("stretch,stress\n1.1,0.2\n", "no head of a test"),
        ("stretch,stress [mm]\n1.1,0.2\n", "nominal stress"),
        (HEAD + "1.1,0.2\n1.2,zwei\n", "line 3: '1.2,zwei' is not two numbers"),
        (HEAD + "1.1,0.2\n1.2,0.3,7\n", "line 3"),
        (HEAD + "1.1,0.2\n1.2,0.3\n", "fewer than three stretches"),
        (HEAD + "0.1,0.2\n0.2,0.3\n0.3,0.4\n", "over stretch (1 plus strain)"),
        (HEAD + "1.1,nan\n1.2,0.3\n1.3,.4\n", "no number"),
        (HEAD + "1.1,0.2\n1.5,2\n2,0.5\n3,1\n4,0.3\n5,3\n6,0.01\n", "unstable"),
    ],
)
def test_what_is_no_test_is_refused_by_its_line(text, words, tmp_path):
    path = tmp_path / "test.csv"
    if text is not None:
        path.write_text(text)
    with pytest.raises(TestDataError) as caught:
        fit_rubber(path)
    assert words in str(caught.value) and "test.csv" in str(caught.value)


def test_another_material_and_terms_are_refused():
    mesh = springtune.make_mesh(springtune.Beam("100 mm", "20 mm"), "structured", "5 mm")
    with pytest.raises(springtune.DefinitionError, match="'cork' is none; give springtune.fit_rubber"):
        DEFINITIONS["yeoh"].springs(mesh, springtune.Material("1 MPa", 0.5, name="cork"), 1e-3)
    with pytest.raises(ValueError, match="terms: 4"):
        fit_rubber(TRELOAR / "uniaxial.csv", terms=4)
    with pytest.raises(ValueError, match="terms: 0"):
        SpringLaw.fitted(TRELOAR / "uniaxial.csv", 0)
    with pytest.raises(TestDataError, match="needs? more|need more than"):
        SpringLaw.fitted(TensileTest(np.array([1.5, 3.0, 4.0, 5.0]), np.array([1.0, 2, 3, 4])), 1)


def test_a_net_of_fitted_springs_is_read_as_it_was_written(tmp_path):
    rubber = Rubber((2e5, -5e2, 40.0))
    beam = springtune.Beam("100 mm", "20 mm", thickness="2 mm")
    mesh = springtune.make_mesh(beam, "free", "5 mm")
    scene = springtune.Scene(beam, mesh, rubber, "traction", "1 N", definition="yeoh")
    springtune.SpringNet.from_scene(scene, errors=False).write(tmp_path / "net.csv")
    (terms,) = springtune.SpringNet.read(tmp_path / "net.csv").energies
    assert terms.kind == "incompressible" and terms.units["c2"] == "N/m"
    for name, coefficient in zip(("c1", "c2", "c3"), rubber.coefficients):
        assert terms.values[name] == pytest.approx(2e-3 * coefficient, rel=1e-12)
