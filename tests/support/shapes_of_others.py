"""Shapes, loads and materials that others published with an answer, and where it stands."""

from math import log, pi

import numpy as np

from springtune.problem.materials import Material
from springtune.problem.shapes import Hole, LoadCase, Pressure, Quantity, Segment, Shape, Support, Traction

CENTRE = (0.0, 0.0)


def cook():
    """Cook, J. Struct. Div. ASCE 100:1851 (1974): a trapezoid with a unit of shear on its right side.

    In metres and newtons, E = 1 and nu = 1/3. 23.96 is the displacement of the middle of that side, (48, 52), by fine
    meshes of good elements (Simo and Rifai, IJNME 29:1595, 1990).
    """
    outline = (
        Segment((0.0, 0.0), group="lower"),
        Segment((48.0, 44.0), group="right"),
        Segment((48.0, 60.0), group="upper"),
        Segment((0.0, 44.0), group="left"),
    )
    quantities = (
        Quantity("tip", "displacement", "tip", "y", 23.96, "Simo and Rifai 1990"),
        Quantity("mean-tip", "displacement", "right", "y"),
        Quantity("energy", "energy"),
        Quantity("reaction", "reaction", "left", "y", -1.0, "equilibrium"),
    )
    load = LoadCase("shear", (Support("left", 0.0, 0.0),), (Traction("right", (0.0, 1.0)),), quantities=quantities)
    shape = Shape("cook", 1.0, outline, points={"tip": (48.0, 52.0)}, loads={"shear": load})
    return shape, Material(1.0, 1 / 3)


def holed_plate(size=0.05, radius=0.01):
    """A quarter of a square plate with a hole, pulled along x by 10 MPa.

    Kirsch, Z. VDI 42:797 (1898), has the plate without end, whose stress concentration is 3.
    """
    outline = (
        Segment((radius, 0.0), group="lower"),
        Segment((size, 0.0), group="right"),
        Segment((size, size), group="upper"),
        Segment((0.0, size), group="left"),
        Segment((0.0, radius), CENTRE, group="hole"),
    )
    quantities = (
        Quantity("end", "displacement", "right", "x"),
        Quantity("top-of-the-hole", "stress", "top-of-the-hole", "xx"),
        Quantity("area", "area"),
    )
    supports = (Support("lower", y=0.0), Support("left", x=0.0))
    force = 10e6 * size * 1e-3
    load = LoadCase("pull", supports, (Traction("right", (force, 0.0)),), quantities=quantities)
    points = {"top-of-the-hole": (0.0, radius), "side-of-the-hole": (radius, 0.0)}
    return Shape("plate-with-a-hole", 1e-3, outline, points=points, loads={"pull": load}), Material(210e9, 0.3)


def kirsch(points, radius, tension, material):
    """Displacements and stresses (xx, yy, xy) beside a hole in a plate without end, pulled along x (Kirsch 1898)."""
    r, theta = np.hypot(*points.T), np.arctan2(points[:, 1], points[:, 0])
    nu = material.poisson_ratio
    shear, kappa, s = material.young_modulus / (2 * (1 + nu)), (3 - nu) / (1 + nu), radius / r
    c, cc, ccc = np.cos(theta), np.cos(2 * theta), np.cos(3 * theta)
    n, nn, nnn = np.sin(theta), np.sin(2 * theta), np.sin(3 * theta)
    c4, n4 = np.cos(4 * theta), np.sin(4 * theta)
    x = (kappa + 1) * c / s + 2 * s * ((1 + kappa) * c + ccc) - 2 * s**3 * ccc
    y = (kappa - 3) * n / s + 2 * s * ((1 - kappa) * n + nnn) - 2 * s**3 * nnn
    displacements = tension * radius / (8 * shear) * np.stack([x, y], axis=1)
    xx = 1 - s**2 * (1.5 * cc + c4) + 1.5 * s**4 * c4
    yy = -(s**2) * (0.5 * cc - c4) - 1.5 * s**4 * c4
    xy = -(s**2) * (0.5 * nn + n4) + 1.5 * s**4 * n4
    return displacements, tension * np.stack([xx, yy, xy], axis=1)


def nafems_le1():
    """NAFEMS, The Standard NAFEMS Benchmarks, TNSB rev. 3 (1990), LE1: a quarter of an elliptic membrane.

    10 MPa pull its outer edge outwards; 92.7 MPa along y at D.
    """
    outline = (
        Segment((2.0, 0.0), group="CD"),
        Segment((3.25, 0.0), CENTRE, group="BC"),
        Segment((0.0, 2.75), group="AB"),
        Segment((0.0, 1.0), CENTRE, group="DA"),
    )
    quantities = (
        Quantity("stress-at-D", "stress", "D", "yy", 92.7e6, "NAFEMS-LE1"),
        Quantity("D", "displacement", "D", "x"),
    )
    supports = (Support("CD", y=0.0), Support("AB", x=0.0))
    load = LoadCase("pull", supports, pressures=(Pressure("BC", -10e6),), quantities=quantities)
    shape = Shape("NAFEMS-LE1", 0.1, outline, points={"D": (2.0, 0.0)}, loads={"pull": load})
    return shape, Material(210e9, 0.3)


def ring(inner=0.5, outer=1.0, pressure=1e6):
    """A quarter of a ring under inner pressure; Lame (1852), Timoshenko and Goodier, Theory of Elasticity, section 28.

    The mean displacement of an arc along x is 2/pi of the radial one.
    """
    material, thickness = Material(210e9, 0.3), 0.01
    modulus, nu = material.young_modulus, material.poisson_ratio
    factor = pressure * inner**2 / (outer**2 - inner**2)

    def radial(r):
        return factor / modulus * ((1 - nu) * r + (1 + nu) * outer**2 / r)

    outline = (
        Segment((inner, 0.0), group="lower"),
        Segment((outer, 0.0), CENTRE, group="outer"),
        Segment((0.0, outer), group="left"),
        Segment((0.0, inner), CENTRE, group="inner"),
    )
    source = "Lame 1852"
    quantities = (
        Quantity("inner-point", "displacement", "inner-point", "x", radial(inner), source),
        Quantity("outer-arc", "displacement", "outer", "x", 2 / pi * radial(outer), source),
        Quantity("hoop", "stress", "inner-point", "yy", factor * (1 + outer**2 / inner**2), source),
        Quantity("across", "stress", "inner-point", "xx", -pressure, source),
        Quantity("area", "area", "", "", pi / 2 * (outer * radial(outer) - inner * radial(inner)), source),
        Quantity("energy", "energy", "", "", pressure * inner * pi / 4 * radial(inner) * thickness, source),
        Quantity("force", "reaction", "lower", "y", -pressure * inner * thickness, "equilibrium"),
    )
    supports = (Support("lower", y=0.0), Support("left", x=0.0))
    load = LoadCase("pressure", supports, pressures=(Pressure("inner", pressure),), quantities=quantities)
    points = {"inner-point": (inner, 0.0)}
    return Shape("ring", thickness, outline, points=points, loads={"pressure": load}), material


def curved_bar(inner=5.0, outer=10.0, modulus=1e4, moved=0.01):
    r"""A quarter of a ring bent by a force at its end: Timoshenko and Goodier, Theory of Elasticity, section 33, as
    Zienkiewicz and Zhu, IJNME 33:1331 (1992) test with it.

    With the angle from the end y = 0 on, the closed form has a constant u_x there, which is prescribed, and no stress
    along y; at x = 0 its u_x is zero and it has no shear. A point there is held along y and carries nothing:

    .. math:: P = E t u_0 ((a^2 - b^2) + (a^2 + b^2) \ln(b/a)) / (\pi (a^2 + b^2)),

    so (ln 2 - .6) / pi = .0296496684 with b = 2 a and E t u_0 = 1, which with E = 1e4 and u_0 = .01 is twice the energy
    u_0 P / 2.
    """
    squares = inner**2 + outer**2
    force = modulus * moved * (inner**2 - outer**2 + squares * log(outer / inner)) / (pi * squares)
    outline = (
        Segment((inner, 0.0), group="end"),
        Segment((outer, 0.0), CENTRE, group="outer"),
        Segment((0.0, outer), group="root"),
        Segment((0.0, inner), CENTRE, group="inner"),
    )
    source = "Timoshenko and Goodier"
    # The stress along the root, section 33: at its inner end.
    n = inner**2 - outer**2 + squares * log(outer / inner)
    hoop = force / n * (3 * inner - squares / inner - outer**2 / inner)
    quantities = (
        Quantity("force", "reaction", "end", "x", -force, source),
        Quantity("energy", "energy", "", "", force * moved / 2, source),
        Quantity("root", "stress", "root-point", "xx", hoop, source),
    )
    supports = (Support("end", x=-moved), Support("root", x=0.0), Support("root-point", y=0.0))
    load = LoadCase("end-moved", supports, quantities=quantities)
    points = {"root-point": (0.0, inner)}
    return Shape("curved-bar", 1.0, outline, points=points, loads={"end-moved": load}), Material(modulus, 0.25)


def l_shape():
    """An L of two squares' width, clamped on top and pulled to the side at its foot: no closed form."""
    corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
    groups = ("lower", "foot", "inner", "inner", "top", "left")
    outline = tuple(Segment(corner, group=group) for corner, group in zip(corners, groups))
    quantities = (Quantity("energy", "energy"), Quantity("foot", "displacement", "foot", "y"))
    load = LoadCase("shear", (Support("top", 0.0, 0.0),), (Traction("foot", (0.0, 1e3)),), quantities=quantities)
    return Shape("L", 0.01, outline, points={"notch": (1.0, 1.0)}, loads={"shear": load}), Material(210e9, 0.3)


def straight_beam():
    """MacNeal and Harder, Finite Elements in Analysis and Design 1:3 (1985): 6 x .2 x .1, E = 1e7, nu = .3.

    Its end moves by 3e-5 along a unit force along the beam, by .1081 along one across it.
    """
    corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 0.2), (0.0, 0.2)]
    groups = ("lower", "end", "upper", "root")
    outline = tuple(Segment(corner, group=group) for corner, group in zip(corners, groups))
    source = "MacNeal and Harder 1985"
    supports = (Support("root", 0.0, 0.0),)
    loads = {
        name: LoadCase(
            name,
            supports,
            (Traction("end", force),),
            quantities=(Quantity("end", "displacement", "end", component, value, source),),
        )
        for name, force, component, value in [("extension", (1.0, 0.0), "x", 3e-5), ("shear", (0.0, 1.0), "y", 0.1081)]
    }
    return Shape("straight-beam", 0.1, outline, loads=loads), Material(1e7, 0.3)


def curved_beam():
    """MacNeal and Harder, as `straight_beam`: a quarter of a ring, radii 4.12 and 4.32, t = .1, E = 1e7, nu = .25.

    A unit force across its end moves that by .08734 in their table; elasticity has .08854.
    """
    outline = (
        Segment((4.12, 0.0), group="root"),
        Segment((4.32, 0.0), CENTRE, group="outer"),
        Segment((0.0, 4.32), group="end"),
        Segment((0.0, 4.12), CENTRE, group="inner"),
    )
    quantities = (Quantity("end", "displacement", "end", "y", 0.08734, "MacNeal and Harder 1985"),)
    load = LoadCase("shear", (Support("root", 0.0, 0.0),), (Traction("end", (0.0, 1.0)),), quantities=quantities)
    return Shape("curved-beam", 0.1, outline, loads={"shear": load}), Material(1e7, 0.25)


ALL = (cook, holed_plate, nafems_le1, ring, curved_bar, l_shape, straight_beam, curved_beam)


def sector(angle, inner, outer, holes=()):
    """A sheet of .1 mm between two arcs [m] and two radii `angle` apart [rad], one held, pressed from within.

    `holes` are of radius, angle and place.
    """

    def at(radius, turn):
        return radius * np.cos(turn), radius * np.sin(turn)

    outline = (
        Segment(at(inner, 0.0), group="end"),
        Segment(at(outer, 0.0), (0.0, 0.0)),
        Segment(at(outer, angle), group="clamp"),
        Segment(at(inner, angle), (0.0, 0.0), "inner"),
    )
    asked = tuple(Quantity(axis, "displacement", "end", axis) for axis in "xy")
    load = LoadCase("press", (Support("clamp", x=0, y=0),), pressures=(Pressure("inner", 1e5),), quantities=asked)
    rounds = tuple(Hole.circle(at(place, turn), radius) for radius, turn, place in holes)
    return Shape("sector", 1e-4, outline, rounds, loads={"press": load})


def random_sector(seed):
    """One with up to three holes that are apart from each other and from the outline, and material 1 GPa, .3."""
    rng = np.random.default_rng(seed)
    angle, inner = rng.uniform(0.5, 3.0), rng.uniform(0.02, 0.08)
    outer = inner * rng.uniform(1.3, 2.5)
    holes = []
    for _ in range(rng.integers(0, 4)):
        radius, turn = (outer - inner) * rng.uniform(0.05, 0.3), rng.uniform(0, angle)
        place = rng.uniform(inner + 1.2 * radius, outer - 1.2 * radius)
        others = [np.hypot(place * np.cos(turn - t) - p, place * np.sin(turn - t)) - 1.2 * r for r, t, p in holes]
        others += [place * np.sin(turn), place * np.sin(angle - turn)]
        if min(others) > 1.2 * radius:
            holes.append((radius, turn, place))
    return sector(angle, inner, outer, holes)
