"""Contact against what nobody can tune: the patch test, Hertz, balance of forces, and no penetration."""

import math

import numpy as np
import pytest
from netgen.geom2d import SplineGeometry
from netgen.meshing import MeshingParameters

from springtune.contact import Body, Contact, ContactError, Obstacle, oriented_outline
from springtune.geometry import Strip, Trapezoid
from springtune.laying import lay
from springtune.materials import Material
from springtune.mesh import MESH_TYPES, Mesh, signed_areas
from springtune.network import Network
from springtune.springs import DEFINITIONS

RUBBER, STEEL = Material("rubber", 1e6, 0.49), Material("steel", 210e9, 0.3)
STRIP, TRAPEZOID = Strip(0.1, 3e-3, 1e-3), Trapezoid(0.08, 0.05, 9e-3)


def block(mesh_type, size, bottom, modulus=1e6, pressure=0.0, moves_little=True):
    """A block of 20 x 10 mm, free but for one particle that keeps its x, pressed on its upper face."""
    made = MESH_TYPES[mesh_type](0.02, 0.01, size)
    mesh = Mesh(made.points + [0, bottom], made.triangles, made.quads)
    definition = "area" if len(mesh.quads) else "delingette"
    springs = DEFINITIONS[definition].springs(mesh, Material("any", modulus, 0.3), 1e-3)
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[np.argmin(mesh.points.sum(axis=1)), 0] = True
    top = mesh.outline_edges(1, mesh.points[:, 1].max())
    forces = np.zeros(mesh.points.shape)
    np.add.at(forces[:, 1], top, -0.5 * pressure * 1e-3 * np.abs(np.diff(mesh.points[top, 0], axis=1)))
    network = Network(mesh, held, springs.relative, springs.energies)
    return Body(network, springs.reference, forces=forces, moves_little=moves_little)


@pytest.mark.parametrize(
    ("meshes", "moves_little"),
    [
        (("free", "structured"), True),
        (("braced", "free"), True),
        (("structured", "right"), True),
        (("free", "structured"), False),
        (("structured", "right"), False),
    ],
)
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


@pytest.mark.parametrize(("modulus", "close"), [(5e6, 5e-3), (210e9, 1e-4)])
def test_patch_of_steel_and_rubber(modulus, close):
    """The softer block grows wider than the other, by .6 % at most: its corners hang over."""
    lower, upper = block("free", 2.5e-3, 0.0, modulus), block("structured", 1.7e-3, 0.01, pressure=2e4)
    Contact([lower, upper], floor=True, size=2e-3).solve(first=1.0)
    top = upper.network.mesh.points[:, 1] > 0.02 - 1e-9
    assert upper.displacements[top, 1] == pytest.approx(-0.01 * 2e4 * (1e-6 + 1 / modulus), rel=close)


def half_disc(edge):
    """Lower half of a disc of radius 1 that touches y = 0, fine at the bottom."""
    geometry = SplineGeometry()
    corners = [geometry.AppendPoint(*point) for point in ((-1, 1), (-1, 0), (0, 0), (1, 0), (1, 1))]
    for first in (0, 2):
        geometry.Append(["spline3", *corners[first : first + 3]], leftdomain=1, rightdomain=0)
    geometry.Append(["line", corners[4], corners[0]], leftdomain=1, rightdomain=0)
    sizes = MeshingParameters(maxh=0.12, grading=0.3)
    for x in np.arange(-0.1, 0.1001, edge):
        sizes.RestrictH(float(x), 1 - math.sqrt(1 - x * x), 0, edge)
    made = geometry.GenerateMesh(mp=sizes)
    points = np.array([point.p for point in made.Points()])[:, :2]
    triangles = np.array([[vertex.nr - 1 for vertex in element.vertices] for element in made.Elements2D()])
    inverted = signed_areas(points, triangles) < 0
    triangles[inverted] = triangles[inverted][:, ::-1]
    return Mesh(points, triangles)


def hertz(edge, half_width=0.06):
    """Peak pressure and half width of a disc on a flat over Hertz's, E = 1, plane stress."""
    mesh = half_disc(edge)
    springs = DEFINITIONS["delingette"].springs(mesh, Material("unit", 1.0, 0.3), 1.0)
    held = np.zeros(mesh.points.shape, dtype=bool)
    top = mesh.outline_edges(1, 1.0)
    held[top, 0] = True
    force = math.pi * half_width**2 / 4
    forces = np.zeros(mesh.points.shape)
    np.add.at(forces[:, 1], top, 0.5 * np.abs(np.diff(mesh.points[top, 0], axis=1)))
    forces *= -force / forces.sum()
    body = Body(Network(mesh, held, springs.relative, springs.energies), springs.reference, forces, moves_little=True)
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


def test_hertz_comes_closer():
    coarse, fine = hertz(0.02), hertz(0.003)
    assert np.abs(np.array(fine) - 1).max() < np.abs(np.array(coarse) - 1).max()


@pytest.mark.parametrize("mesh_type", ["free", "braced", "structured"])
def test_outline_has_the_body_on_its_left(mesh_type):
    mesh = MESH_TYPES[mesh_type](0.02, 0.01, 2.5e-3)
    first, last = mesh.points[oriented_outline(mesh)].transpose(1, 0, 2)
    area = 0.5 * (first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]).sum()
    assert area == pytest.approx(0.02 * 0.01, rel=1e-12)
    assert np.linalg.norm(last - first, axis=1).sum() == pytest.approx(2 * (0.02 + 0.01), rel=1e-12)


@pytest.mark.parametrize("definition", ["uniform", "area", "delingette"])
@pytest.mark.parametrize("size", [2e-3, 1e-3])
def test_strip_lies_on_the_trapezoid(definition, size):
    laid = lay(STRIP, TRAPEZOID, RUBBER, STEEL, definition, size)
    assert laid.message == "" and laid.load_share == 1.0
    assert laid.area == pytest.approx(585e-6, rel=0.01)  # what lies under it besides is the gap at either foot
    assert laid.area > 585e-6
    assert laid.penetration <= 1e-3
    assert abs(laid.force_error) <= 1e-9
    assert abs(laid.elongation) < 0.015
    # Symmetric, since strip, trapezoid and load are.
    assert laid.outline[:, 0].sum() == pytest.approx(0, abs=1e-6)


def test_friction_holds_the_strip_back():
    free, rubbing = (lay(STRIP, TRAPEZOID, RUBBER, STEEL, "area", 2e-3, friction=value) for value in (0.0, 0.3))
    assert rubbing.message == ""
    assert abs(rubbing.elongation) < abs(free.elongation)
    assert rubbing.penetration <= 1e-3


@pytest.mark.parametrize("loading", ["gravity", "ends"])
def test_other_ways_to_lay(loading):
    laid = lay(STRIP, TRAPEZOID, RUBBER, STEEL, "delingette", 2e-3, loading=loading)
    assert laid.message == "" and laid.penetration <= 1e-3
    assert laid.outline[:, 1].min() == pytest.approx(0, abs=1e-9)  # the ends are on the floor


def test_rigid_is_the_limit_of_stiff():
    rigid, stiff = (lay(STRIP, TRAPEZOID, RUBBER, STEEL, "delingette", 2e-3, rigid=ratio) for ratio in (1e4, 1e9))
    assert "rigid" in rigid.skipped and "rigid" not in stiff.skipped
    assert stiff.message == ""
    assert stiff.area == pytest.approx(rigid.area, rel=1e-3)


def test_a_strip_that_cannot_be_laid_keeps_its_last_good_step():
    """Pressed with ten times its own modulus the strip's triangles turn inside out."""
    laid = lay(STRIP, TRAPEZOID, RUBBER, STEEL, "uniform", 2e-3, pressure=10e6)
    assert 0 < laid.load_share < 1
    assert f"no equilibrium beyond {100 * laid.load_share:.3g} % of the load" in laid.message
    assert np.isfinite(laid.outline).all()


def test_without_anything_near_there_is_no_contact():
    body = block("free", 2.5e-3, 1.0)
    contact = Contact([body], [Obstacle(np.array([[0.0, 0.0], [0.01, 0.0], [0.0, 0.01]]))], floor=True, size=2e-3)
    assert len(contact.find().gaps) == 0 and contact.penetration == 0.0


def test_a_load_that_nothing_meets_is_an_error():
    body = block("free", 2.5e-3, 1.0, pressure=2e4)
    with pytest.raises(ContactError, match="no equilibrium beyond 0 % of the load"):
        Contact([body], floor=True, size=2e-3).solve()
