"""Contact against what nobody can tune: the patch test, Hertz, balance of forces, and no penetration."""

import math

import numpy as np
import pytest
from netgen.geom2d import SplineGeometry
from netgen.meshing import MeshingParameters

import springtune as st
from springtune.mechanics.contact import Body, Contact, ContactError, Obstacle, oriented_outline
from springtune.mechanics.network import Network
from springtune.mesh.cells import signed_areas
from springtune.studies.kinds.laying.kind import REFERENCE_SIZES
from springtune.studies.kinds.laying.solve import Trapezoid, band, lay

from tables import cases

RUBBER, STEEL = st.Material(1e6, 0.49, name="rubber"), st.Material(210e9, 0.3, name="steel")
STRIP, TRAPEZOID = st.Beam(0.1, 3e-3, 1e-3), Trapezoid(0.08, 0.05, 9e-3)


def body_of(mesh, held, forces=None, modulus=1e6, thickness=1e-3, **options):
    """A body of linear triangles, or of rectangles with areas."""
    definition = "area" if len(mesh.quads) else "delingette"
    springs = st.DEFINITIONS[definition].springs(mesh, st.Material(modulus, 0.3, name="any"), thickness)
    return Body(Network(mesh, held, springs.relative, springs.energies), springs.reference, forces, **options)


def pressed_on(mesh, top, pressure):
    """Forces of a pressure on edges that run along x, over the thickness of 1 mm."""
    forces = np.zeros(mesh.points.shape)
    np.add.at(forces[:, 1], top, -0.5 * pressure * 1e-3 * np.abs(np.diff(mesh.points[top, 0], axis=1)))
    return forces


def block(mesh_type, size, bottom, modulus=1e6, pressure=0.0, moves_little=True):
    """A block of 20 x 10 mm, free but for one particle that keeps its x, pressed on its upper face."""
    made = st.MESH_TYPES[mesh_type](0.02, 0.01, size)
    mesh = st.Mesh(made.points + [0, bottom], made.triangles, made.quads)
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[np.argmin(mesh.points.sum(axis=1)), 0] = True
    forces = pressed_on(mesh, mesh.outline_edges(1, mesh.points[:, 1].max()), pressure)
    return body_of(mesh, held, forces, modulus, moves_little=moves_little)


@cases
def test_contact_patch(meshes, moves_little):
    """Even pressure passes a plane joint of meshes that do not match, exactly: displacements are linear.

    At finite strain both bodies need the same law, or their widths differ and the corners do not meet.
    """
    lower = block(meshes[0], 2.5e-3, 0.0, moves_little=moves_little)
    upper = block(meshes[1], 1.7e-3, 0.01, pressure=2e4, moves_little=moves_little)
    contact = Contact([lower, upper], floor=True, size=2e-3)
    contact.solve(first=1.0)
    for body in (lower, upper):
        points, moved = body.network.mesh.points, body.displacements
        basis = np.column_stack([np.ones(len(points)), points])
        fitted, *_ = np.linalg.lstsq(basis, moved, rcond=None)
        assert np.abs(basis @ fitted - moved).max() <= 1e-8 * np.abs(moved).max()
        if moves_little:  # strain p / E along y, and nu times that across
            assert fitted[2, 1] == pytest.approx(-0.02, rel=1e-6)
            assert fitted[1, 0] == pytest.approx(0.3 * 0.02, rel=1e-6)
    assert contact.penetration <= 1e-8 * 2e-3
    assert contact.contact_force() == pytest.approx([0, 2e4 * 0.02 * 1e-3], abs=1e-9)


def half_disc(edge, largest=0.12, grading=0.3):
    """Lower half of a disc of radius 1 that touches y = 0, fine at the bottom."""
    geometry = SplineGeometry()
    corners = [geometry.AppendPoint(*point) for point in ((-1, 1), (-1, 0), (0, 0), (1, 0), (1, 1))]
    for first in (0, 2):
        geometry.Append(["spline3", *corners[first : first + 3]], leftdomain=1, rightdomain=0)
    geometry.Append(["line", corners[4], corners[0]], leftdomain=1, rightdomain=0)
    sizes = MeshingParameters(maxh=largest, grading=grading)
    for x in np.arange(-0.1, 0.1001, edge):
        sizes.RestrictH(float(x), 1 - math.sqrt(1 - x * x), 0, edge)
    made = geometry.GenerateMesh(mp=sizes)
    points = np.array([point.p for point in made.Points()])[:, :2]
    triangles = np.array([[vertex.nr - 1 for vertex in element.vertices] for element in made.Elements2D()])
    inverted = signed_areas(points, triangles) < 0
    triangles[inverted] = triangles[inverted][:, ::-1]
    return st.Mesh(points, triangles)


def hertz(edge, half_width=0.06, **mesh):
    """Peak pressure and half width of a disc on a flat over Hertz's, E = 1, plane stress."""
    mesh = half_disc(edge, **mesh)
    held = np.zeros(mesh.points.shape, dtype=bool)
    top = mesh.outline_edges(1, 1.0)
    held[top, 0] = True
    force, forces = math.pi * half_width**2 / 4, pressed_on(mesh, top, 1.0)
    body = body_of(mesh, held, -force / forces.sum() * forces, modulus=1.0, thickness=1.0, moves_little=True)
    contact = Contact([body], floor=True, size=edge)
    contact.solve(first=0.2)
    assert contact.contact_force()[1] == pytest.approx(force, rel=1e-9)
    # p^2 = p_0^2 (1 - x^2 / a^2) is a line over x^2; each corner has half of the outline to its neighbours.
    corners = np.unique(body.outline)
    corners = corners[(np.abs(mesh.points[corners, 0]) < 0.2) & (mesh.points[corners, 1] < 0.1)]
    corners = corners[np.argsort(mesh.points[corners, 0])]
    share = dict(zip(corners[1:-1], 0.5 * (mesh.points[corners[2:], 0] - mesh.points[corners[:-2], 0])))
    touching = contact.forces > 0
    x = mesh.points[contact.contacts.corners[touching], 0]
    pressure = contact.forces[touching] / [share[corner] for corner in contact.contacts.corners[touching]]
    inner = np.abs(x) < np.abs(x).max()
    slope, peak = np.polyfit(x[inner] ** 2, pressure[inner] ** 2, 1)
    return math.sqrt(peak) / (2 * force / (math.pi * half_width)), math.sqrt(-peak / slope) / half_width


def test_hertz():
    """A disc on a flat: peak pressure and half width within 3 %, where twenty edges make the half width."""
    for found in hertz(0.003):
        assert found == pytest.approx(1, abs=0.03)


@pytest.mark.slow
def test_hertz_on_a_mesh_that_is_fine_below_the_contact_too():
    """What other meshes leave comes of edges that grow with depth; where they grow six times slower it is below 1 %."""
    for found in hertz(0.003, largest=0.04, grading=0.05):
        assert found == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("mesh_type", ["free", "braced", "structured"])
def test_outline_has_the_body_on_its_left(mesh_type):
    mesh = st.MESH_TYPES[mesh_type](0.02, 0.01, 2.5e-3)
    first, last = mesh.points[oriented_outline(mesh)].transpose(1, 0, 2)
    area = 0.5 * (first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]).sum()
    assert area == pytest.approx(0.02 * 0.01, rel=1e-9)
    assert np.linalg.norm(last - first, axis=1).sum() == pytest.approx(2 * (0.02 + 0.01), rel=1e-9)


@pytest.mark.parametrize(("definition", "size"), [("uniform", 2e-3), ("area", 2e-3), ("delingette", 1e-3)])
def test_strip_lies_on_the_trapezoid(definition, size):
    laid = lay(STRIP, TRAPEZOID, RUBBER, STEEL, definition, size)
    assert laid.message == "" and laid.load_share == 1.0
    assert 585e-6 < laid.area_under_strip <= 1.01 * 585e-6  # what lies under it besides is the gap at either foot
    assert laid.penetration <= 1e-3
    assert abs(laid.contact_force_error) <= 1e-9
    assert abs(laid.elongation) < 0.015
    # Symmetric, since strip, trapezoid and load are.
    assert laid.outline[:, 0].sum() == pytest.approx(0, abs=1e-6)


def test_friction_holds_the_strip_back():
    free, rubbing = (lay(STRIP, TRAPEZOID, RUBBER, STEEL, "area", 2e-3, friction=value) for value in (0.0, 0.3))
    assert rubbing.message == ""
    assert abs(rubbing.elongation) < abs(free.elongation)
    assert rubbing.penetration <= 1e-6
    # The residual that friction leaves, which lags a step behind.
    assert abs(rubbing.contact_force_error) <= 1e-5 and abs(free.contact_force_error) <= 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_elongation_is_known_as_well_as_it_says(friction):
    """The band of a reference at 1 mm holds what finer meshes give, which scatter."""

    def elongation(size):
        return lay(STRIP, TRAPEZOID, RUBBER, STEEL, "delingette", size, friction=friction).elongation

    values = [elongation(ratio * 1e-3) for ratio in REFERENCE_SIZES]
    assert 1e-4 < band(values) < 0.03
    for size in (0.8e-3, 0.7e-3, 0.6e-3):
        assert elongation(size) == pytest.approx(values[0], abs=band(values))


@pytest.mark.parametrize("loading", ["gravity", "ends"])
def test_other_ways_to_lay(loading):
    laid = lay(STRIP, TRAPEZOID, RUBBER, STEEL, "delingette", 2e-3, loading=loading)
    assert laid.message == "" and laid.penetration <= 1e-3
    assert laid.outline[:, 1].min() == pytest.approx(0, abs=1e-9)  # the ends are on the floor


def test_rigid_is_the_limit_of_stiff():
    rigid, stiff = (lay(STRIP, TRAPEZOID, RUBBER, STEEL, "delingette", 3e-3, rigid=ratio) for ratio in (1e4, 1e9))
    assert "rigid" in rigid.skipped and "rigid" not in stiff.skipped
    assert stiff.message == ""
    assert stiff.area_under_strip == pytest.approx(rigid.area_under_strip, rel=1e-3)


def test_a_strip_that_cannot_be_laid_keeps_its_last_good_step():
    """Pressed with ten times its own modulus the strip's triangles turn inside out."""
    laid = lay(STRIP, TRAPEZOID, RUBBER, STEEL, "uniform", 3e-3, pressure=10e6)
    assert 0 < laid.load_share < 1
    assert f"no equilibrium beyond {100 * laid.load_share:.3g} % of the load" in laid.message
    assert np.isfinite(laid.outline).all()


def test_without_anything_near_there_is_no_contact():
    body = block("free", 2.5e-3, 1.0)
    for floor in (True, False):
        contact = Contact([body], [Obstacle(np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.01]]))], floor=floor, size=2e-3)
        assert len(contact.find().gaps) == 0 and contact.penetration == 0.0


def test_a_load_that_nothing_meets_is_an_error():
    body = block("free", 2.5e-3, 1.0, pressure=2e4)
    with pytest.raises(ContactError, match="no equilibrium beyond 0 % of the load"):
        Contact([body], floor=True, size=2e-3).solve()


def depth(places, polygon):
    """Largest depth of places inside a polygon, side by side and place by place."""
    deepest = 0.0
    for x, y in places:
        inside, nearest = False, math.inf
        for (x1, y1), (x2, y2) in zip(polygon, np.roll(polygon, -1, axis=0)):
            if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
                inside = not inside
            share = ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / ((x2 - x1) ** 2 + (y2 - y1) ** 2)
            share = min(1.0, max(0.0, share))
            nearest = min(nearest, math.hypot(x - x1 - share * (x2 - x1), y - y1 - share * (y2 - y1)))
        deepest = max(deepest, nearest if inside else 0.0)
    return deepest


def polygon(body):
    """Corners of a body in order, where they are now."""
    around = [0]
    while len(around) < len(body.outline):
        around.append(int(body.neighbours[0][around[-1]]))
    return body.points[body.outline[around, 0]]


def penetration(contact):
    first, second = (polygon(body) for body in contact.all)
    return max(depth(first, second), depth(second, first))


def cap(radius, angle, corners):
    """A segment of a circle whose top is the origin."""
    angles = np.linspace(angle, -angle, corners)
    arc = radius * np.stack([np.sin(angles), np.cos(angles) - 1], axis=1)
    return Obstacle(np.vstack([arc, [[arc[-1, 0], -0.03], [arc[0, 0], -0.03]]]))


def pressed(mesh_type, size, obstacle, pressure):
    """A block of 20 x 10 mm whose upper face keeps its x, pressed on an obstacle, not quite in its middle."""
    made = st.MESH_TYPES[mesh_type](0.02, 0.01, size)
    mesh = st.Mesh(made.points - [0.01 - 0.13e-3, 0], made.triangles)
    held = np.zeros(mesh.points.shape, dtype=bool)
    top = mesh.outline_edges(1, mesh.points[:, 1].max())
    held[np.unique(top), 0] = True
    body = body_of(mesh, held, pressed_on(mesh, top, pressure))
    return Contact([body], [obstacle], size=size)


@pytest.mark.parametrize("ratio", [2, 1, 0.5, 0.2, 0.1])
@pytest.mark.parametrize("radius", [0.02, 0.1])
@pytest.mark.parametrize("mesh_type", ["structured", "free"])
def test_nothing_penetrates_whatever_is_finer(mesh_type, radius, ratio):
    """Obstacles with edges from twice to a tenth of the body's: many corners on one edge close one gap each."""
    size, angle = 2e-3, 0.012 / radius
    contact = pressed(mesh_type, size, cap(radius, angle, round(0.024 / (ratio * size)) + 1), pressure=2e4)
    contact.solve(first=0.05)
    assert contact.penetration == pytest.approx(penetration(contact), abs=1e-9 * size)
    assert penetration(contact) <= 1e-8 * size
    assert contact.contact_force()[1] == pytest.approx(2e4 * 0.02 * 1e-3, rel=1e-9)
    assert contact.iterations <= 60  # 20 to 27; many more would be steps that come and go


def test_penetration_is_that_of_every_corner():
    """What is inside counts, however deep, and whether or not a contact watches it."""
    contact = pressed("structured", 2e-3, Obstacle(np.array([[-1e-3, -5e-3], [1e-3, -5e-3], [0, 4.5e-3]])), 0.0)
    assert len(contact.find().gaps) > 0
    assert contact.penetration == pytest.approx(4.5e-3, rel=1e-9)


def test_the_far_face_of_a_thin_sheet_is_no_contact():
    """A corner just before a joint of the near face has no edge there; it must not be held by the far face."""
    contact = pressed("structured", 6e-3, cap(0.02, 0.6, 25), 0.0)
    body = contact.bodies[0]
    middle = np.flatnonzero((body.points[:, 1] == 0) & (np.abs(body.points[:, 0]) < 4e-3))
    body.displacements[middle] += [0, -0.1e-3]  # the near face bulges
    assert (contact.find().gaps > -1e-3).all()


def draped(corners, size):
    """A sheet of 60 x 4 mm draped over a segment of a circle by its weight."""
    made = st.MESH_TYPES["structured"](0.06, 0.004, size)
    mesh = st.Mesh(made.points - [0.03, 0], made.triangles)
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[np.abs(mesh.points).sum(axis=1).argmin(), 0] = True
    weights = -0.3 * mesh.particle_areas / mesh.area
    forces = np.stack([np.zeros(len(weights)), weights], axis=1)
    body = body_of(mesh, held, forces)
    contact = Contact([body], [cap(0.02, 1.0, corners)], size=size)
    contact.solve(first=1e-2)
    return contact


def test_many_corners_cost_few_iterations():
    """A circle of 241 corners asks for hardly more than one of 61: what is watched is not what is solved for."""
    coarse, fine = draped(61, 2e-3), draped(241, 2e-3)
    assert fine.iterations <= 3 * coarse.iterations  # 107 and 57
    for contact in (coarse, fine):
        assert penetration(contact) <= 1e-8 * 2e-3
    first, second = (contact.bodies[0].displacements for contact in (coarse, fine))
    assert first[:, 1].min() == pytest.approx(second[:, 1].min(), rel=2e-3)  # sagittas differ by 5e-4 of the radius


def test_a_force_along_the_floor_slips_at_the_limit():
    """A block under a load aslant stays where the load's slope is below the coefficient, and slides above."""

    def loaded(tangent):
        body = block("structured", 2.5e-3, 0.0)
        body.network.held[:] = False
        network = Network(body.network.mesh, body.network.held, body.network.stiffness, body.network.energies)
        weights = 0.02 * network.mesh.particle_areas / network.mesh.area
        forces = np.stack([tangent * weights, -weights], axis=1)
        contact = Contact([Body(network, body.reference, forces)], floor=True, size=2.5e-3, friction=0.3)
        contact.solve(first=1.0)
        return contact

    for share in (0.5, 0.99):
        contact = loaded(share * 0.3)
        assert contact.contact_force() == pytest.approx([-share * 0.3 * 0.02, 0.02], rel=1e-4)
        # Regularised: what holds is a slip of SLIP * share / sqrt(1 - share^2) and the block's own shear.
        assert np.abs(contact.bodies[0].displacements[:, 0]).max() <= 0.05 * 2.5e-3
    with pytest.raises(ContactError, match="no equilibrium beyond 0 % of the load"):
        loaded(1.01 * 0.3)


@pytest.mark.parametrize("way", [-1, 1])
def test_sliding_friction_is_the_normal_force_times_the_coefficient(way):
    """A block pressed down by its upper face and pushed aside: all of the force that Coulomb allows, against it."""
    made = st.MESH_TYPES["structured"](0.02, 0.004, 2e-3)
    top = made.points[:, 1] > 0.004 - 1e-9
    held = np.repeat(top[:, None], 2, axis=1)
    prescribed = np.where(held, [way * 1e-3, -2e-5], 0.0)
    contact = Contact([body_of(made, held, prescribed=prescribed)], floor=True, size=2e-3, friction=0.3)
    contact.solve(first=0.25)
    along, normal = contact.contact_force()
    assert normal > 0
    # Slips of a quarter of 1 mm, over SLIP * size: within 1 - 1 / sqrt(1 + (2e-6 / 2.5e-4)^2) = 3e-5 of the limit.
    assert along == pytest.approx(-way * 0.3 * normal, rel=1e-4)
    most = 0.3 * contact.forces * (1 + 1e-4) + 1e-9 * contact.forces.max()
    assert (np.linalg.norm(contact.drag, axis=1) <= most).all()


def capstan(friction, wrap, size, radius=1e-2, thickness=4e-4, ratio=0.2):
    """Force that holds a belt over the one that pulls it, around a circle of finer edges, and the angle it turns by."""
    lead = 2e-3
    made = st.MESH_TYPES["structured"](wrap * radius + 2 * lead, thickness, size)
    along = made.points[:, 0] - lead - 0.5 * wrap * radius
    angle = np.clip(along / radius, -0.5 * wrap, 0.5 * wrap)
    out, over = radius * (1 + 1e-6) + made.points[:, 1], along - angle * radius
    points = np.stack([out * np.sin(angle) + over * np.cos(angle), out * np.cos(angle) - over * np.sin(angle)], axis=1)
    mesh = st.Mesh(points, made.triangles)
    held = np.repeat((along < along.min() + 1e-9)[:, None], 2, axis=1)
    end = np.flatnonzero(along > along.max() - 1e-9)
    end = end[np.argsort(made.points[end, 1])]
    pull = 0.02 * 1e6 * 1e-3 * thickness * np.array([math.cos(0.5 * wrap), -math.sin(0.5 * wrap)])
    forces = np.zeros(points.shape)
    edges = np.diff(made.points[end, 1])[:, None] / thickness
    np.add.at(forces, end[:-1], 0.5 * edges * pull)
    np.add.at(forces, end[1:], 0.5 * edges * pull)
    angles = np.linspace(0.5 * wrap + 0.2, -0.5 * wrap - 0.2, round((wrap + 0.4) * radius / (ratio * size)) + 1)
    arc = radius * np.stack([np.sin(angles), np.cos(angles)], axis=1)
    body = body_of(mesh, held, forces)
    contact = Contact([body], [Obstacle(np.vstack([arc, [[0, -0.5 * radius]]]))], size=size, friction=friction)
    contact.solve(first=1.0)
    holding = -(contact.contact_force() + pull)
    turned = math.pi - math.acos(holding @ pull / np.linalg.norm(holding) / np.linalg.norm(pull))
    return np.linalg.norm(holding) / np.linalg.norm(pull), turned, contact


@pytest.mark.parametrize(("friction", "wrap"), [(0.0, 1.5), (0.3, 1.5), (0.5, 2.5)])
def test_capstan(friction, wrap):
    """Euler and Eytelwein's belt: forces in the ratio exp(friction * angle).

    Friction acts on the belt's inner face and the forces in its middle: the angle counts less by half the thickness.
    """
    found, angle, contact = capstan(friction, wrap, 0.5e-3)
    thick = 1 + 0.5 * 4e-4 / 1e-2
    assert angle == pytest.approx(wrap, abs=0.5e-3 / 1e-2)  # an edge more or less
    assert found == pytest.approx(math.exp(-friction * wrap / thick), rel=0.01)
    assert penetration(contact) <= 1e-8 * 0.5e-3


def test_capstan_comes_closer():
    errors = [abs(math.log(capstan(0.3, 1.5, size)[0]) * 1.02 / (0.3 * 1.5) + 1) for size in (1e-3, 0.5e-3, 0.25e-3)]
    assert errors[2] < 0.006 and errors[2] < errors[1] < errors[0]
