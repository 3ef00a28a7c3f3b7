"""What a scene is of: a beam under a force, or a shape under a load case.

Either says how a mesh is held and loaded, what is read from its displacements, and what the reference is.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache, partial
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from ..mechanics.network import FollowerPressure
from ..mechanics.statics import StaticProblem
from ..mesh import Mesh
from ..mesh.groups import GroupedMesh
from ..problem.boundary import (
    cell_at,
    check_case,
    displacement_weights,
    followed,
    forces,
    part_names,
    particle_masses,
    reaction_weights,
    supported,
)
from ..problem.geometry import Beam, warn_of_thickness
from ..problem.loads import LOADS, LoadKind
from ..problem.materials import ANY_MATERIAL, AnyMaterial, Material, Rubber
from ..problem.quantities import positive
from ..problem.shapes import LoadCase, Quantity, Shape
from ..reference.answers import beyond_linear
from ..springs import Definition, DefinitionError, Springs
from ..springs.identification import Case
from .meshes import A_BEAM, A_MATERIAL, A_MESH, A_SHAPE, check_filled, is_a
from .shape_meshes import check_meshed
from .sheet import Loading, OwnDefinition, Sheet, Solution, chosen, solved

if TYPE_CHECKING:
    from ..reference.finite_strain import FiniteStrainSolution
    from ..reference.shapes import ShapeReference
    from ..reference.small_strain import ReferenceSolution

A_GROUPED_MESH = "springtune.mesh_shape(shape, '5 mm')"
"""How a mesh with groups is made, for messages."""


class BeamStatement:
    """A beam under a load.

    Attributes
    ----------
    force : float
        With the sign that its load gives it [N].
    """

    body: str
    label: str
    named_materials: str

    def __init__(
        self,
        beam: Beam,
        mesh: Mesh | GroupedMesh,
        material: AnyMaterial | Mapping[str, AnyMaterial],
        load: str,
        force: float | str | None,
        kinematics: str,
    ) -> None:
        is_a(beam, Beam, "beam", A_BEAM)
        is_a(mesh, Mesh, "mesh", A_MESH)
        is_a(material, Material, "material", A_MATERIAL)
        assert isinstance(mesh, Mesh) and isinstance(material, Material)  # as type checkers are told
        check_filled(mesh, beam)
        about = chosen(LOADS, load, "load")
        if force is None:
            raise ValueError("force: none; give the size of the force on the beam such as '400 kN'")
        self.beam, self.mesh, self.material, self.load, self.kind = beam, mesh, material, load, about.kind
        self.force = about.sign * positive(force, "force", "force")
        self.thickness = beam.thickness
        self.kinematics, self.follower = kinematics, about.follower and kinematics == "nonlinear"
        self.body, self.label = beam.label, f"{load} of {abs(self.force):g} N"
        self.named_materials, self.materials = material.name, [material]

    def check(self, definition: Definition | OwnDefinition) -> None:
        """Refuse a definition that is not for the load."""
        if definition.uniaxial and not self.kind.uniaxial:
            raise ValueError(
                f"definition: {definition.name!r} is not for {self.load!r}; take it for traction or compression"
            )

    def springs(
        self, sheet: Sheet, definition: Definition | OwnDefinition, stiffness: float | None
    ) -> tuple[Springs, float]:
        """Springs of a definition, and the seconds that deriving them took."""
        case = None
        if definition.needs == "cases":
            field = unit_reference(self.beam, self.material, self.kind, 1.0).at(self.mesh.points)
            case = self.kind, self.force, field
        return sheet.derive(definition, self.material, stiffness, case)

    def held(self, sheet: Sheet) -> np.ndarray:
        """Directions that are held, shape (n_points, 2)."""
        return sheet.held(self.kind)

    def forces(self, sheet: Sheet, springs: Springs) -> np.ndarray:
        """Forces on the particles at rest [N], shape (n_points, 2)."""
        return self.force * sheet.pattern(self.kind, springs)

    def masses(self) -> np.ndarray | None:
        """Masses of the particles [kg], shape (n_points,); None without a density."""
        density = self.material.density
        return None if density is None else density * self.thickness * self.mesh.particle_areas

    def problem(self, sheet: Sheet, springs: Springs) -> StaticProblem:
        """Network under the pattern of the load."""
        return sheet.problem(self.kind, springs, self.follower)

    def factor(self, springs: Springs) -> float:
        """Load of the problem [m]: force over the reference stiffness."""
        return self.force / springs.reference

    def solve(self, sheet: Sheet, springs: Springs) -> Solution:
        """Equilibrium, judged."""
        return sheet.solve(self.kind, springs, self.force, self.kinematics, self.follower)

    def displacement(self, sheet: Sheet, displacements: np.ndarray) -> float:
        """Displacement of the load [m]."""
        return sheet.displacement(self.kind, displacements)

    def values(self, sheet: Sheet, springs: Springs, solution: Solution) -> dict[str, float]:
        """Quantities of interest by name."""
        return {"displacement": solution.displacement}

    @property
    def size(self) -> float:
        """Size of the load [N]."""
        return abs(self.force)

    @staticmethod
    def none() -> dict[str, float]:
        """Quantities of interest where there are none."""
        return {"displacement": np.nan}

    def reference(self, sheet: Sheet, finite_strain: bool = False) -> "ReferenceSolution | FiniteStrainSolution":
        """Converged finite-element solution, in small strain or of the material's law at finite strain."""
        if finite_strain:
            return _solve_finite(self.beam, self.material, self.force, self.kind, self.follower)
        return unit_reference(self.beam, self.material, self.kind, self.force)

    def reference_values(self, sheet: Sheet, finite_strain: bool = False) -> dict[str, float]:
        """Quantities of interest of the reference."""
        return {"displacement": self.reference(sheet, finite_strain).displacement}

    def objection(self, sheet: Sheet, finite_strain: bool = False) -> str:
        """Why the reference does not apply to networks of nonlinear kinematics; empty where it does."""
        if finite_strain:
            return ""
        found = unit_reference(self.beam, self.material, self.kind, self.force)
        return beyond_linear(found.rotation, found.strain)


class ShapeStatement:
    """A shape under a load case.

    Parameters
    ----------
    load : str
        Key of the shape's loads.
    scale : float
        Factor on all that the load case prescribes [1].
    """

    load: str
    kinematics: str
    scale: float
    body: str
    label: str
    named_materials: str
    loading: Loading

    def __init__(
        self,
        shape: Shape,
        grouped: GroupedMesh | Mesh,
        material: AnyMaterial | Mapping[str, AnyMaterial],
        load: str,
        scale: float,
        kinematics: str,
    ) -> None:
        is_a(shape, Shape, "shape", A_SHAPE)
        if isinstance(grouped, Mesh):
            raise ValueError(
                "mesh: is of no groups, and supports and loads of a shape are on groups; give a GroupedMesh such as "
                f"{A_GROUPED_MESH}"
            )
        is_a(grouped, GroupedMesh, "mesh", A_GROUPED_MESH)
        self.shape, self.grouped, self.mesh, self.thickness = shape, grouped, grouped.mesh, shape.thickness
        self.by_part = _materials(material, grouped)
        check_meshed(shape, grouped, self.by_part)
        if shape.file:
            warn_of_thickness(shape.thickness, np.ptp(self.mesh.points, axis=0), f"shape {shape.name!r}")
        self.materials = list(dict.fromkeys(self.by_part.values()))
        if isinstance(scale, bool) or not (isinstance(scale, Real) and np.isfinite(scale) and scale):
            raise ValueError(f"scale: {scale!r} is no factor; give a finite number that is not zero")
        self.load, self.scale = load, float(scale)
        self.case: LoadCase = scaled(chosen(shape.loads, load, "load"), self.scale)
        if not self.case.quantities:
            raise ValueError(
                f"load {load!r}: asks for nothing; give it quantities, of which the first one stands for all"
            )
        self.kinematics = kinematics
        factor = "" if self.scale == 1 else f" times {self.scale:g}"
        self.body, self.label = shape.name, f"{load}{factor}"
        self.named_materials = ", ".join(dict.fromkeys(one.name for one in self.materials))
        self.loading = self._loading()
        for one in self.case.quantities:
            self._check(one)

    def _loading(self) -> Loading:
        check_case(self.grouped, self.case)
        held, given = supported(self.grouped, self.case)
        densities = {name: one.density for name, one in self.by_part.items()}
        all_forces = partial(forces, self.grouped, self.case, self.thickness, densities)
        pattern = all_forces()
        if not (pattern[~held].any() or given.any()):
            raise ValueError(
                f"load {self.load!r}: neither pulls what is free nor moves a support; give it a traction, a pressure, "
                "gravity or a prescribed displacement"
            )
        edges, pressure = followed(self.grouped, self.case, self.thickness)
        turning = self.kinematics == "nonlinear" and len(edges) > 0
        return Loading(
            (self.grouped, self.case, self.thickness, tuple(densities.items()), turning),
            held,
            pattern,
            given if given.any() else None,
            FollowerPressure(self.mesh, edges, pressure) if turning else None,
            all_forces(followers=False) if turning else None,
        )

    def _check(self, one: Quantity) -> None:
        """Refuse a quantity that cannot be read."""
        if one.kind == "displacement":
            displacement_weights(self.grouped, one)
        elif one.kind == "reaction":
            reaction_weights(self.grouped, self.case, one)
        elif one.kind == "stress":
            cell_at(self.grouped, one.of)
            particle = self.grouped.particle(one.of)
            names = {
                str(name)
                for count, labels in part_names(self.grouped).items()
                for name in labels[(self.mesh.cells[count] == particle).any(axis=1)]
            }
            if particle is not None and len({self.by_part[name] for name in names}) > 1:
                raise ValueError(
                    f"load {self.load!r}, quantity {one.name!r}: {one.of!r} is where different materials meet, and the "
                    "stress has a jump there; ask for it on one side"
                )

    def check(self, definition: Definition | OwnDefinition) -> None:
        """Refuse a definition that is for beams alone."""
        if definition.uniaxial:
            raise ValueError(
                f"definition: {definition.name!r} is for loads that stretch a beam along its length, and "
                f"{self.shape.name!r} is a shape; choose one for any load, such as 'delingette'"
            )
        if definition.needs == "cases" and self.loading.given is not None:
            raise ValueError(
                f"definition: {definition.name!r} is fitted to displacements under forces, and load {self.load!r} "
                "prescribes displacements; choose another definition, or a load of forces"
            )

    def springs(
        self, sheet: Sheet, definition: Definition | OwnDefinition, stiffness: float | None
    ) -> tuple[Springs, float]:
        """Springs of a definition, and the seconds that deriving them took."""
        given: list[Case] | None = None
        if definition.needs == "cases":
            field = self.reference(sheet).at(self.mesh.points)
            given = [Case(self.loading.held, self.loading.pattern, field)]
        springs, seconds = sheet.derive_on_shape(
            definition, self.by_part, self.grouped, stiffness, given, self.loading.key
        )
        if springs.lateral:
            raise DefinitionError(
                "needs a stress on the long faces of a beam, and a shape has none; choose another definition"
            )
        return springs, seconds

    def held(self, sheet: Sheet) -> np.ndarray:
        """Directions that are held, shape (n_points, 2)."""
        return self.loading.held

    def forces(self, sheet: Sheet, springs: Springs) -> np.ndarray:
        """Forces on the particles at rest [N], shape (n_points, 2)."""
        return self.loading.pattern

    def masses(self) -> np.ndarray | None:
        """Masses of the particles [kg], shape (n_points,); None without a density."""
        densities = {name: one.density for name, one in self.by_part.items()}
        return None if None in densities.values() else particle_masses(self.grouped, self.thickness, densities)

    def problem(self, sheet: Sheet, springs: Springs) -> StaticProblem:
        """Network under the load."""
        return sheet.stated(self.loading, springs)

    def factor(self, springs: Springs) -> float:
        """Load of the problem [m/N]: one over the reference stiffness, since its pattern is in N."""
        return 1.0 / springs.reference

    def solve(self, sheet: Sheet, springs: Springs) -> Solution:
        """Equilibrium, judged."""
        problem, factor = self.problem(sheet, springs), self.factor(springs)
        found = solved(problem, factor, self.kinematics, lambda moved: np.nan)
        if not found.equilibrium.converged:
            return found
        first = self._value(self.case.quantities[0], springs, found)
        return replace(found, displacement=first)

    def displacement(self, sheet: Sheet, displacements: np.ndarray) -> float:
        """First displacement among the quantities [m]; NaN where there is none."""
        for one in self.case.quantities:
            if one.kind == "displacement":
                return float(np.tensordot(displacements, displacement_weights(self.grouped, one), axes=2))
        return np.nan

    def values(self, sheet: Sheet, springs: Springs, solution: Solution) -> dict[str, float]:
        """Quantities of interest by name, in SI units; NaN without an equilibrium."""
        if not solution.equilibrium.converged:
            return self.none()
        first, *others = self.case.quantities
        return {first.name: solution.displacement} | {one.name: self._value(one, springs, solution) for one in others}

    def _value(self, one: Quantity, springs: Springs, solution: Solution) -> float:
        network, moved = solution.problem.network, solution.equilibrium.displacements
        linear = self.kinematics == "linear"
        if one.kind == "displacement":
            return float(np.tensordot(moved, displacement_weights(self.grouped, one), axes=2))
        if one.kind == "area":
            return _growth(self.mesh, moved, linear)
        if one.kind == "energy":
            if linear:
                return float(0.5 * springs.reference * np.tensordot(moved, network.linear_forces(moved), axes=2))
            return springs.reference * network.energy(moved)
        if one.kind == "reaction":
            weights = reaction_weights(self.grouped, self.case, one)
            return float(np.tensordot(self.reactions(springs, solution), weights, axes=2))
        from ..mechanics.stress import cell_stresses, particle_stresses  # here: few ask for stress

        corners, cell, shares = cell_at(self.grouped, one.of)
        stresses, names = cell_stresses(network, moved, linear), part_names(self.grouped)
        same = {count: labels == names[corners][cell] for count, labels in names.items()}
        found = shares @ particle_stresses(self.mesh, stresses, same)[self.mesh.cells[corners][cell]]
        return float(found[("xx", "yy", "xy").index(one.component)] * springs.reference / self.thickness)

    def reactions(self, springs: Springs, solution: Solution) -> np.ndarray:
        """Forces of the supports on the particles [N], shape (n_points, 2); zero in free directions."""
        network, moved = solution.problem.network, solution.equilibrium.displacements
        resistance = network.linear_forces(moved) if self.kinematics == "linear" else network.forces(moved)
        load, turning = self.loading.pattern, self.loading.follower
        if turning is not None and self.loading.dead is not None:
            load = self.loading.dead + turning.forces(moved)
        return np.where(self.loading.held, springs.reference * resistance - load, 0.0)

    @property
    def size(self) -> float:
        """Size of the load: of a load case the factor on it [1]."""
        return abs(self.scale)

    def none(self) -> dict[str, float]:
        """Quantities of interest where there are none."""
        return dict.fromkeys((one.name for one in self.case.quantities), np.nan)

    def reference(self, sheet: Sheet, finite_strain: bool = False) -> "ShapeReference":
        """Converged finite-element solution, once for all scenes of a sheet; of shapes there is small strain alone."""
        case = self.shape.loads[self.load]
        # The shape is kept with it: what is no longer there leaves its number to others.
        key = id(self.shape), self.grouped, case, tuple(self.by_part.items())
        if (key, 1.0) not in sheet.references:
            from ..reference.shapes import solve_shape  # here, since finite elements take half a second to import

            as_read = self.grouped if self.shape.file else None
            sheet.references[key, 1.0] = self.shape, solve_shape(self.shape, case, self.by_part, as_read)
        if (key, self.scale) not in sheet.references:
            sheet.references[key, self.scale] = self.shape, sheet.references[key, 1.0][1].scaled(self.scale)
        found: ShapeReference = sheet.references[key, self.scale][1]
        return found

    def reference_values(self, sheet: Sheet, finite_strain: bool = False) -> dict[str, float]:
        """Quantities of interest of the reference; NaN where that is none of what is asked for."""
        values = dict(self.reference(sheet).values)
        return dict.fromkeys(values, np.nan) if finite_strain and self.objection(sheet) else values

    def objection(self, sheet: Sheet, finite_strain: bool = False) -> str:
        """Why the reference does not apply to networks of nonlinear kinematics; empty where it does."""
        found = self.reference(sheet)
        return beyond_linear(found.rotation, found.strain)


Statement = BeamStatement | ShapeStatement
"""What a scene is of."""


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


def _materials(material: AnyMaterial | Mapping[str, AnyMaterial], grouped: GroupedMesh) -> dict[str, AnyMaterial]:
    """Material of each part that the mesh has, checked."""
    parts = {str(name) for labels in part_names(grouped).values() for name in np.unique(labels)}
    given = dict(material) if isinstance(material, Mapping) else dict.fromkeys(sorted(parts), material)
    for name, one in given.items():
        if not isinstance(one, ANY_MATERIAL):
            of = f" of part {name!r}" if name else ""
            raise ValueError(f"material{of}: {one!r} is not a Material; give one such as {A_MATERIAL}")
    for name in sorted(parts - set(given)):
        said = f"part {name!r}" if name else "the main part, ''"
        raise ValueError(f"material: {said} has none; given: {', '.join(map(repr, given)) or 'none'}")
    for name in given:
        if name not in parts:
            known = f"is no part of the mesh; known: {', '.join(map(repr, sorted(parts)))}"
            raise ValueError(f"material: {name!r} {grouped.unusable.get(name, known)}")
    return given


def _growth(mesh: Mesh, displacements: np.ndarray, linear: bool) -> float:
    """Growth of the area of a mesh [m2]."""
    total = 0.0
    for corners in mesh.cells.values():
        place, moved = mesh.points[corners], displacements[corners]
        x, y = (np.roll(place, -1, axis=1) - np.roll(place, 1, axis=1)).transpose(2, 0, 1)
        growth = 0.5 * (moved[..., 0] * y - moved[..., 1] * x).sum(axis=1)
        if not linear:
            moved = moved - moved[:, :1]
            after = np.roll(moved, -1, axis=1)
            growth += 0.5 * (moved[..., 0] * after[..., 1] - moved[..., 1] * after[..., 0]).sum(axis=1)
        total += float(growth.sum())
    return total


@lru_cache(maxsize=32)
def _solve_unit(aspect_ratio: float, nu: float, kind: LoadKind) -> "ReferenceSolution":
    from ..reference.small_strain import solve_unit  # here, since finite elements take half a second to import

    return solve_unit(aspect_ratio, nu, kind)


@lru_cache(maxsize=32)
def _solve_finite(
    beam: Beam, material: Material, force: float, kind: LoadKind, follower: bool
) -> "FiniteStrainSolution":
    from ..reference.finite_strain import solve_neo_hooke, solve_yeoh  # here: as of `_solve_unit`

    if isinstance(material, Rubber):
        return solve_yeoh(beam, material, force, kind, follower)
    return solve_neo_hooke(beam, material, force, kind, follower=follower)


def unit_reference(beam: Beam, material: Material, kind: LoadKind, force: float) -> "ReferenceSolution":
    """Reference under a force, solved once for all beams, materials and forces that differ by factors.

    Parameters
    ----------
    force : float
        [N]
    """
    from ..reference.answers import unit_problem, unit_scales

    length, displacement = unit_scales(beam, material, kind)
    return _solve_unit(*unit_problem(beam, material, kind)).scaled(force * displacement, length)
