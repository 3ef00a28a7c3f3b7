"""Boundary-value problems of scenes: a beam under a force, or a shape under a load case."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from ..mechanics.continuum import cell_stresses, particle_stresses
from ..mechanics.energies import area_slopes
from ..mechanics.network import FollowerPressure, Network
from ..mesh.cells import Mesh
from ..mesh.sheets import GroupedMesh, box_fault, part_names, parts_of
from ..mesh.sides import OutlineSide, distances, in_words
from ..problem import boundary
from ..problem.loads import LOADS, Load, LoadKind
from ..problem.materials import AnyMaterial, Material, Materials, materials_by_part
from ..problem.quantities import choose, positive
from ..problem.shapes import Beam, LoadCase, Quantity, Shape, warn_of_body
from ..reference.answers import beyond_linear
from ..springs.base import Definition, DefinitionError, Springs
from .mesh_cache import Loading, MeshCache, Solution, check_type, solve_and_judge

if TYPE_CHECKING:
    from ..reference.finite_strain import FiniteStrainSolution
    from ..reference.shapes import ShapeReference
    from ..reference.small_strain import ReferenceSolution

    AnyReference = ReferenceSolution | FiniteStrainSolution | ShapeReference

MOST_GAP = 1e-6  # largest gap between a mesh and its beam, over the beam's extent


MOST_DISTANCE_FROM_SIDE = 1e-5
"""Largest distance of a particle from its side of a shape, over its extent: text formats have few digits."""

LEAST_COVERED = 0.9
"""Least length of a group's edges over the length of its sides: six chords are 5 % shorter than a circle."""


class BoundaryProblem(ABC):
    """A body under a load; `force` is the factor of `loading`, and `size` the force [N] or a case's scale."""

    body: str
    label: str
    load: str
    force: float
    size: float
    kinematics: str
    thickness: float
    grouped: GroupedMesh
    case: LoadCase
    loading: Loading
    by_part: Mapping[str, AnyMaterial]
    cache: MeshCache

    @property
    def mesh(self) -> Mesh:
        """Mesh of the body."""
        return self.grouped.mesh

    @property
    def materials(self) -> list[AnyMaterial]:
        """Materials of the parts, each once."""
        return list(dict.fromkeys(self.by_part.values()))

    @property
    def named_materials(self) -> str:
        """Names of the materials."""
        return ", ".join(dict.fromkeys(one.name for one in self.materials))

    @abstractmethod
    def check(self, definition: Definition) -> None:
        """Refuse a definition that is not for the body or the load."""

    @abstractmethod
    def reference(self, law: str = "") -> "AnyReference":
        """Converged finite-element solution, in small strain or of a law at finite strain."""

    def reference_values(self, law: str = "") -> dict[str, float]:
        """Quantities of interest of the reference."""
        found: Any = self.reference(law)  # of a shape
        return dict(found.values)

    def law(self, definition: Definition) -> str:
        """Law at finite strain of the reference of a definition's network; empty for a small-strain reference."""
        return definition.law if self.kinematics == "nonlinear" else ""

    def objection(self) -> str:
        """Why the small-strain reference does not apply to networks of nonlinear kinematics; empty if it does."""
        found: Any = self.reference()  # in small strain
        return beyond_linear(found.rotation, found.strain)

    def springs(self, definition: Definition, stiffness: float | None) -> tuple[Springs, float]:
        """Springs of a definition, and the seconds that deriving them took."""
        case = None
        if definition.needs == "cases":
            case = self.loading, self.force, self.reference().at(self.mesh.points) / self.force
        return self.cache.derive(definition, self.by_part, stiffness, case, self.grouped)

    def forces(self, springs: Springs) -> np.ndarray:
        """Forces on the particles at rest [N], shape (n_points, 2)."""
        return self.force * self.cache.pattern(self.loading, springs)

    def masses(self) -> np.ndarray | None:
        """Masses of the particles [kg], shape (n_points,); None without a density."""
        densities = {name: one.density for name, one in self.by_part.items()}
        return None if None in densities.values() else boundary.particle_masses(self.grouped, self.thickness, densities)

    def solve(self, springs: Springs) -> Solution:
        """Equilibrium, judged; its displacement is the first quantity of interest."""
        problem = self.cache.problem(self.loading, springs)
        value = partial(self._value, self.case.quantities[0], springs, problem.network)
        return solve_and_judge(problem, self.force / springs.reference, self.kinematics, value)

    @property
    def watched(self) -> Quantity | None:
        """First displacement among the quantities."""
        return next((one for one in self.case.quantities if one.kind == "displacement"), None)

    def displacement(self, displacements: np.ndarray) -> float:
        """First displacement among the quantities [m]; NaN where there is none."""
        return self._displacement(self.watched, displacements) if self.watched else np.nan

    def _displacement(self, one: Quantity, moved: np.ndarray) -> float:
        """Displacement of interest [m]."""
        return float(np.tensordot(moved, boundary.displacement_weights(self.grouped, one), axes=2))

    def empty(self) -> dict[str, float]:
        """Values of the quantities of interest if there is no equilibrium: NaN."""
        return dict.fromkeys((one.name for one in self.case.quantities), np.nan)

    def values(self, springs: Springs, solution: Solution) -> dict[str, float]:
        """Quantities of interest by name, in SI units; NaN without an equilibrium."""
        if not solution.equilibrium.converged:
            return self.empty()
        first, *others = self.case.quantities
        network, moved = solution.problem.network, solution.equilibrium.displacements
        rest = {one.name: self._value(one, springs, network, moved) for one in others}
        return {first.name: solution.displacement} | rest

    def _value(self, one: Quantity, springs: Springs, network: Network, moved: np.ndarray) -> float:
        """Quantity of interest at displacements [m], in SI units."""
        linear = self.kinematics == "linear"
        if one.kind == "displacement":
            return self._displacement(one, moved)
        if one.kind == "area":
            return _growth(self.mesh, moved, linear)
        if one.kind == "energy":
            if linear:
                return float(0.5 * springs.reference * np.tensordot(moved, network.linear_forces_over_k(moved), axes=2))
            return springs.reference * network.energy_over_k(moved)
        if one.kind == "reaction":
            weights = boundary.reaction_weights(self.grouped, self.case, one)
            return float(np.tensordot(self.reactions(springs, network, moved), weights, axes=2))
        corners, cell, shares = boundary.cell_at(self.grouped, one.of)
        stresses, names = cell_stresses(network, moved, linear), part_names(self.grouped)
        same = {count: labels == names[corners][cell] for count, labels in names.items()}
        found = shares @ particle_stresses(self.mesh, stresses, same)[self.mesh.cells[corners][cell]]
        return float(found[("xx", "yy", "xy").index(one.component)] * springs.reference / self.thickness)

    def reactions(self, springs: Springs, network: Network, moved: np.ndarray) -> np.ndarray:
        """Forces of the supports on the particles [N], shape (n_points, 2); zero in free directions."""
        linear, loading = self.kinematics == "linear", self.loading
        resistance = network.linear_forces_over_k(moved) if linear else network.forces_over_k(moved)
        load = loading.pattern
        if loading.follower is not None and loading.dead is not None:
            load = loading.dead + loading.follower.forces(moved)
        return np.where(loading.held, springs.reference * resistance - load, 0.0)


class BeamProblem(BoundaryProblem):
    """A beam under a load: a shape with four named sides, under a force on one of them."""

    def __init__(
        self,
        beam: Beam,
        mesh: Mesh | GroupedMesh,
        material: Materials,
        load: str | Load,
        force: float | str | None,
        kinematics: str,
        cache: MeshCache | None = None,
    ) -> None:
        check_type(beam, Beam, "beam")
        mesh = check_type(mesh, Mesh, "mesh")
        self.material: Material = check_type(material, Material, "material")
        self.cache = cache_of(mesh, beam.thickness, cache)
        if beam not in self.cache.filled:
            check_filled(mesh, beam)
            self.cache.filled.add(beam)
        self.load, about = (load.kind.name, load) if isinstance(load, Load) else (load, choose(LOADS, load, "load"))
        if force is None:
            raise ValueError("force: none; give the size of the force on the beam such as '400 kN'")
        self.size = positive(force, "force", "force")
        self.force = about.sign * self.size
        self.beam, self.kind, self.case = beam, about.kind, about.kind.case
        self.kinematics, self.follower = kinematics, about.follower and kinematics == "nonlinear"
        self.body, self.label, self.thickness = beam.label, f"{self.load} of {self.size:g} N", beam.thickness
        self.by_part = {"": self.material}
        self.grouped, self.loading = self.cache.loaded(self.kind), self.cache.loading(self.kind, self.follower)

    def check(self, definition: Definition) -> None:
        """Refuse a definition that is not for the load."""
        if definition.uniaxial and not self.kind.uniaxial:
            raise ValueError(f"definition: {definition.name!r} is not for {self.load!r}; take it for traction")

    def reference(self, law: str = "") -> "ReferenceSolution | FiniteStrainSolution":
        """Converged finite-element solution, in small strain or of the material's law at finite strain."""
        if law:
            from ..reference.finite_strain import solve_finite_strain  # here, since finite elements are slow to import

            problem = self.beam, self.material, self.force, self.kind, "", self.follower
            return _solve_once(solve_finite_strain, *problem)
        return unit_reference(self.beam, self.material, self.kind, self.force)

    def reference_values(self, law: str = "") -> dict[str, float]:
        """Displacement of the reference [m]."""
        return {"displacement": self.reference(law).displacement}

    def _displacement(self, one: Quantity, moved: np.ndarray) -> float:
        """Displacement of the loaded side [m], by weights that the loads of a kind share."""
        return self.cache.displacement(self.kind, moved)

    def law(self, definition: Definition) -> str:
        """Law of the reference at finite strain: rubber's, or none."""
        return "rubber" if definition.finite_strain and self.kinematics == "nonlinear" else ""


class ShapeProblem(BoundaryProblem):
    """A shape under one of its load cases, times `scale` [1]."""

    def __init__(
        self,
        shape: Shape,
        grouped: GroupedMesh | Mesh,
        material: Materials,
        load: str,
        scale: float,
        kinematics: str,
        cache: MeshCache | None = None,
    ) -> None:
        check_type(shape, Shape, "shape")
        grouped = check_type(grouped, GroupedMesh, "mesh")
        self.shape, self.grouped, self.thickness = shape, grouped, shape.thickness
        self.by_part = _materials(material, grouped)
        check_meshed(shape, grouped, self.by_part)
        if shape.file:
            warn_of_body(np.ptp(self.mesh.points, axis=0), shape.thickness, f"shape {shape.name!r}")
        if isinstance(scale, bool) or not (isinstance(scale, Real) and np.isfinite(scale) and scale):
            raise ValueError(f"scale: {scale!r} is no factor; give a finite number that is not zero")
        self.scale: float = float(scale)
        self.size, self.force = abs(self.scale), 1.0
        self.case = scaled(choose(shape.loads, load, "load"), self.scale)
        self.load, self.cache = self.case.name, cache_of(self.mesh, self.thickness, cache)
        if not self.case.quantities:
            raise ValueError(f"load {load!r}: has no quantities; give it some, the main one first")
        self.kinematics = kinematics
        factor = "" if self.scale == 1 else f" times {self.scale:g}"
        self.body, self.label = shape.name, f"{load}{factor}"
        self.loading = self._loading()
        for one in self.case.quantities:
            self._check(one)

    def _loading(self) -> Loading:
        boundary.check_case(self.grouped, self.case)
        held, given = boundary.support_directions(self.grouped, self.case)
        densities = {name: one.density for name, one in self.by_part.items()}
        all_forces = partial(boundary.forces, self.grouped, self.case, self.thickness, densities)
        pattern = all_forces()
        if not (pattern[~held].any() or given.any()):
            raise ValueError(f"load {self.load!r}: neither pulls what is free nor moves a support; give a force")
        edges, pressure = boundary.follower_edges(self.grouped, self.case, self.thickness)
        turning = self.kinematics == "nonlinear" and len(edges) > 0
        key = self.grouped, self.case, self.thickness, tuple(densities.items()), turning
        follower = FollowerPressure(self.mesh, edges, pressure) if turning else None
        dead = all_forces(followers=False) if turning else None
        return Loading(key, held, pattern, given if given.any() else None, follower, dead)

    def _check(self, one: Quantity) -> None:
        """Refuse a stress where different materials meet; `boundary.check_case` refuses other quantities."""
        if one.kind != "stress" or (particle := self.grouped.particle(one.of)) is None:
            return
        found = set()
        for count, labels in part_names(self.grouped).items():
            found |= {self.by_part[name] for name in labels[(self.mesh.cells[count] == particle).any(axis=1)]}
        if len(found) > 1:
            why = f"{one.of!r} is where different materials meet; ask for the stress on one side"
            raise ValueError(f"load {self.load!r}, quantity {one.name!r}: {why}")

    def check(self, definition: Definition) -> None:
        """Refuse a definition that is for beams alone."""
        if definition.uniaxial:
            raise ValueError(f"definition: {definition.name!r} is for loads that stretch a beam; choose another")
        if definition.needs == "cases" and self.loading.given is not None:
            why = f"is for forces, and load {self.load!r} prescribes displacements"
            raise ValueError(f"definition: {definition.name!r} {why}; choose another definition")

    def springs(self, definition: Definition, stiffness: float | None) -> tuple[Springs, float]:
        """Springs of a definition, and the seconds that deriving them took."""
        found = super().springs(definition, stiffness)
        if found[0].lateral:
            raise DefinitionError("needs a stress on the long faces of a beam; choose another definition")
        return found

    def reference(self, law: str = "") -> "ShapeReference":
        """Converged finite-element solution, once for all scenes of a cache."""
        case = self.case if law else self.shape.loads[self.load]
        as_read = self.grouped if self.shape.file else None
        # The shape is kept too, so that its id is not used again.
        key = id(self.shape), self.grouped, case, tuple(self.by_part.items()), law
        if key not in self.cache.references:
            if law:
                from ..reference.finite_shapes import solve_finite_shape  # here, as below

                found = solve_finite_shape(self.shape, case, self.by_part, as_read, law)
            else:
                from ..reference.shapes import solve_shape  # here, since finite elements take half a second to import

                found = solve_shape(self.shape, case, self.by_part, as_read)
            self.cache.references[key] = self.shape, found
        reference = self.cache.references[key][1]
        return reference if law or self.scale == 1 else reference.scaled(self.scale)

    def law(self, definition: Definition) -> str:
        """Law of the reference; St. Venant and Kirchhoff's only where small strain does not apply."""
        law = super().law(definition)
        return "" if law == "st-venant" and not self.objection() else law


def cache_of(mesh: Mesh, thickness: float, cache: MeshCache | None) -> MeshCache:
    """Return the cache of another scene, if it is of this mesh and thickness, or a new one."""
    if cache is None:
        return MeshCache(mesh, thickness)
    if not isinstance(cache, MeshCache) or cache.mesh is not mesh or cache.thickness != thickness:
        raise ValueError(f"cache: {cache!r} is not of this mesh and thickness; give that of a scene like this, or none")
    return cache


def scaled(case: LoadCase, scale: float) -> LoadCase:
    """Load case with all that it prescribes times a factor."""
    if scale == 1:
        return case

    def times(value: float | None, power: int = 1) -> float | None:
        return None if value is None else value * scale**power

    return LoadCase(
        case.name,
        tuple(replace(one, x=times(one.x), y=times(one.y)) for one in case.supports),
        tuple(replace(one, force=(scale * one.force[0], scale * one.force[1])) for one in case.tractions),
        tuple(replace(one, pressure=scale * one.pressure) for one in case.pressures),
        (scale * case.gravity[0], scale * case.gravity[1]),
        tuple(replace(one, expected=times(one.expected, 2 if one.kind == "energy" else 1)) for one in case.quantities),
    )


def _materials(material: Materials, grouped: GroupedMesh) -> dict[str, AnyMaterial]:
    """Return the material of each part of the mesh; refuse missing and unknown ones."""
    parts = parts_of(grouped)
    given = dict(material) if isinstance(material, Mapping) else {"": material}
    for name, one in given.items():
        check_type(one, AnyMaterial, f"material of part {name!r}" if name else "material")
        if name and name not in parts:
            known = f"is no part of the mesh; known: {', '.join(map(repr, parts))}"
            raise ValueError(f"material: {name!r} {grouped.unusable.get(name, known)}")
    return materials_by_part(given, parts)


def _growth(mesh: Mesh, displacements: np.ndarray, linear: bool) -> float:
    """Growth of the area of a mesh [m2]."""
    total = 0.0
    for corners in mesh.cells.values():
        moved = displacements[corners] - displacements[corners[:, :1]]
        middle = mesh.points[corners] + (0.0 if linear else 0.5 * moved)
        total += float((area_slopes(middle.T) * moved.T).sum())
    return total


def check_filled(mesh: Mesh, beam: Beam) -> None:
    """Refuse a mesh that does not fill its beam exactly once, as its reference does."""
    low, high, box = mesh.points.min(axis=0), mesh.points.max(axis=0), np.array([beam.length, beam.height])
    remedy = "make it with springtune.make_mesh(beam, ...) or springtune.read_mesh(file, beam)"
    if np.abs(np.concatenate([low, high - box])).max() > MOST_GAP * box.max():
        shown = " x ".join(f"{low_:.6g} to {high_:.6g}" for low_, high_ in zip(1e3 * low, 1e3 * high))
        of_beam = " x ".join(f"{side:.6g}" for side in 1e3 * box)
        raise ValueError(f"mesh: extends over {shown} mm, its beam over {of_beam} mm from the origin; {remedy}")
    if wrong := box_fault(mesh):
        raise ValueError(f"mesh: does not fill its beam: {wrong}; or {remedy}")


def check_meshed(shape: Shape, grouped: GroupedMesh, materials: Mapping[str, AnyMaterial]) -> None:
    """Refuse a mesh of another shape, or with other groups: the reference is on the outline."""
    if not shape.outline:
        return
    what, remedy = f"shape {shape.name!r}", "mesh it with springtune.mesh_shape"
    mesh, (low, high) = grouped.mesh, shape.extent
    small = MOST_DISTANCE_FROM_SIDE * max(high[0] - low[0], high[1] - low[1])
    known = {part: part for one in shape.rounds for part in (one.inner, one.outer)} | {**materials}
    sides = [side for one in shape.rounds if known[one.inner] != known[one.outer] for side in one.sides]
    particles = np.unique(mesh.edges[mesh.on_outline | _between(grouped, materials)])
    near = np.array([_distances(side, mesh.points[particles]) for side in sides]) <= small
    if not near.any(axis=0).all():
        first = in_words(mesh.points[particles[np.argmin(near.any(axis=0))]])
        raise ValueError(f"mesh: its outline has a particle at {first}, on no side of {what}; {remedy}")
    if near.sum(axis=1).min() < 2:
        side = sides[int(np.argmin(near.sum(axis=1)))]
        ends = f"from {in_words(side.start)} to {in_words(side.end)}"
        raise ValueError(f"mesh: has no edge on the side of {what} {ends}; {remedy}")
    for name in shape.groups:
        own: Sequence[OutlineSide] = [side for side in sides if side.group == name]
        if name not in grouped.sides or not own:
            continue
        ends = mesh.points[grouped.sides[name]]
        apart = np.min([_distances(side, ends.reshape(-1, 2)) for side in own], axis=0)
        share = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum() / sum(side.length_to(1.0) for side in own)
        if apart.max(initial=0.0) > small or not LEAST_COVERED <= share <= 1 + MOST_DISTANCE_FROM_SIDE:
            raise ValueError(f"mesh: its group {name!r} is not the sides {name!r} of {what}; {remedy}")
    for name, point in shape.points.items():
        if name in grouped.points and np.linalg.norm(np.subtract(grouped.points[name], point)) > small:
            there = in_words(grouped.points[name])
            raise ValueError(f"mesh: its point {name!r} is at {there}, that of {what} at {in_words(point)}; {remedy}")


def _between(grouped: GroupedMesh, materials: Mapping[str, AnyMaterial]) -> np.ndarray:
    """Whether edges have cells of two materials, shape (n_edges,)."""
    mesh, several = grouped.mesh, list(dict.fromkeys(materials.values()))
    if len(several) < 2:
        return np.zeros(len(mesh.edges), dtype=bool)
    there = np.zeros((len(several), len(mesh.edges)), dtype=bool)
    for count, names in part_names(grouped).items():
        of_cells = np.array([several.index(materials[name]) for name in names])
        there[of_cells[:, None], mesh.cell_edges[count]] = True
    return there.sum(axis=0) > 1


def _distances(side: OutlineSide, points: np.ndarray) -> np.ndarray:
    """Distances of points from a side [m], shape (n,); on an ellipse only for points close to it."""
    if side.arc is None or side.centre is None:
        return distances(points, np.array([side.start]), np.array([side.end]))
    axes, (begin, turn) = np.array(side.arc[:2]), side.arc[2:]
    x, y = ((points - side.centre) / axes).T
    # From the middle of the arc, so that no turn is cut.
    from_middle = np.mod(np.arctan2(y, x) - begin - 0.5 * turn + np.pi, 2 * np.pi) - np.pi
    angles = begin + 0.5 * turn + np.clip(from_middle, -0.5 * abs(turn), 0.5 * abs(turn))
    nearest = np.array(side.centre) + axes * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.asarray(np.linalg.norm(points - nearest, axis=1))


_solve_once = lru_cache(maxsize=64)(lambda solve, *problem: solve(*problem))


def unit_reference(beam: Beam, material: Material, kind: LoadKind, force: float) -> "ReferenceSolution":
    """Reference under a force [N], solved once for all beams, materials and forces that differ by factors."""
    from ..reference.answers import unit_problem, unit_scales
    from ..reference.small_strain import solve_unit  # here, since finite elements take half a second to import

    length, displacement = unit_scales(beam, material, kind)
    return _solve_once(solve_unit, *unit_problem(beam, material, kind)).scaled(force * displacement, length)
