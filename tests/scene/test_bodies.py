"""Bodies in combination: parts with energies of their own, other programs, caches, meshes that are not the shape's."""

from dataclasses import replace

import numpy as np
import pytest

import springtune as st
from springtune.mechanics.network import Network
from springtune.reference.shapes import solve_shape
from springtune.reference.small_strain import ReferenceNotConvergedError
from springtune.springs.identification import patch_cases

from problems import CLAMP, asked, outline, pulled
from tables import cases

STEEL = st.Material("210 GPa", 0.3, density="7850 kg/m^3", name="steel")
THIRD = st.Material("70 GPa", 1 / 3, density="2700 kg/m^3", name="third")
RUBBER = st.Material("1 GPa", 0.5, density="1000 kg/m^3", name="rubber")
HARD = st.Material("3 GPa", 0.5, density="1000 kg/m^3", name="hard")
BOARD = st.AnisotropicMaterial("14 GPa", "9 GPa", "3 GPa", "4 GPa", density="600 kg/m^3", name="board")

STRESSES = [st.Quantity(name, "stress", of, "xx") for name, of in (("in_core", "core"), ("beside", "beside"))]
PULL = pulled("100 N", 0.0, others=[st.Quantity("held", "reaction", "left", "x"), *STRESSES])
HOLES = st.Hole.circle((0.05, 0.02), 0.008), st.Hole.circle((0.08, 0.025), 0.006, part="core")
POINTS = {"core": (0.08, 0.025), "beside": (0.02, 0.01)}
PLATE = st.Shape.rectangle(0.1, 0.04, holes=HOLES, points=POINTS, loads={"pull": PULL})


@pytest.fixture(scope="module")
def grouped():
    return st.mesh_shape(PLATE, "6 mm")


@cases
def test_rubber_beside_other_rubber_is_linear_triangles_of_both(grouped, main, core):
    """Energies of several laws, each of its own cells; stresses too, to rounding at small strain."""
    values = [
        st.Scene(PLATE, grouped, {"": main, "core": core}, "pull", definition=name, kinematics="linear").solve().values
        for name in ("neo-hooke", "delingette")
    ]
    assert values[0] == pytest.approx(values[1], rel=1e-7)
    bent = st.Scene(PLATE, grouped, {"": main, "core": core}, "pull", definition="neo-hooke", scale=1e-4).solve()
    assert bent.message == ""
    assert bent.values == pytest.approx({name: 1e-4 * value for name, value in values[1].items()}, rel=1e-4)


def test_axial_and_rotational_springs_of_two_materials_are_linear_triangles_of_both(grouped):
    """Moduli of corners, of each part over the first one's stiffness.

    Stresses at points differ: the virial gives either side half of a spring, and cotangents do not.
    """
    mine, theirs = (
        st.Scene(PLATE, grouped, {"": STEEL, "core": RUBBER}, "pull", definition=name, kinematics="linear").solve()
        for name in ("ielsm", "delingette")
    )
    size = np.abs(theirs.displacements).max()
    np.testing.assert_allclose(mine.displacements, theirs.displacements, rtol=0, atol=1e-9 * size)


@cases
def test_springs_of_parts_with_energies_of_their_own_are_files_of_all_cells(grouped, tmp_path, definition, materials):
    scene = st.Scene(PLATE, grouped, dict(zip(("", "core"), materials)), "pull", definition=definition)
    net = scene.springs.write(tmp_path / "net.json")
    read = st.SpringNet.read(net[0])
    written = st.SpringNet.from_scene(scene, errors=False)
    assert [one.kind for one in read.energies] == [one.kind for one in written.energies]
    for one, other in zip(read.energies, written.energies):
        assert np.array_equal(one.cells, grouped.mesh.triangles)
        for name, values in other.values.items():
            assert values.shape[0] == len(grouped.mesh.triangles)
            assert np.isfinite(values).all()
            assert one.values[name] == pytest.approx(values, rel=1e-9)
    modulus = {"area": "modulus", "biquadratic": "tensile", "incompressible": "c1"}[written.energies[0].kind]
    of_core = grouped.parts["core"][3]
    none = (written.energies[0].values[modulus].reshape(len(of_core), -1) == 0).all(axis=1)
    # The part that has none of an energy has zeros.
    assert np.array_equal(none, of_core)


def test_what_is_zero_by_symmetry_has_no_relative_error():
    """It would be all that counts, by seven orders of magnitude; and a point on held sides takes nothing from them."""
    reactions = (("pinned", "pin", "y"), ("pinned_x", "pin", "x"), ("held", "left", "x"))
    others = [st.Quantity(name, "reaction", of, component) for name, of, component in reactions]
    others.append(st.Quantity("aside", "displacement", "right", "y"))
    case = pulled("4 kN", 0.0, supports=(st.Support("left", x=0.0), st.Support("pin", x=0.0, y=0.0)), others=others)
    hole = st.Hole.circle((0.05, 0.02), 0.008)
    shape = st.Shape.rectangle(0.1, 0.04, holes=[hole], points={"pin": (0.0, 0.02)}, loads={"pull": case})
    grouped = st.mesh_shape(shape, "5 mm")
    scene = st.Scene(shape, grouped, STEEL, "pull", definition="lattice", kinematics="linear")
    known = scene.reference_values()
    assert [known[name] for name in ("aside", "pinned", "pinned_x")] == [0.0, 0.0, 0.0]
    result = scene.solve()
    assert np.isnan([result.errors[name] for name in ("aside", "pinned", "pinned_x")]).all()
    assert result.values["held"] == pytest.approx(-4000.0, rel=1e-9) == known["held"]
    assert result.values["pinned_x"] == 0.0
    assert max(choice.worst for choice in st.predict(shape, grouped, STEEL)) < 0.2


def holed(radius, *, outline=True, part=""):
    pressure, end = st.Pressure("upper", "1 MPa", follower=True), asked(end="displacement right y")
    loads = {"push": st.LoadCase("push", CLAMP, pressures=[pressure], quantities=end)}
    if not outline:
        return st.Shape("plate", 1e-3, file="plate.msh", loads=loads)
    holes = [st.Hole.circle((0.05, 0.02), radius, part=part)]
    return st.Shape.rectangle(0.1, 0.04, holes=holes, points={"tip": (0.1, 0.02)}, loads=loads, name="plate")


class TestMeshOfAnotherShape:
    """The reference is on the outline of the shape: a mesh of another one would be compared with it."""

    @pytest.mark.parametrize(("size", "refined"), [(0.02, {}), (2e-3, {"hole": 5e-4})])
    def test_its_own_mesh_however_coarse_is_taken(self, size, refined):
        arcs = ((0.05, 0.04), "arc", (0.0, 0.0)), ((0.0, 0.03), "inner", (0.0, 0.0))
        straight = ((0.02, 0.0), "lower"), ((0.06, 0.0), "right"), ((0.0, 0.05), "left")
        sides = outline(*straight[:2], arcs[0], straight[2], arcs[1])
        nested = [st.Hole.circle((0.03, 0.03), 0.01, part="ring"), st.Hole.ellipse((0.03, 0.03), 0.006, 0.003)]
        shape = st.Shape("knee", 1e-3, sides, nested, loads={"pull": pulled(1.0, 0.0)})
        steel = {"ring": STEEL, "": STEEL}
        assert st.Scene(shape, st.mesh_shape(shape, size, refined=refined), steel, "pull", definition="lattice")


def test_scenes_that_share_a_sheet_have_groups_of_their_own():
    shape = holed(0.008, outline=False)
    grouped = st.mesh_shape(holed(0.008), "4 mm")
    other = replace(grouped, sides={**grouped.sides, "upper": grouped.sides["upper"][:5]})
    first = st.Scene(shape, grouped, STEEL, "push", definition="delingette", kinematics="linear")
    values = first.solve().values
    alone = st.Scene(shape, other, STEEL, "push", definition="delingette", kinematics="linear").solve().values
    shared = st.Scene(shape, other, STEEL, "push", definition="delingette", kinematics="linear", cache=first.cache)
    assert shared.solve().values == alone != values


def test_a_point_in_the_middle_of_a_side_is_no_corner():
    case = st.LoadCase(
        "push", (st.Support("left", x=0.0, y=0.0),), (st.Traction("right", (0.0, 1.0)),),
        quantities=(st.Quantity("mid", "displacement", "mid", "x"),),
    )  # fmt: skip
    shape = st.Shape.rectangle(1.0, 1.0, thickness=1.0, points={"mid": (0.5, 1.0)}, loads={"push": case})
    with pytest.raises(ReferenceNotConvergedError, match=r"'mid' of 'mid': .* the tolerance is 1.0e-08$"):
        solve_shape(shape, case, st.Material(1.0, 0.3), tolerance=1e-8)


def test_what_is_next_to_nothing_does_not_count_in_a_choice():
    """Inside a rim under pressure one stress all but vanishes; errors relative to it are of no use."""
    rollers = (st.Support("left", x=0.0), st.Support("lower", y=0.0))
    case = pulled("4 kN", 1e-3, supports=rollers, others=[st.Quantity("top", "stress", "in", "xy")])
    shape = st.Shape.rectangle(0.1, 0.04, points={"in": (0.05, 0.02)}, loads={"pull": case})
    for choice in st.predict(shape, st.mesh_shape(shape, "8 mm"), STEEL):
        assert np.isnan(choice.errors["top"])
        assert choice.worst == abs(choice.errors["end"]) < 0.2
    alone = replace(case, quantities=case.quantities[1:])
    only = replace(shape, loads={"pull": alone})
    assert min(choice.worst for choice in st.predict(only, st.mesh_shape(only, "8 mm"), STEEL)) < np.inf


@pytest.mark.parametrize("material", [STEEL, st.AnisotropicMaterial(140e9, 10e9, 3e9, 5e9, C16=2e9)])
def test_even_tests_of_a_body_without_a_lower_side_do_not_contradict_their_supports(material):
    """What linear triangles do under their forces, held as they are, is what they say."""
    corners = [(0.0, -0.03), (0.05, 0.005), (0.0, 0.04), (-0.05, 0.0)]
    rhombus = st.Shape("rhombus", 1e-3, [st.Segment(corner) for corner in corners])
    for shape in (rhombus, st.Shape.rectangle(0.03, 0.05, holes=[st.Hole.circle((0.015, 0.02), 0.005)])):
        mesh = st.mesh_shape(shape, "10 mm").mesh
        springs = st.DEFINITIONS["delingette"].springs(mesh, material, 1e-3)
        for case in patch_cases(mesh, material, 1e-3):
            assert np.abs(case.displacements[case.held]).max() <= 1e-9 * np.abs(case.displacements).max()
            assert np.abs(case.forces.sum(axis=0)).max() <= 1e-9 * np.abs(case.forces).max()
            network = Network(mesh, case.held, springs.relative, springs.energies)
            moved = network.expand(network.rest_factor.solve(network.reduce(case.forces / springs.reference)))
            np.testing.assert_allclose(moved, case.displacements, rtol=0, atol=1e-9 * np.abs(moved).max())


@pytest.mark.parametrize("materials", [{"": BOARD, "core": STEEL}, {"": BOARD, "core": BOARD}])
def test_choices_for_anisotropic_bodies(grouped, materials):
    """Springs alone among them, which have C12 = C66."""
    pull = {"pull": replace(PULL, quantities=PULL.quantities[:2])}
    choices = st.predict(replace(PLATE, loads=pull), grouped, materials)
    names = {"energy-fit", "element-fit", "delingette", "delingette-tensile"}
    assert {choice.definition for choice in choices} == names == {*choices[0].tried}
    assert all(choice.worst < 0.5 and not choice.failures for choice in choices)
    assert [choice.energies for choice in choices if choice.definition == "energy-fit"] == [False]


def test_a_stress_where_materials_meet_is_refused_at_once():
    points = {"core": (0.08, 0.031), "beside": (0.02, 0.01)}
    shape = replace(PLATE, points=points)
    meshed = st.mesh_shape(shape, "8 mm")
    with pytest.raises(ValueError, match="quantity 'in_core': 'core' is where different materials meet"):
        st.Scene(shape, meshed, {"": STEEL, "core": THIRD}, "pull", definition="delingette")
    assert st.Scene(shape, meshed, {"": STEEL, "core": STEEL}, "pull", definition="delingette").solve().message == ""
