"""Shallow arches, which snap: meshes of a bent strip, how they are held and loaded, and 36 of them."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import springtune as st
from springtune.mechanics.continuation import follow
from springtune.mechanics.network import FollowerPressure, Network
from springtune.mechanics.statics import StaticProblem

FORMS = {
    "sine": lambda x: np.sin(np.pi * x),
    "truss": lambda x: 1 - np.abs(2 * x - 1),  # von Mises
    "parabola": lambda x: 4 * x * (1 - x),
    "circle": lambda x: np.sqrt(1.5625 - (2 * x - 1) ** 2) / 0.5 - 1.5,  # a dome: rise to half-span as 1 to 2
    "straight": lambda x: 0 * x,
}
ENDS = {"clamped": (True, True), "pinned": (False, False), "mixed": (True, False)}
LOADS = ("point", "pressure", "follower-pressure", "gravity")
SNAPPING = ("sine", "truss", "parabola")
NAMES = ("uniform", "lattice", "patch", "area", "angular", "delingette", "van-gelder", "neo-hooke")


@dataclass(frozen=True)
class Arch:
    """An arch of span 1 m; `rise` is over the thickness of the strip, `rows` are edges across it."""

    form: str
    ends: str
    load: str
    definition: str
    rise: float
    strip: float = 0.02
    rows: int = 2
    mesh_type: str = "structured"
    poisson_ratio: float = 1 / 3
    thickness: ClassVar[float] = 1.0
    young_modulus: ClassVar[float] = 1e6

    def parts(self):
        """Mesh, directions held, forces of total 1, displacements given, edges of the upper side (body to the left)."""
        flat = st.MESH_TYPES[self.mesh_type](1.0, self.strip, self.strip / self.rows)
        x, y = flat.points.T
        mesh = st.Mesh(
            flat.points + np.stack([0 * x, self.rise * self.strip * FORMS[self.form](x)], axis=1), flat.triangles
        )
        held = np.zeros(mesh.points.shape, dtype=bool)
        for end, clamped in zip((0.0, 1.0), ENDS[self.ends], strict=True):
            there = np.flatnonzero(np.isclose(x, end))
            held[there if clamped else there[np.argsort(np.abs(y[there] - 0.5 * self.strip))[:1]]] = True
        top = np.flatnonzero(np.isclose(y, self.strip))
        top = top[np.argsort(x[top])]
        edges = np.stack([top[1:], top[:-1]], axis=1)
        pattern, given = np.zeros(mesh.points.shape), None
        if self.load == "shortening":
            given = np.zeros(mesh.points.shape)
            given[np.isclose(x, 1.0) & held[:, 0], 0] = -1.0
        elif self.load == "point":
            pattern[top[np.argmin(np.abs(x[top] - 0.5))], 1] = -1.0
        elif self.load == "gravity":
            pattern[:, 1] = -mesh.particle_areas / mesh.area
        else:
            pattern = FollowerPressure(mesh, edges, 1.0).forces(pattern)
        return mesh, held, pattern, given, edges

    def springs(self, mesh):
        """Springs of its definition; a uniform stiffness is 0.85 E t."""
        material = st.Material(self.young_modulus, self.poisson_ratio, name="arch")
        definition = st.DEFINITIONS[self.definition]
        return definition.springs(
            mesh, material, self.thickness, 0.85 * self.young_modulus if definition.needs else None
        )

    def problem(self):
        """The arch as the library has it."""
        mesh, held, pattern, given, edges = self.parts()
        springs = self.springs(mesh)
        network = Network(mesh, held, springs.relative, springs.energies)
        follower = FollowerPressure(mesh, edges, 1.0) if self.load == "follower-pressure" else None
        return StaticProblem(network, pattern, follower, given=given)


def draw():
    """36 arches that snap or buckle: every form, ends and load together, eight definitions in turn."""
    rng = np.random.default_rng(5)
    return [
        Arch(form, ends, load, NAMES[number % len(NAMES)], float(rng.uniform(2.0, 3.6)))
        for number, (load, ends, form) in enumerate((a, b, c) for a in LOADS for b in ENDS for c in SNAPPING)
    ]


def limit(problem):
    """Load at which the path from rest loses its stability [m], by arc length and then by halves; and how it does."""
    height = np.ptp(problem.network.mesh.points[:, 1])
    guess = 0.5 * height / np.abs(problem.slope).max()
    step = float(np.linalg.norm(guess * problem.slope)) / 15
    path = follow(problem, 50 * guess, increment=step, most_points=600, limit=100 * step)
    lost = int(np.flatnonzero(path.negative_pivots)[0])
    if path.loads[lost] < path.loads[lost - 1]:  # a limit point, between these
        return float(path.loads[: lost + 1].max()), "limit point"
    low, high, here = path.loads[lost - 1], path.loads[lost], path.displacements[lost - 1]
    while high - low > 1e-4 * high:
        middle = 0.5 * (low + high)
        found = problem.newton(middle, here)
        if found.converged and problem.stability(middle, found.displacements, found.factor)[0] == 0:
            low, here = middle, found.displacements
        else:
            high = middle
    return float(low), "bifurcation"
