"""Shapes, loads and materials that others published with an answer, and where it stands: see the YAML file beside."""

from dataclasses import replace
from math import log, pi
from pathlib import Path

import numpy as np

import springtune as st

from problems import asked, outline

CENTRE = (0.0, 0.0)


def holed_plate(size=0.05, radius=0.01):
    """A quarter of a square plate with a hole, pulled along x by 10 MPa.

    Kirsch, Z. VDI 42:797 (1898), has the plate without end, whose stress concentration is 3.
    """
    corners = ((size, 0.0), "right"), ((size, size), "upper"), ((0.0, size), "left")
    sides = outline(((radius, 0.0), "lower"), *corners, ((0.0, radius), "hole", CENTRE))
    top = {"top-of-the-hole": "stress top-of-the-hole xx"}
    quantities = asked(end="displacement right x", **top, area="area")
    supports = (st.Support("lower", y=0.0), st.Support("left", x=0.0))
    force = 10e6 * size * 1e-3
    load = st.LoadCase("pull", supports, (st.Traction("right", (force, 0.0)),), quantities=quantities)
    points = {"top-of-the-hole": (0.0, radius), "side-of-the-hole": (radius, 0.0)}
    return st.Shape("plate-with-a-hole", 1e-3, sides, points=points, loads={"pull": load}), st.Material(210e9, 0.3)


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


def lame(material, inner=0.5, outer=1.0, pressure=1e6, thickness=0.01):
    """Answers of the ring under inner pressure; the mean displacement of an arc along x is 2/pi of the radial one."""
    modulus, nu = material.young_modulus, material.poisson_ratio
    factor = pressure * inner**2 / (outer**2 - inner**2)
    at_inner, at_outer = (factor / modulus * ((1 - nu) * r + (1 + nu) * outer**2 / r) for r in (inner, outer))
    return {
        "inner-point": at_inner, "outer-arc": 2 / pi * at_outer,
        "hoop": factor * (1 + outer**2 / inner**2), "across": -pressure,
        "area": pi / 2 * (outer * at_outer - inner * at_inner),
        "energy": pressure * inner * pi / 4 * at_inner * thickness, "force": -pressure * inner * thickness,
    }  # fmt: skip


def bent(material, inner=5.0, outer=10.0, moved=0.01):
    r"""Answers of the curved bar, whose end is moved by u_0.

    .. math:: P = E t u_0 ((a^2 - b^2) + (a^2 + b^2) \ln(b/a)) / (\pi (a^2 + b^2)),

    so (ln 2 - .6) / pi = .0296496684 with b = 2 a and E t u_0 = 1, which with E = 1e4 and u_0 = .01 is twice the energy
    u_0 P / 2.
    """
    squares = inner**2 + outer**2
    n = inner**2 - outer**2 + squares * log(outer / inner)
    force = material.young_modulus * moved * n / (pi * squares)
    # The stress along the root, section 33: at its inner end.
    root = force / n * (3 * inner - squares / inner - outer**2 / inner)
    return {"force": -force, "energy": force * moved / 2, "root": root}


STUDY = st.load_study(Path(__file__).with_suffix(".yaml"))
CLOSED_FORMS = {"ring": lame, "curved-bar": bent}


def published(name):
    """A shape, with the answers to its loads, and its material."""
    shape, material = STUDY.shape(name), STUDY.material(name)
    if name not in CLOSED_FORMS:
        return shape, material
    (load,) = shape.loads.values()
    known = CLOSED_FORMS[name](material)
    quantities = tuple(replace(one, expected=known[one.name], source="closed form") for one in load.quantities)
    return replace(shape, loads={load.name: replace(load, quantities=quantities)}), material


ALL = {name: published(name) for name in STUDY.shapes.shape} | {"plate-with-a-hole": holed_plate()}
"""Shape and material of each, by its name."""


def sector(angle, inner, outer, holes=()):
    """A sheet of .1 mm between two arcs [m] and two radii `angle` apart [rad], one held, pressed from within.

    `holes` are of radius, angle and place.
    """

    def at(radius, turn):
        return radius * np.cos(turn), radius * np.sin(turn)

    round_sides = (at(outer, 0.0), "", CENTRE), (at(inner, angle), "inner", CENTRE)
    sides = outline((at(inner, 0.0), "end"), round_sides[0], (at(outer, angle), "clamp"), round_sides[1])
    ends = asked(x="displacement end x", y="displacement end y")
    clamp, pressure = st.Support("clamp", x=0, y=0), st.Pressure("inner", 1e5)
    load = st.LoadCase("press", [clamp], pressures=[pressure], quantities=ends)
    rounds = tuple(st.Hole.circle(at(place, turn), radius) for radius, turn, place in holes)
    return st.Shape("sector", 1e-4, sides, rounds, loads={"press": load})


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
