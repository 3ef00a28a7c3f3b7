"""Random scenes solved as a study solves them, and each answer checked by the mechanics of `mechanics`.

    python tests/physics/audit.py --scenes 2000 --seed 1
    python tests/physics/audit.py --scenes 500 --seed 1 --snaps

prints how many scenes ended in which status, and every one whose answer is wrong. A ``solved`` scene is wrong where

- its displacements are further than `PROMISED` from the equilibrium next to them, or none is next to them;
- that equilibrium has a negative eigenvalue, or under a following pressure two of its lowest modes have merged
  (flutter);
- it is not on the path that leads from rest, step by step, through equilibria without a negative eigenvalue. (Flutter
  on the way is no matter of where the path leads.)

Higher modes that have merged, which are the mesh's rather than the sheet's and which little damping holds, are counted
beside with the damping ratio that they need, and so is what is refused though the path reaches its load stably. Scenes
depend on seed and number alone, so ``--only 17`` shows one of them again.
"""

import argparse
import copy
import math
import time
from collections import Counter
from dataclasses import asdict, dataclass, field, replace

import numpy as np

from arches import ENDS, Arch
from mechanics import (
    LONG,
    Body,
    Part,
    angle_forces,
    angles_of,
    area_forces,
    area_of,
    element_forces,
    follower_forces,
    rubber_forces,
    spring_forces,
    squares_forces,
)
from springtune.linalg.factors import SingularError
from springtune.mechanics.network import FollowerPressure
from springtune.mesh import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.problem.materials import Material
from springtune.scene.sheet import Loading, Sheet, solved
from springtune.springs import DEFINITIONS, DefinitionError
from springtune.studies.kinds.scenes.solve import solved as solve_scene

PROMISED = 1e-6
"""Largest error of the displacements of a solved scene, relative: `springtune.mechanics.newton.CORRECTION`."""

MERGED = 1e-6
"""Imaginary part of an eigenvalue over its size from which two modes have merged; a load 1e-6 above the one that merges
them gives some 1e-3."""

ROUNDING = 1e-12
"""Imaginary part over the largest eigenvalue that rounding may give."""

LOW = 24
"""Modes below this number, from the lowest, are those that tell of flutter: `springtune.mechanics.statics.MODES`."""

WAYS = ("moderate", "critical", "large")
"""How far a scene is loaded: within the linear range, next to the loss of stability, or far beyond the linear range."""


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
        return Material(self.young_modulus, self.poisson_ratio, name="drawn")


@dataclass
class Verdict:
    """What the library said of a scene and what is wrong with it, empty where nothing is."""

    scene: Scene
    status: str = ""
    message: str = ""
    wrong: list = field(default_factory=list)
    refused: str = ""
    force: float = math.nan
    error: float = math.nan
    lowest: float = math.nan
    held: dict = field(default_factory=dict)
    unknowns: int = 0


def draw(seed, number):
    """Scene of a seed and a number."""
    rng = np.random.default_rng([seed, number])
    mesh_type = str(rng.choice(list(MESH_TYPES)))
    corners = 4 if mesh_type == "braced" else 3
    load = str(rng.choice(list(LOADS)))
    kind = LOADS[load].kind.name
    names = [
        name
        for name, definition in DEFINITIONS.items()
        if corners in definition.cells
        and (LOADS[load].kind.uniaxial or not definition.uniaxial)
        and definition.needs in ("", "stiffness")
        and name != "yeoh"  # of tested rubber alone
    ]
    if mesh_type not in ("isosceles-0.3", "isosceles-0.5", "braced"):
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
    count = 30 * 10 ** rng.uniform(0, 0.7 if LOADS[load].follower else 1.1)
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
    kinematics = "nonlinear"
    load = property(lambda self: f"{self.arch.form} {self.arch.load}")
    mesh_type = property(lambda self: self.arch.mesh_type)


def draw_snap(seed, number):
    """Arch of a seed and a number."""
    rng = np.random.default_rng([seed, number, 1])
    form = str(rng.choice(["sine", "truss", "parabola", "circle", "straight"], p=[0.2, 0.25, 0.2, 0.2, 0.15]))
    load = str(rng.choice(["point", "pressure", "follower-pressure", "gravity"]))
    if form == "circle" and rng.random() < 0.7:
        load = "follower-pressure"
    if form == "straight":
        load = "shortening"
    names = [
        name
        for name, definition in DEFINITIONS.items()
        if 3 in definition.cells
        and not definition.uniaxial
        and definition.needs in ("", "stiffness")
        and name not in ("yeoh", "axis-exact", "adjoint", "annealed", "evolved")
    ]
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
    kind, side = LOADS[scene.load].kind.name, scene.height
    if kind == "bending":
        size = scene.height**3 / (12 * scene.length**2)
    else:
        size = scene.length if kind in ("shear", "face") else side
    return LOADS[scene.load].sign * scene.young_modulus * scene.thickness * size


def column(scene):
    """Euler's load of a column that leans, of the sign of the load, less what shear takes."""
    kind = LOADS[scene.load].kind.name
    along, across = (scene.height, scene.length) if kind == "face" else (scene.length, scene.height)
    euler = math.pi**2 / 48 * (across / along) ** 2
    return unit_force(scene) * euler / (1 + 3.2 * euler)


def body_of(scene, mesh, springs):
    """The scene's body in the mechanics of the audit: energies from the definitions' formulas."""
    x, height, length = mesh.points, scene.height, scene.length
    kind, nu = LOADS[scene.load].kind.name, scene.poisson_ratio
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
    if LOADS[scene.load].follower and scene.kinematics == "nonlinear":
        ends = np.stack([order[:-1], order[1:]], axis=1)
        follower = Part(ends, follower_forces, np.full(len(ends), 1 / length))

    return Body(x, held, pattern, parts_of(scene, mesh, springs), follower)


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
            parts.append(Part(corners, area_forces, np.full(len(corners), modulus * young * t), area))
        elif scene.definition == "angular":
            squares = 4 / math.sqrt(3) * area
            modulus = squares * young * t * (1 - 3 * nu) / (6 * math.sqrt(3) * (1 - nu**2))
            parts.append(Part(corners, angle_forces, modulus, angles_of(rest)[0]))
        elif scene.definition == "delingette":
            sides = np.stack([rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]], axis=2)
            turned = np.stack([[sides[:, 1, 1], -sides[:, 0, 1]], [-sides[:, 1, 0], sides[:, 0, 0]]])
            inverse = (turned / (2 * area)).transpose(2, 0, 1)
            moduli = [np.full(len(corners), young * t * m) for m in (nu / (1 - nu**2), 1 / (2 * (1 + nu)))]
            parts.append(Part(corners, element_forces, inverse, area, *moduli))
        elif scene.definition == "neo-hooke":
            sides = np.stack([rest[:, 1] - rest[:, 0], rest[:, 2] - rest[:, 0]], axis=2)
            turned = np.stack([[sides[:, 1, 1], -sides[:, 0, 1]], [-sides[:, 1, 0], sides[:, 0, 0]]])
            inverse = (turned / (2 * area)).transpose(2, 0, 1)
            bulk = 0.0 if nu >= 0.5 else young * t / (3 * (1 - 2 * nu))
            moduli = [np.full(len(corners), one) for one in (young * t / (2 * (1 + nu)), bulk)]
            parts.append(Part(corners, rubber_forces, inverse, area, *moduli))
        elif scene.definition == "delingette-tensile":
            first, second = young * t * nu / (1 - nu**2), young * t / (1 + nu)
            angles, a, b = angles_of(rest)
            stiffness = (2 * (first + second) / np.tan(angles) ** 2 + second) / (16 * area[:, None])
            opposite = b - a
            parts.append(Part(corners, squares_forces, stiffness, (opposite**2).sum(axis=2)))
        elif springs.energies:
            raise ValueError(f"the energies of '{scene.definition}' are not in the audit; write them in mechanics.py")
    return parts


def masses_of(mesh):
    """Share of each particle in the area of its cells."""
    shares = np.zeros(len(mesh.points))
    for count, corners in mesh.cells.items():
        np.add.at(shares, corners.ravel(), np.repeat(area_of(mesh.points[corners]) / count, count))
    return shares


def merged_modes(body, unknowns, force, masses):
    """Modes whose eigenvalue is negative or complex, by their place from the lowest, and the damping that holds each.

    Returns
    -------
    fluttering, held : dict of int to float
        Ratio of damping to the critical one from which a merged mode decays, infinite where it is negative: of modes
        that make the body unstable, and of higher ones that little damping holds.
    """
    values = body.modes(unknowns, force, masses)
    bad = np.flatnonzero((np.abs(values.imag) > MERGED * np.abs(values) + ROUNDING) | (values.real < 0))
    # The frequency is the root of the eigenvalue: its imaginary part over its real one is half of the eigenvalue's.
    needed = {int(i): float(abs(values[i].imag) / (2 * values[i].real)) if values[i].real > 0 else np.inf for i in bad}
    fluttering = {mode: ratio for mode, ratio in needed.items() if mode < LOW or ratio == np.inf}
    return fluttering, {mode: ratio for mode, ratio in needed.items() if mode not in fluttering}


def solve(scene, mesh, force, stiffness):
    """The scene's result by the recipe of a study's jobs."""
    task = {
        "material": asdict(scene.material),
        "kind": LOADS[scene.load].kind.name,
        "follower": LOADS[scene.load].follower,
        "force": force,
        "definition": scene.definition,
        "kinematics": scene.kinematics,
        "reference": None,
        "stiffness": stiffness,
    }
    return solve_scene(Sheet(mesh, scene.thickness), task | {"keep_fields": True})


def audit(scene, path=True):
    """Solve a scene and check the answer.

    Parameters
    ----------
    scene : Scene
    path : bool
        Whether to follow the path from rest where that is not needed to tell a refusal from a wrong one.

    Returns
    -------
    Verdict
    """
    verdict = Verdict(scene)
    mesh = MESH_TYPES[scene.mesh_type](scene.length, scene.height, scene.size)
    stiffness = 0.85 * scene.young_modulus * scene.thickness if DEFINITIONS[scene.definition].needs else None
    try:
        springs = DEFINITIONS[scene.definition].springs(mesh, scene.material, scene.thickness, stiffness)
    except DefinitionError as error:
        verdict.status, verdict.message = "no network", str(error)
        return verdict
    body = body_of(scene, mesh, springs)
    verdict.unknowns = body.size
    masses = masses_of(mesh)

    def sound(unknowns, force):
        if body.follower is None:
            return body.stable(unknowns, force)
        return not merged_modes(body, unknowns, force, masses)[0]

    def upright(unknowns, force):
        values = body.modes(unknowns, force, masses)
        return not ((values.real < 0) & (np.abs(values.imag) <= MERGED * np.abs(values) + ROUNDING)).any()

    force = unit_force(scene) * scene.level
    if scene.way == "critical":
        guess = 1.6 * column(scene) if scene.load in ("compression", "pressure", "follower-pressure") else None
        if guess is None:
            force = unit_force(scene) * 0.3
        else:
            if body.follower is not None:
                guess *= 8  # Beck's column carries eight times Euler's load
            force = (body.critical(guess, sound if body.follower else None) or guess / 1.6) * scene.level
    verdict.force = force = float(force)
    result = solve(scene, mesh, force, stiffness)
    verdict.status, verdict.message = str(result["status"]), result["message"]
    if scene.kinematics == "linear":
        _check_linear(verdict, body, force, result)
    else:
        _check_nonlinear(verdict, body, force, result, mesh, masses, upright if body.follower else None, path)
    return verdict


def audit_snap(scene, path=True):
    """As `audit`, of an arch: solved as scenes of shapes are."""
    verdict, arch = Verdict(scene), scene.arch
    mesh, held, pattern, given, edges = arch.parts()
    try:
        springs = arch.springs(mesh)
    except (DefinitionError, SingularError) as error:
        verdict.status, verdict.message = "no network", str(error)
        return verdict
    follower = pressure = None
    if arch.load == "follower-pressure":
        follower = Part(edges, follower_forces, np.ones(len(edges)))
        pressure = FollowerPressure(mesh, edges, 1.0)
    body = Body(mesh.points, held, pattern, parts_of(arch, mesh, springs), follower, 0.0 if given is None else given)
    verdict.unknowns, masses = body.size, masses_of(mesh)

    def upright(unknowns, force):
        values = body.modes(unknowns, force, masses)
        return not ((values.real < 0) & (np.abs(values.imag) <= MERGED * np.abs(values) + ROUNDING)).any()

    judge = upright if follower is not None else None
    # The load that would move it by three times its rise, were it linear, or shorten it by four times what buckles it.
    rest = np.zeros(body.size, LONG)
    soft = np.abs(body.solve(body.tangent(rest, 0.0), body.missing(rest, LONG(1.0)))).max()
    guess = 2 * arch.strip**2 if given is not None else 3 * arch.rise * arch.strip / float(soft)
    share = body.follow(guess, judge=judge)[1]
    verdict.force = force = float(guess * (share or 1e-3) * scene.level)
    loading = Loading(("arch",), held, pattern, given, pressure)
    problem = Sheet(mesh, arch.thickness).problem(replace_scale(loading, force), springs)
    found = solved(problem, 1 / springs.reference, "nonlinear", lambda moved: 0.0)
    verdict.status, verdict.message = str(found.status), found.message
    result = {"displacements": found.equilibrium.displacements}
    _check_nonlinear(verdict, body, force, result, mesh, masses, judge, path)
    return verdict


def replace_scale(loading, factor):
    """A loading times a factor."""
    follower = loading.follower
    if follower is not None:
        follower = copy.copy(follower)
        follower.half, follower.derivative = factor * follower.half, factor * follower.derivative
    given = None if loading.given is None else factor * loading.given
    return replace(loading, pattern=factor * loading.pattern, given=given, follower=follower)


def _distance(found, exact):
    return float(np.linalg.norm((found - exact).astype(float)) / (np.linalg.norm(exact.astype(float)) or 1.0))


def _check_linear(verdict, body, force, result):
    exact = body.linear(force)
    rest = np.zeros(body.size, LONG)
    verdict.lowest = body.lowest(rest, 0.0)[0]
    if verdict.status != "solved":
        if exact is not None and verdict.lowest > 0 and verdict.status != "failed":
            verdict.refused = "though the linear network has a stable equilibrium"
        return
    if exact is None:
        verdict.wrong.append("no linear solution found")
        return
    verdict.error = _distance(result["displacements"].ravel()[body.free], exact)
    if verdict.error > PROMISED:
        verdict.wrong.append(f"error {verdict.error:.1e}")
    if verdict.lowest <= 0:
        verdict.wrong.append(f"eigenvalue {verdict.lowest:.1e}")


def _check_nonlinear(verdict, body, force, result, mesh, masses, judge, path):
    if verdict.status != "solved":
        if verdict.status == "failed":
            return
        end, share, why = body.follow(force, judge=judge)
        if not why and not body.inside_out(end, mesh.cells.values(), force):
            verdict.lowest = float(body.lowest(end, force)[0]) if body.follower is None else math.nan
            flutters = body.follower is not None and merged_modes(body, end, force, masses)[0]
            if not flutters and not verdict.lowest <= 0:  # by less than what ends a path
                verdict.refused = "though the path from rest is stable up to the load"
        return
    found = result["displacements"].ravel()[body.free].astype(LONG)
    exact = body.newton(found, force)
    if exact is None:
        verdict.wrong.append("no equilibrium next to the answer")
        return
    verdict.error = _distance(found, exact)
    if verdict.error > PROMISED:
        verdict.wrong.append(f"error {verdict.error:.1e}")
    if body.inside_out(exact, mesh.cells.values(), force):
        verdict.wrong.append("cells inside out")
    if body.follower is None:
        verdict.lowest = body.lowest(exact, force)[0]
        if verdict.lowest <= 0:
            verdict.wrong.append(f"eigenvalue {verdict.lowest:.1e}")
    else:
        fluttering, verdict.held = merged_modes(body, exact, force, masses)
        if fluttering:
            modes = ", ".join(f"{mode} ({ratio:.1e})" for mode, ratio in fluttering.items())
            verdict.wrong.append(f"flutter: modes (damping that holds each) {modes} of {body.size}")
    if path and not verdict.wrong:
        end, share, why = body.follow(force, judge=judge)
        if why:
            verdict.wrong.append(f"path from rest: {why} beyond {100 * share:.4g} % of the load")
        elif _distance(end, exact) > 1e-5:
            verdict.wrong.append(f"path from rest ends {_distance(end, exact):.1e} away")


def main():
    """Audit random scenes and print what came of them."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--snaps", action="store_true", help="audit arches, trusses, domes and columns, not rectangles")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="audit this scene alone")
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    asked = parser.parse_args()
    numbers = range(asked.first, asked.first + asked.scenes) if asked.only is None else [asked.only]
    begin, verdicts = time.perf_counter(), []
    for number in numbers:
        if asked.snaps:
            verdict = audit_snap(draw_snap(asked.seed, number))
        else:
            verdict = audit(draw(asked.seed, number), path=number % 3 == 0)
        verdicts.append(verdict)
        if verdict.wrong or verdict.refused or verdict.held or asked.only is not None:
            said = "; ".join(verdict.wrong) or verdict.refused or "higher modes merged" * bool(verdict.held)
            print(f"{asked.seed}:{number} {verdict.status} [{verdict.message}] {said} | {verdict}", flush=True)
    print(summary(verdicts))
    print(f"{time.perf_counter() - begin:.0f} s")


def summary(verdicts):
    """Counts of a run, as text."""
    lines = [f"{len(verdicts)} scenes, {len({v.scene for v in verdicts})} different"]
    for title, value in (
        ("status", lambda v: v.status),
        ("wrong by load", lambda v: v.scene.load if v.wrong else None),
        ("wrong by way", lambda v: v.scene.way if v.wrong else None),
        ("wrong by mesh type", lambda v: v.scene.mesh_type if v.wrong else None),
        ("wrong for", lambda v: " and ".join(w.split()[0] for w in v.wrong) if v.wrong else None),
        ("solved with higher modes merged", lambda v: v.scene.load if v.held and not v.wrong else None),
        ("refused though stable", lambda v: f"{v.status}, {v.scene.load}, {v.scene.way}" if v.refused else None),
    ):
        counts = Counter(value(v) for v in verdicts)
        counts.pop(None, None)
        lines.append(f"{title}: " + (", ".join(f"{name} {n}" for name, n in counts.most_common()) or "none"))
    ratios = [ratio for v in verdicts for ratio in v.held.values()]
    if ratios:
        lines.append(f"damping ratio that holds these: {min(ratios):.1e} to {max(ratios):.1e}")
    errors = np.array([v.error for v in verdicts if not math.isnan(v.error)])
    if len(errors):
        lines.append(f"error of solved scenes: median {np.median(errors):.1e}, largest {errors.max():.1e}")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
