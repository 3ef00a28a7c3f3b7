"""Shapes: supports, loads and quantities on groups, prescribed displacements, recovered stress."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import shapes_of_others as others
import springtune as st
from springtune.mechanics.continuation import follow
from springtune.mechanics.continuum import cell_stresses, particle_stresses
from springtune.mechanics.network import Network
from springtune.mechanics.statics import StaticProblem
from springtune.problem.boundary import cell_at, displacement_weights, forces
from springtune.problem.shapes import AssumptionWarning

from problems import asked, free_network

STEEL = st.Material("210 GPa", 0.3, density="7850 kg/m^3", name="steel")
THIRD = st.Material("210 GPa", 1 / 3, name="third")
RUBBER = st.Material("1 MPa", 0.45, density="1000 kg/m^3", name="rubber")

LENGTH, HEIGHT = 0.1, 0.04
ROLLERS = (st.Support("left", x=0.0), st.Support("lower", y=0.0))
CLAMP = (st.Support("left", x=0.0, y=0.0),)
END = st.Quantity("end", "displacement", "right", "x")


def plate(*cases, points=None, holes=()):
    return st.Shape.rectangle(LENGTH, HEIGHT, holes=holes, points=points or {}, loads={one.name: one for one in cases})


def load(*quantities, supports=ROLLERS, name="pull", **parts):
    return st.LoadCase(name, supports, quantities=quantities or (END,), **parts)


def solved(shape, grouped, material=STEEL, definition="delingette", kinematics="linear", **options):
    name = options.pop("name", "pull")
    result = st.Scene(shape, grouped, material, name, definition=definition, kinematics=kinematics, **options).solve()
    assert result.message == ""
    return result


class TestAffineFields:
    """A plate that is pulled between rollers: everything is known."""

    force, stress = 8e3, 8e3 / (HEIGHT * 1e-3)

    @pytest.mark.parametrize("kinematics", ["linear", "nonlinear"])
    def test_all_quantities(self, kinematics):
        size = 1e-3 if kinematics == "linear" else 1e-6
        expected = {
            "end": self.stress / 210e9 * LENGTH,
            "side": -0.3 * self.stress / 210e9 * 0.013,
            "held": -self.force,
            "xx": self.stress,
            "energy": 0.5 * self.force * self.stress / 210e9 * LENGTH,
            "area": self.stress / 210e9 * 0.7 * LENGTH * HEIGHT,
        }
        stresses = asked(xx="stress somewhere xx", yy="stress corner yy")
        whole = asked(side="displacement somewhere y", held="reaction left x", energy="energy", area="area")
        pull = load(END, *whole, *stresses, tractions=[st.Traction("right", (self.force, 0.0))])
        shape = plate(pull, points={"somewhere": (0.037, 0.013), "corner": (0.0, 0.04)})
        found = solved(shape, st.mesh_shape(shape, 6e-3), kinematics=kinematics, scale=size)
        assert abs(found.values.pop("yy")) < 1e-8 * size * self.stress
        powers = {"energy": 2}
        # In nonlinear kinematics a strain of 1e-9 is small enough.
        for name, value in found.values.items():
            assert value == pytest.approx(size ** powers.get(name, 1) * expected[name], rel=1e-8)
        assert found.displacement == found.values["end"]

    def test_a_mesh_of_quadrilaterals(self):
        mesh = st.MESH_TYPES["braced"](LENGTH, HEIGHT, 7e-3)
        sides = {"left": mesh.outline_edges(0, 0.0), "right": mesh.outline_edges(0, LENGTH)}
        sides["lower"] = mesh.outline_edges(1, 0.0)
        grouped = st.GroupedMesh(mesh, sides, {"somewhere": np.array([0.037, 0.013])})
        inside = asked(side="displacement somewhere y", xx="stress somewhere xx")
        pull = load(END, *inside, tractions=[st.Traction("right", (self.force, 0.0))])
        shape = plate(pull, points={"somewhere": (0.037, 0.013)})
        values = solved(shape, grouped, THIRD, "lattice").values
        assert values["end"] == pytest.approx(self.stress / 210e9 * LENGTH, rel=1e-9)
        assert values["side"] == pytest.approx(-self.stress / 210e9 * 0.013 / 3, rel=1e-9)
        assert values["xx"] == pytest.approx(self.stress, rel=1e-9)

    def test_a_prescribed_displacement_is_the_force_that_it_takes(self):
        reaction = st.Quantity("force", "reaction", "right", "x")
        stretch = load(END, reaction, supports=(*ROLLERS, st.Support("right", x=1e-4)))
        shape = plate(stretch)
        values = solved(shape, st.mesh_shape(shape, 6e-3)).values
        assert values["end"] == pytest.approx(1e-4, rel=1e-9)
        assert values["force"] == pytest.approx(210e9 * 1e-3 * HEIGHT * 1e-4 / LENGTH, rel=1e-9)


def test_a_rigid_motion_takes_no_force():
    """All that is prescribed: a residual has no load to be over."""
    supports = [st.Support(side, x=1e-3, y=2e-3) for side in ("left", "right")]
    move = load(*asked(middle="displacement middle x", energy="energy"), supports=supports)
    shape = plate(move, points={"middle": (0.05, 0.02)})
    for kinematics in ("linear", "nonlinear"):
        values = solved(shape, st.mesh_shape(shape, 8e-3), kinematics=kinematics).values
        assert values["middle"] == pytest.approx(1e-3, rel=1e-9)
        assert abs(values["energy"]) < 1e-9 * 210e9 * 1e-3 * (1e-3) ** 2


@pytest.mark.parametrize("definition", ["delingette", "area", "lattice"])
def test_a_prescribed_stretch_is_the_equilibrium_under_its_forces(definition):
    """By 60 %, between clamps, in nonlinear kinematics: the forces of the moved side, given as forces."""
    stretch = load(END, supports=(*CLAMP, st.Support("right", x=0.6 * LENGTH, y=0.0)))
    shape = plate(stretch)
    grouped = st.mesh_shape(shape, 8e-3)
    scene = st.Scene(shape, grouped, RUBBER, "pull", definition=definition)
    result = scene.solve()
    assert result.status is st.Status.SOLVED
    reference, moved = scene.springs.reference, result.displacements
    clamp = np.zeros(scene.held.shape, dtype=bool)
    clamp[grouped.sides["left"]] = True
    pulled = np.where(scene.held & ~clamp, scene.network.forces_over_k(moved), 0.0)
    network = Network(grouped.mesh, clamp, scene.springs.relative, scene.springs.energies)
    driven = StaticProblem(network, pulled).newton(1.0, moved + 1e-6 * LENGTH * ~clamp)
    assert driven.converged
    np.testing.assert_allclose(driven.displacements, moved, atol=1e-8 * LENGTH)
    energy = st.Quantity("energy", "energy")
    finer = plate(replace(stretch, quantities=(energy, st.Quantity("force", "reaction", "right", "x"))))
    step = 1e-4
    low, high = (solved(finer, grouped, RUBBER, definition, "nonlinear", scale=1 + sign * step) for sign in (-1, 1))
    slope = (high.values["energy"] - low.values["energy"]) / (2 * step * 0.6 * LENGTH)
    force = (pulled * reference)[:, 0].sum()
    # Castigliano, by central differences: their error is of second order in the step.
    assert slope == pytest.approx(force, rel=1e-5)


def test_a_path_of_prescribed_displacements():
    """By arc length to where Newton's method in steps gets."""
    bend = load(END, supports=(*CLAMP, st.Support("right", x=-0.01 * LENGTH, y=0.5 * LENGTH)))
    shape = plate(bend)
    scene = st.Scene(shape, st.mesh_shape(shape, 1e-2), RUBBER, "pull", definition="delingette")
    problem, s = scene.problem, 1 / scene.springs.reference
    path = follow(problem, s, increment=0.3 * LENGTH)
    assert not path.message
    share = path.loads[-1] / s
    assert share >= 1
    found = problem.nonlinear(path.loads[-1])
    assert found.converged
    np.testing.assert_allclose(path.displacements[-1], found.displacements, atol=1e-8 * LENGTH)
    right = scene.grouped.sides["right"]
    np.testing.assert_allclose(path.displacements[-1][right, 1], 0.5 * LENGTH * share, rtol=1e-9)


class TestEquilibrium:
    """Whatever is pulled, pushed and heavy: supports carry it, moments included."""

    tractions = [st.Traction("right", (300.0, -200.0)), st.Traction("tip", (0.0, -100.0))]
    forces = {"tractions": tractions, "gravity": (0.0, -9.81)}
    forces["pressures"] = [st.Pressure("upper", 2e4), st.Pressure("hole", 1e5, follower=True)]
    case = load(END, *asked(energy="energy"), supports=CLAMP, **forces)
    shape = plate(case, points={"tip": (LENGTH, HEIGHT)}, holes=[st.Hole.circle((0.05, 0.02), 0.008)])
    soft = st.Material("1 GPa", 0.3, density="7850 kg/m^3")

    @pytest.mark.parametrize("kinematics", ["linear", "nonlinear"])
    def test_of_forces_and_moments(self, kinematics):
        grouped = st.mesh_shape(self.shape, 4e-3)
        scene = st.Scene(self.shape, grouped, self.soft, "pull", definition="delingette", kinematics=kinematics)
        solution = scene.boundary_problem.solve(scene.springs)
        assert solution.message == ""
        moved = solution.equilibrium.displacements
        acting = scene.forces
        if kinematics == "nonlinear":
            loading = scene.boundary_problem.loading
            acting = loading.dead + loading.follower.forces(moved)
        total = acting + scene.boundary_problem.reactions(scene.springs, solution.problem.network, moved)
        place = grouped.mesh.points + (moved if kinematics == "nonlinear" else 0.0)
        size = np.abs(acting).sum()
        np.testing.assert_allclose(total.sum(axis=0), 0.0, atol=1e-9 * size)
        moment = total[:, 1] @ place[:, 0] - total[:, 0] @ place[:, 1]
        assert abs(moment) < 1e-9 * size * LENGTH

    def test_loads_have_their_sizes(self):
        grouped = st.mesh_shape(self.shape, 4e-3)
        area = LENGTH * HEIGHT - grouped_hole_area(grouped)
        pull = forces(grouped, self.case, 1e-3, {"": 7850.0}).sum(axis=0)
        # An even pressure on a closed round has no resultant.
        expected = [300.0, -300.0 - 2e4 * LENGTH * 1e-3 - 9.81 * 7850 * area * 1e-3]
        np.testing.assert_allclose(pull, expected, rtol=1e-9)

    def test_two_clamps_share_their_corner(self):
        held_twice = load(
            *(st.Quantity(name, "reaction", name, "x") for name in ("left", "lower")),
            supports=(st.Support("left", x=0.0, y=0.0), st.Support("lower", x=0.0, y=0.0)),
            tractions=[st.Traction("right", (1e3, 0.0))],
        )
        shape = plate(held_twice)
        values = solved(shape, st.mesh_shape(shape, 6e-3)).values
        assert sum(values.values()) == pytest.approx(-1e3, rel=1e-9)
        assert min(map(abs, values.values())) > 10


def grouped_hole_area(grouped):
    first, last = (grouped.mesh.points[grouped.sides["hole"][:, end]] for end in (0, 1))
    return abs(0.5 * (first[:, 0] * last[:, 1] - last[:, 0] * first[:, 1]).sum())


def test_a_bar_hangs_by_its_weight():
    """Its end moves by rho g L^2 / (2 E), on any mesh: an even pull on the end, which linear triangles answer exactly,
    does the same work on both. Its support carries all of it.
    """
    hang = load(END, st.Quantity("carried", "reaction", "left", "x"), gravity=(9.81, 0.0))
    shape = plate(hang)
    material = st.Material("1 MPa", 0.0, density="1000 kg/m^3")
    values = solved(shape, st.mesh_shape(shape, 7e-3), material).values
    assert values["carried"] == pytest.approx(-1000 * 9.81 * LENGTH * HEIGHT * 1e-3, rel=1e-9)
    assert values["end"] == pytest.approx(1000 * 9.81 * LENGTH**2 / 2 / 1e6, rel=1e-9)


def test_a_ring_under_pressure():
    """Lame: second order in displacement, and the recovered stress on its rim within .5 %."""
    shape, material = others.ALL["ring"]
    names = "inner-point", "hoop"
    known = {one.name: one.expected for one in shape.loads["pressure"].quantities}
    errors = []
    for size in (0.08, 0.04, 0.02):
        values = solved(shape, st.mesh_shape(shape, size), material, name="pressure").values
        errors.append([values[name] / known[name] - 1 for name in names])
    moved, stress = np.transpose(errors)
    assert np.log2(moved[0] / moved[-1]) / 2 == pytest.approx(2, abs=0.3)
    assert abs(moved[-1]) < 2e-3
    # That of the stress changes its sign.
    assert np.abs(stress).max() < 5e-3


def test_stress_of_the_elliptic_membrane():
    """NAFEMS LE1: 92.7 MPa at D, here from triangles of 35 mm, some 5,100 particles."""
    shape, material = others.ALL["nafems-le1"]
    found = solved(shape, st.mesh_shape(shape, 0.035), material)
    assert found.values["stress-at-D"] == pytest.approx(92.7e6, rel=0.01)


def test_recovered_stress_around_a_hole():
    """Exact displacements on all of the outline but the hole: order two inside, three halves and more at the rim.

    Inside are the neighbours of the rim, too, hence the tolerance.
    """
    shape, _ = others.holed_plate(4.0, 1.0)
    inside, rim = [], []
    material = st.Material(2.6, 0.3)  # of shear modulus 1
    for size in (0.1, 0.05):
        grouped = st.mesh_shape(shape, size)
        mesh = grouped.mesh
        springs = st.DEFINITIONS["delingette"].springs(mesh, material, 1.0)
        directions = np.zeros(mesh.points.shape, dtype=bool)
        directions[np.concatenate([edges for side, edges in grouped.sides.items() if side != "hole"])] = True
        exact, stress = others.kirsch(mesh.points, 1.0, 1.0, material)
        network = Network(mesh, directions, springs.relative, springs.energies)
        problem = StaticProblem(network, np.zeros(mesh.points.shape), given=np.where(directions, exact, 0.0))
        found = problem.linear(1.0)
        assert found.converged
        recovered = springs.reference * particle_stresses(mesh, cell_stresses(network, found.displacements, True))
        away = np.linalg.norm(recovered - stress, axis=1)
        on_rim = np.zeros(len(mesh.points), dtype=bool)
        on_rim[grouped.sides["hole"]] = True
        outline_ = np.zeros(len(mesh.points), dtype=bool)
        outline_[mesh.edges[mesh.on_outline]] = True
        inside.append(np.sqrt((away[~outline_] ** 2).mean()))
        rim.append(np.sqrt((away[on_rim] ** 2).mean()))
    assert np.log2(inside[0] / inside[1]) > 1.75
    assert np.log2(rim[0] / rim[1]) > 1.5
    assert rim[-1] < 0.02  # of the stress far away, a third of the largest one


class TestStress:
    @settings(max_examples=20, deadline=None)
    @given(some.integers(0, 2**32 - 1), some.booleans())
    def test_an_even_strain_has_an_even_stress(self, seed, linear):
        """On any mesh, of linear triangles: to rounding, at cells and at all particles."""
        random = np.random.default_rng(seed)
        mesh = st.MESH_TYPES["free"](LENGTH, HEIGHT, 9e-3)
        nudged = mesh.points + 1e-3 * random.uniform(-1, 1, mesh.points.shape)
        mesh = st.Mesh(nudged, mesh.triangles)
        gradient = 1e-3 * random.standard_normal((2, 2))
        springs = st.DEFINITIONS["delingette"].springs(mesh, STEEL, 1e-3)
        network = free_network(mesh, springs)
        found = cell_stresses(network, mesh.points @ gradient.T, linear)
        strain = 0.5 * (gradient + gradient.T)
        if not linear:  # St. Venant-Kirchhoff
            strain = strain + 0.5 * gradient.T @ gradient
        xx, yy, xy = STEEL.plane_stress @ [strain[0, 0], strain[1, 1], 2 * strain[0, 1]]
        expected = np.array([[xx, xy], [xy, yy]])
        if not linear:
            turn = np.eye(2) + gradient
            expected = turn @ expected @ turn.T / np.linalg.det(turn)
        expected = expected[[0, 1, 0], [0, 1, 1]]
        scale = np.abs(expected).max()
        for values in (found[3], particle_stresses(mesh, found)):
            np.testing.assert_allclose(springs.reference / 1e-3 * values, np.broadcast_to(expected, values.shape),
                                       atol=1e-9 * scale)  # fmt: skip

    def test_parts_are_recovered_apart(self):
        """Stress that jumps from one part to the next is constant in either."""
        mesh = st.MESH_TYPES["free"](LENGTH, HEIGHT, 6e-3)
        left = mesh.points[mesh.triangles].mean(axis=1)[:, 0] < 0.5 * LENGTH
        jump = {3: np.where(left[:, None], [1.0, 2.0, 3.0], [5.0, 0.0, -1.0])}
        for part, value in ((left, [1.0, 2.0, 3.0]), (~left, [5.0, 0.0, -1.0])):
            found = particle_stresses(mesh, jump, {3: part})
            here = np.unique(mesh.triangles[part])
            np.testing.assert_allclose(found[here], np.broadcast_to(value, (len(here), 3)), atol=1e-9)
            assert np.isnan(np.delete(found, here, axis=0)).all()


class TestQuantities:
    @settings(max_examples=30, deadline=None)
    @given(some.floats(0, 1), some.floats(0, 1), some.sampled_from(["free", "braced", "right"]))
    def test_points_are_interpolated(self, along, across, mesh_type):
        mesh = st.MESH_TYPES[mesh_type](LENGTH, HEIGHT, 9e-3)
        point = np.array([along * LENGTH, across * HEIGHT])
        grouped = st.GroupedMesh(mesh, points={"here": point})
        count, cell, shares = cell_at(grouped, "here")
        assert shares.sum() == pytest.approx(1, rel=1e-9)
        np.testing.assert_allclose(shares @ mesh.points[mesh.cells[count][cell]], point, atol=1e-9 * LENGTH)
        assert shares.min() > -1e-9

    def test_a_mean_is_by_length(self):
        """Of a field that is linear along a side whose edges differ."""
        mesh = st.MESH_TYPES["right"](LENGTH, HEIGHT, 9e-3)
        points = mesh.points.copy()
        points[:, 1] = points[:, 1] ** 2 / HEIGHT
        mesh = st.Mesh(points, mesh.triangles)
        grouped = st.GroupedMesh(mesh, {"right": mesh.outline_edges(0, LENGTH)})
        field = displacement_weights(grouped, END)
        assert (field[:, 0] * points[:, 1]).sum() == pytest.approx(HEIGHT / 2, rel=1e-9)


class TestMaterials:
    def bar(self, mesh_type="right"):
        """Two halves, one beyond the other, with sides and points."""
        mesh = st.MESH_TYPES[mesh_type](LENGTH, HEIGHT, 1e-2)
        sides = {"left": mesh.outline_edges(0, 0.0), "right": mesh.outline_edges(0, LENGTH)}
        sides["lower"] = mesh.outline_edges(1, 0.0)
        far = {3: mesh.points[mesh.triangles].mean(axis=1)[:, 0] > LENGTH / 2}
        points = {"near": np.array([0.02, 0.02]), "far": np.array([0.08, 0.02])}
        return st.GroupedMesh(mesh, sides, points, {"far": far})

    def test_a_bar_of_two(self):
        """In series, without lateral strain: exact, as is the stress on either side of where they meet."""
        stresses = [st.Quantity(f"in-{name}", "stress", name, "xx") for name in ("near", "far")]
        pull = load(END, *stresses, tractions=[st.Traction("right", (1e3, 0.0))], gravity=(0.0, 0.0))
        shape = st.Shape("bar", 1e-3, file="bar.vtu", loads={"pull": pull})
        materials = {"": st.Material(2e9, 0.0), "far": st.Material(1e9, 0.0)}
        values = solved(shape, self.bar(), materials, "delingette").values
        stress = 1e3 / (HEIGHT * 1e-3)
        assert values["end"] == pytest.approx(stress * LENGTH / 2 * (1 / 2e9 + 1 / 1e9), rel=1e-9)
        for name in ("in-near", "in-far"):
            assert values[name] == pytest.approx(stress, rel=1e-9)

    def test_an_anisotropic_sheet(self):
        """Even stress, and the strains that the compliance says."""
        board = st.AnisotropicMaterial("9 GPa", "4 GPa", "1.5 GPa", "2 GPa", name="board")
        quantities = END, st.Quantity("xx", "stress", "near", "xx"), st.Quantity("v", "displacement", "near", "y")
        pull = load(*quantities, tractions=[st.Traction("right", (1e3, 0.0))])
        shape = plate(pull, points={"near": (0.02, 0.02)})
        stress = 1e3 / (HEIGHT * 1e-3)
        compliance = np.linalg.inv(board.plane_stress)
        values = solved(shape, st.mesh_shape(shape, 8e-3), board).values
        assert values["end"] == pytest.approx(stress * compliance[0, 0] * LENGTH, rel=1e-9)
        assert values["v"] == pytest.approx(stress * compliance[0, 1] * 0.02, rel=1e-9)
        assert values["xx"] == pytest.approx(stress, rel=1e-9)


class TestAgainstReferences:
    """A plate with a hole: what networks come to, and their errors."""

    pull = load(
        END, st.Quantity("force", "reaction", "left", "x"), supports=CLAMP, tractions=[st.Traction("right", (4e3, 0.0))]
    )
    shape = plate(pull, holes=[st.Hole.circle((0.05, 0.02), 0.008)])
    grouped = st.mesh_shape(shape, 3e-3)

    def test_errors_are_those_of_the_values(self):
        scene = st.Scene(self.shape, self.grouped, THIRD, "pull", definition="delingette", kinematics="linear", scale=2)
        result, known = scene.solve(), scene.reference_values()
        assert known["force"] == pytest.approx(-8e3, rel=1e-6)
        assert result.errors["end"] == pytest.approx(result.values["end"] / known["end"] - 1, rel=1e-9)
        assert -0.02 < result.error < 0  # linear triangles are too stiff
        again = st.Scene(self.shape, self.grouped, THIRD, "pull", definition="area", cache=scene.cache, scale=2)
        assert again.reference().values == scene.reference().values and len(scene.cache.references) == 1
        assert again.objection == ""
        far = st.Scene(self.shape, self.grouped, RUBBER, "pull", definition="area")
        assert "the linear reference does not apply" in far.objection

    def test_springs_fitted_to_the_reference(self):
        """Definitions that are told cases get the reference's displacements."""
        scene = st.Scene(self.shape, st.mesh_shape(self.shape, 8e-3), THIRD, "pull", definition="annealed",
                         kinematics="linear")  # fmt: skip
        plain = st.Scene(self.shape, scene.grouped, THIRD, "pull", definition="lattice", kinematics="linear")
        assert st.DEFINITIONS["annealed"].needs == "cases"
        assert abs(scene.solve().error) < 0.7 * abs(plain.solve().error)


def test_a_shape_buckles_and_moves_as_the_beam_does():
    """The same column as a beam and as a shape with groups."""
    beam = st.Beam(LENGTH, 4e-3)
    mesh = st.make_mesh(beam, "right", "2 mm")
    press = load(END, supports=CLAMP, tractions=[st.Traction("right", (-100.0, 0.0))])
    shape = st.Shape.rectangle(LENGTH, 4e-3, loads={"pull": press})
    sides = {"left": mesh.outline_edges(0, 0.0), "right": mesh.outline_edges(0, LENGTH)}
    column = st.Scene(beam, mesh, STEEL, "compression", 100.0, definition="delingette")
    other = st.Scene(shape, st.GroupedMesh(mesh, sides), STEEL, "pull", definition="delingette")
    with pytest.warns(AssumptionWarning, match="nothing bifurcates"):  # squares with one diagonal are no mirror image
        # An eigenvalue of the difference of two tangents, which rounding leaves eight digits.
        assert other.buckling_load() == pytest.approx(column.buckling_load() / 100.0, rel=1e-8)
    assert other.solve().displacement == pytest.approx(column.solve().displacement, rel=1e-9)
    steps = [one.motion().step_limit("central-difference") for one in (column, other)]
    assert steps[0] == pytest.approx(steps[1], rel=1e-9)
