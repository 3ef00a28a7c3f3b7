"""Random scenes solved as a study solves them, and each answer checked by the mechanics of `mechanics`.

A ``solved`` scene is wrong where

- its displacements are further than `PROMISED` from the equilibrium next to them, or none is next to them;
- that equilibrium has a negative eigenvalue, or under a following pressure two of its lowest modes have merged
  (flutter; higher ones are the mesh's rather than the sheet's, and little damping holds them);
- it is not on the path that leads from rest, step by step, through equilibria without a negative eigenvalue. (Flutter
  on the way is no matter of where the path leads.)

Scenes depend on seed and number alone.
"""

import copy
import math
import warnings
from dataclasses import asdict, dataclass, replace
from functools import partial

import numpy as np

import mechanics
import springtune as st
from arches import ENDS, Arch
from mechanics import LONG, Body, Part, area_of, sides_of, spring_forces
from springtune.linalg.factors import SingularError
from springtune.mechanics.network import FollowerPressure
from springtune.problem.shapes import AssumptionWarning
from springtune.scene.mesh_cache import Loading, MeshCache, solve_and_judge
from springtune.studies.kinds.bodies.solve import solve as solve_scene
from springtune.studies.kinds.bodies.solve import solve_beam

PROMISED = 1e-6
"""Largest error of the displacements of a solved scene, relative: `springtune.mechanics.newton.ERROR_TOLERANCE`."""

MERGED = 1e-6
"""Imaginary part of an eigenvalue over its size from which two modes have merged; a load 1e-6 above the one that merges
them gives some 1e-3."""

ROUNDING = 1e-12
"""Imaginary part over the largest eigenvalue that rounding may give."""

LOW = 24
"""Modes below this number, from the lowest, tell of flutter: `springtune.mechanics.newton.MOST_MODES`."""

WAYS = ("moderate", "critical", "large")
"""How far a scene is loaded: within the linear range, next to the loss of stability, or far beyond the linear range."""


LATER = ("normal-shear", "ielsm", "many-body", "cross-section", "force-balance", "peridynamic", "best-springs")
"""Definitions that came after scenes were found by their number, so that they are drawn by themselves."""


@dataclass(frozen=True)
class Scene:
    """One draw. Lengths in m; `level` is what sets the force, see `force_of`."""

    mesh_type: str
    definition: str
    load: str
    kinematics: str
    way: str
    length: float
    height: float
    size: float
    thickness: float
    young_modulus: float
    poisson_ratio: float
    level: float

    @property
    def material(self):
        return st.Material(self.young_modulus, self.poisson_ratio, name="drawn")


def names_of(corners, later, uniaxial=False):
    """Definitions for cells of so many corners; that of tested rubber, alone, is none of them."""
    return [
        name
        for name, one in st.DEFINITIONS.items()
        if corners in one.cells and (uniaxial or not one.uniaxial) and one.needs in ("", "stiffness")
        if name != "yeoh" and (name in LATER) == later
    ]


def draw(seed, number, later=False):
    """Scene of a seed and a number, of a definition that is one of `LATER` or is not."""
    rng = np.random.default_rng([seed, number])
    mesh_type = str(rng.choice([name for name in st.MESH_TYPES if not later or name != "braced"]))
    corners = 4 if mesh_type == "braced" else 3
    load = str(rng.choice(list(st.LOADS)))
    kind = st.LOADS[load].kind.name
    names = names_of(corners, later, uniaxial=st.LOADS[load].kind.uniaxial)
    if not later and mesh_type not in ("isosceles-0.3", "isosceles-0.5", "braced"):
        names.remove("axis-exact")  # it lives on these alone
    # What is found by optimisation takes a second to derive, a hundred times as long as all else.
    odds = np.array([0.2 if name == "adjoint" else 1.0 for name in names])
    definition = str(rng.choice(names, p=odds / odds.sum()))
    kinematics = "linear" if rng.random() < 0.2 else "nonlinear"
    way = str(rng.choice(WAYS, p=[0.3, 0.4, 0.3]))
    height = 1e-3 * 10 ** rng.uniform(0, 2)
    # A column under a pressure is the tall sheet; otherwise beams lie.
    ratio = 10 ** (rng.uniform(-1, 1) if kind == "face" else rng.uniform(0, math.log10(300)))
    length = ratio * height
    # All eigenvalues of a matrix that is not symmetric take long.
    count = 30 * 10 ** rng.uniform(0, 0.7 if st.LOADS[load].follower else 1.1)
    slender = max(ratio, 1 / ratio)
    rows = max(math.sqrt(count / slender), 2, min(int(rng.integers(2, 5)), math.sqrt(1500 / slender)))
    size = float(min(length, height) / rows)
    nu = float(rng.choice([0.0, 0.3, 0.5, rng.uniform(0, 0.5)]))
    if mesh_type.startswith("isosceles") and definition == "axis-exact":
        nu = float(mesh_type.partition("-")[2])
    thickness, young_modulus = 1e-3 * 10 ** rng.uniform(-1, 1), 10 ** rng.uniform(4, 12)
    if way == "critical":
        distance = 10 ** rng.uniform(-6, -1)
        level = 1 + distance * rng.choice([-1.0, 1.0])
    elif way == "moderate":
        level = 10 ** rng.uniform(-5, -1.5)
    else:
        level = 10 ** (rng.uniform(-2, math.log10(5)) if kind == "bending" else rng.uniform(-2, math.log10(0.6)))
    return Scene(
        mesh_type, definition, load, kinematics, way,
        length, height, size, thickness, young_modulus, nu, float(level),
    )  # fmt: skip


@dataclass(frozen=True)
class Snap:
    """One draw of an arch, a truss, a dome or a column; `level` is over the load that the path carries, or a guess."""

    arch: Arch
    way: str
    level: float


def draw_snap(seed, number, later=False):
    """Arch of a seed and a number, as of `draw`."""
    rng = np.random.default_rng([seed, number, 1])
    form = str(rng.choice(["sine", "truss", "parabola", "circle", "straight"], p=[0.2, 0.25, 0.2, 0.2, 0.15]))
    load = str(rng.choice(["point", "pressure", "follower-pressure", "gravity"]))
    if form == "circle" and rng.random() < 0.7:
        load = "follower-pressure"
    if form == "straight":
        load = "shortening"
    names = [name for name in names_of(3, later) if name not in ("axis-exact", "adjoint", "annealed", "evolved")]
    arch = Arch(
        form, str(rng.choice(list(ENDS))), load, str(rng.choice(names)), float(rng.uniform(0.8, 4.0)),
        float(rng.uniform(0.05, 0.1)), int(rng.integers(2, 4)),
        str(rng.choice(["structured", "alternating", "right", "free"])), float(rng.choice([0.0, 0.3, 1 / 3, 0.49])),
    )  # fmt: skip
    way = str(rng.choice(WAYS, p=[0.25, 0.35, 0.4]))
    if way == "moderate":
        level = rng.uniform(0.2, 0.95)
    elif way == "critical":
        level = 1 + 10 ** rng.uniform(-2.5, -1) * rng.choice([-1.0, 1.0])
    else:
        level = rng.uniform(1.05, 5)
    return Snap(arch, way, float(level))


def unit_force(scene):
    """Force whose mean stress is E; in bending that of F L^2 = E I. Of the sign of the load."""
    kind, side = st.LOADS[scene.load].kind.name, scene.height
    if kind == "bending":
        size = scene.height**3 / (12 * scene.length**2)
    else:
        size = scene.length if kind in ("shear", "face") else side
    return st.LOADS[scene.load].sign * scene.young_modulus * scene.thickness * size


def column(scene):
    """Euler's load of a column that leans, of the sign of the load, less what shear takes."""
    kind = st.LOADS[scene.load].kind.name
    along, across = (scene.height, scene.length) if kind == "face" else (scene.length, scene.height)
    euler = math.pi**2 / 48 * (across / along) ** 2
    return unit_force(scene) * euler / (1 + 3.2 * euler)


def body_of(scene, mesh, springs):
    """The scene's body in the mechanics of the audit: energies from the definitions' formulas."""
    x, height, length = mesh.points, scene.height, scene.length
    kind, nu = st.LOADS[scene.load].kind.name, scene.poisson_ratio
    left, right = np.abs(x[:, 0]) < 1e-9 * length, np.abs(x[:, 0] - length) < 1e-9 * length
    bottom, top = np.abs(x[:, 1]) < 1e-9 * height, np.abs(x[:, 1] - height) < 1e-9 * height
    held = np.zeros(x.shape, bool)
    held[bottom if kind in ("shear", "face") else left] = True
    if kind == "shear":
        held[top, 1] = True
    loaded, across, force_axis = {
        "axial": (right, 1, 0), "bending": (right, 1, 1), "shear": (top, 0, 0), "face": (top, 0, 1)
    }[kind]  # fmt: skip

    def even(side, axis):
        """Particles of a side in order, and the share of each in its extent."""
        order = np.flatnonzero(side)
        order = order[np.argsort(x[order, axis])]
        gaps = np.diff(x[order, axis])
        return order, 0.5 * (np.append(gaps, 0) + np.append(0, gaps)) / gaps.sum()

    order, shares = even(loaded, across)
    pattern = np.zeros(x.shape)
    pattern[order, force_axis] = shares
    if scene.definition == "baudet-corrected":
        for side, sign in ((bottom, -1), (top, 1)):
            on, part = even(side, 0)
            pattern[on, 1] += sign * (1 - 3 * nu) / 2 * length / height * part
    follower = None
    if st.LOADS[scene.load].follower and scene.kinematics == "nonlinear":
        ends = np.stack([order[:-1], order[1:]], axis=1)
        follower = Part(ends, mechanics.follower_forces, np.full(len(ends), 1 / length))

    return Body(x, held, pattern, parts_of(scene, mesh, springs), follower)


def inverse_of(rest, area):
    """Inverse of the matrix of two sides of triangles."""
    sides = np.stack([rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]], axis=2)
    turned = np.stack([[sides[:, 1, 1], -sides[:, 0, 1]], [-sides[:, 1, 0], sides[:, 0, 0]]])
    return (turned / (2 * area)).transpose(2, 0, 1)


def parts_of(scene, mesh, springs):
    """Springs and energies of a scene's definition, from the formulas."""
    long, parts = mesh.points.astype(LONG), []
    t, young, nu = scene.thickness, scene.young_modulus, scene.poisson_ratio
    k = springs.reference * springs.relative
    if np.any(k):
        d = long[mesh.edges[:, 1]] - long[mesh.edges[:, 0]]
        parts.append(Part(mesh.edges, spring_forces, k, np.sqrt((d * d).sum(axis=1))))
    for corners in mesh.cells.values():
        rest = long[corners]
        area = area_of(rest)
        if scene.definition in ("area", "orthotropic", "patch-area", "flechon"):
            modulus = (3 * nu - 1) / (4 * (1 - nu) if scene.definition == "flechon" else 2 * (1 - nu**2))
            if scene.definition == "patch-area":  # its one scalar
                modulus *= springs.reference / (2 / math.sqrt(3) / (1 + nu) * young * t)
            parts.append(Part(corners, mechanics.area_forces, np.full(len(corners), modulus * young * t), area))
        elif scene.definition == "angular":
            squares = 4 / math.sqrt(3) * area
            modulus = squares * young * t * (1 - 3 * nu) / (6 * math.sqrt(3) * (1 - nu**2))
            parts.append(Part(corners, mechanics.angle_forces, modulus[:, None], mechanics.angles_of(rest)[0]))
        elif scene.definition == "ielsm":
            angles = mechanics.angles_of(rest)[0]
            bulk, shear = young * t / (2 * (1 - nu)), young * t / (2 * (1 + nu))
            before, after = np.roll(np.cos(angles), 1, axis=1), np.roll(np.cos(angles), -1, axis=1)
            scale = (area / np.sin(angles).prod(axis=1))[:, None] / np.sin(angles)
            modulus = scale * ((shear - bulk) * np.cos(angles) + bulk * before * after)
            parts.append(Part(corners, mechanics.angle_forces, modulus, angles))
        elif scene.definition == "many-body":
            modulus = young * t * (3 * nu - 1) / (2 * (1 - nu**2)) * area
            parts.append(Part(corners, mechanics.factor_forces, modulus, (sides_of(rest) ** 2).sum(axis=(1, 2))))
        elif scene.definition == "normal-shear":
            sides = sides_of(rest)
            modulus = young * t * (1 - 3 * nu) / (1 - nu**2) * 2 * area / (sides**2).sum(axis=(1, 2))
            parts.append(Part(corners, mechanics.slip_forces, inverse_of(rest, area), sides, modulus))
        elif scene.definition in ("delingette", "neo-hooke"):
            inverse = inverse_of(rest, area)
            shear = young * t / (2 * (1 + nu))
            if scene.definition == "delingette":
                law, moduli = mechanics.element_forces, (young * t * nu / (1 - nu**2), shear)
            else:
                law, moduli = mechanics.rubber_forces, (shear, 0.0 if nu >= 0.5 else young * t / (3 * (1 - 2 * nu)))
            parts.append(Part(corners, law, inverse, area, *(np.full(len(corners), one) for one in moduli)))
        elif scene.definition == "delingette-tensile":
            first, second = young * t * nu / (1 - nu**2), young * t / (1 + nu)
            angles, a, b = mechanics.angles_of(rest)
            stiffness = (2 * (first + second) / np.tan(angles) ** 2 + second) / (16 * area[:, None])
            opposite = b - a
            parts.append(Part(corners, mechanics.squares_forces, stiffness, (opposite**2).sum(axis=2)))
        elif springs.energies:
            raise ValueError(f"the energies of '{scene.definition}' are not in the audit; write them in mechanics.py")
    return parts


def masses_of(mesh):
    """Share of each particle in the area of its cells."""
    shares = np.zeros(len(mesh.points))
    for count, corners in mesh.cells.items():
        np.add.at(shares, corners.ravel(), np.repeat(area_of(mesh.points[corners]) / count, count))
    return shares


def fluttering(body, unknowns, force, masses):
    """Places from the lowest, below `LOW`, of modes whose eigenvalue is complex, and of any whose is negative."""
    values = body.modes(unknowns, force, masses)
    merged = np.abs(values.imag) > MERGED * np.abs(values) + ROUNDING
    return np.flatnonzero((merged & (np.arange(len(values)) < LOW)) | (values.real < 0))


def upright(body, unknowns, force, masses):
    """Whether no eigenvalue is real and negative, flutter or not."""
    values = body.modes(unknowns, force, masses)
    return not ((values.real < 0) & (np.abs(values.imag) <= MERGED * np.abs(values) + ROUNDING)).any()


def audit(scene, path=True):
    """Solve a scene by the recipe of a study's jobs and return what is wrong with the answer, a list of texts.

    Parameters
    ----------
    scene : Scene
    path : bool
        Whether to follow the path from rest, which takes longest.
    """
    mesh = st.MESH_TYPES[scene.mesh_type](scene.length, scene.height, scene.size)
    stiffness = 0.85 * scene.young_modulus * scene.thickness if st.DEFINITIONS[scene.definition].needs else None
    try:
        springs = st.DEFINITIONS[scene.definition].springs(mesh, scene.material, scene.thickness, stiffness)
    except st.DefinitionError:
        return []
    body, masses, load = body_of(scene, mesh, springs), masses_of(mesh), st.LOADS[scene.load]
    force = unit_force(scene) * scene.level
    if scene.way == "critical" and scene.load not in ("compression", "pressure", "follower-pressure"):
        force = 0.3 * unit_force(scene)
    elif scene.way == "critical":
        judge, guess = None, 1.6 * column(scene)
        if body.follower is not None:
            guess *= 8  # Beck's column carries eight times Euler's load

            def judge(unknowns, force):
                return not fluttering(body, unknowns, force, masses).size

        force = (body.critical(guess, judge) or guess / 1.6) * scene.level
    task = {
        "material": asdict(scene.material), "kind": load.kind.name, "follower": load.follower, "force": float(force),
        "definition": scene.definition, "kinematics": scene.kinematics, "stiffness": stiffness,
        "keep_fields": True,
    }  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AssumptionWarning)  # thick ones are drawn, too
        beam = st.Beam(scene.length, scene.height, scene.thickness)
    result = solve_scene(task, partial(solve_beam, beam, MeshCache(mesh, scene.thickness), None))
    if str(result["status"]) != "solved":
        return []
    check = check_linear if scene.kinematics == "linear" else partial(check_nonlinear, mesh, masses, path)
    return list(check(body, float(force), result["displacements"]))


def audit_snap(scene, path=True):
    """As `audit`, of an arch: solved as scenes of shapes are."""
    arch = scene.arch
    mesh, held, pattern, given, edges = arch.parts()
    try:
        springs = arch.springs(mesh)
    except (st.DefinitionError, SingularError):
        return []
    follower = pressure = judge = None
    if arch.load == "follower-pressure":
        follower = Part(edges, mechanics.follower_forces, np.ones(len(edges)))
        pressure = FollowerPressure(mesh, edges, 1.0)
    body = Body(mesh.points, held, pattern, parts_of(arch, mesh, springs), follower, 0.0 if given is None else given)
    masses = masses_of(mesh)
    if follower is not None:

        def judge(unknowns, force):
            return upright(body, unknowns, force, masses)

    # The load that would move it by three times its rise, were it linear, or shorten it by four times what buckles it.
    rest = np.zeros(body.size, LONG)
    soft = np.abs(body.solve(body.tangent(rest, 0.0), body.missing(rest, LONG(1.0)))).max()
    guess = 2 * arch.strip**2 if given is not None else 3 * arch.rise * arch.strip / float(soft)
    force = float(guess * (body.follow(guess, judge=judge)[1] or 1e-3) * scene.level)
    loading = scaled(Loading(("arch",), held, pattern, given, pressure), force)
    try:
        problem = MeshCache(mesh, arch.thickness).problem(loading, springs)
        found = solve_and_judge(problem, 1 / springs.reference, "nonlinear", lambda moved: 0.0)
    except SingularError:  # springs of no stiffness leave a mechanism
        return []
    if str(found.status) != "solved":
        return []
    return list(check_nonlinear(mesh, masses, path, body, force, found.equilibrium.displacements))


def scaled(loading, factor):
    """A loading times a factor."""
    follower = copy.copy(loading.follower)
    if follower is not None:
        follower.half, follower.derivative = factor * follower.half, factor * follower.derivative
    given = None if loading.given is None else factor * loading.given
    return replace(loading, pattern=factor * loading.pattern, given=given, follower=follower)


def distance(found, exact):
    return float(np.linalg.norm((found - exact).astype(float)) / (np.linalg.norm(exact.astype(float)) or 1.0))


def check_linear(body, force, displacements):
    """What is wrong with a linear answer."""
    exact, lowest = body.linear(force), body.lowest(np.zeros(body.size, LONG), 0.0)[0]
    if exact is None:
        yield "no linear solution found"
    elif distance(displacements.ravel()[body.free], exact) > PROMISED:
        yield f"error {distance(displacements.ravel()[body.free], exact):.1e}"
    if lowest <= 0:
        yield f"eigenvalue {lowest:.1e}"


def check_nonlinear(mesh, masses, path, body, force, displacements):
    """What is wrong with a nonlinear answer; the path from rest where nothing else is."""
    found, right = displacements.ravel()[body.free].astype(LONG), True
    exact = body.newton(found, force)
    if exact is None:
        yield "no equilibrium next to the answer"
        return
    if distance(found, exact) > PROMISED:
        right = False
        yield f"error {distance(found, exact):.1e}"
    if body.inside_out(exact, mesh.cells.values(), force):
        right = False
        yield "cells inside out"
    if body.follower is None:
        judge, lowest = None, body.lowest(exact, force)[0]
        if lowest <= 0:
            right = False
            yield f"eigenvalue {lowest:.1e}"
    else:
        modes = fluttering(body, exact, force, masses)
        if modes.size:
            right = False
            yield f"flutter of modes {modes}"

        def judge(unknowns, force):
            return upright(body, unknowns, force, masses)

    if path and right:
        end, share, why = body.follow(force, judge=judge)
        if why:
            yield f"path from rest: {why} beyond {100 * share:.4g} % of the load"
        elif distance(end, exact) > 1e-5:
            yield f"path from rest ends {distance(end, exact):.1e} away"
