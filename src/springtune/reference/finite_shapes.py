"""Reference for a shape at finite strain: each material by a law of its own, on the levels of `shapes`.

A stress is a force over the length that it acts on now and the thickness at rest, as that of a network.

Strain is infinite at a clamped corner, and a free side that is pressed there creases in ever smaller places. Where a
level has no stable equilibrium for this, triangles at such corners keep the degree of the last one that has.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from ..mesh.sheets import GroupedMesh
from ..problem.materials import AnyMaterial, Material
from ..problem.shapes import LoadCase, Shape
from .finite_strain import Body, FiniteStrainError, Law, Response, StVenant, law_of, matrix_of, strain_of, turning_of
from .shapes import LOWEST_DEGREE, Level, Problem, ShapeReference, solve_shape
from .triangles import inverse_of, local_functions, side_functions, tabulated

TOLERANCE = 1e-3  # largest accepted relative error estimate

FULL_LEVELS = 3  # levels with an equilibrium before triangles at corners may keep their degree


def solve_finite_shape(
    shape: Shape,
    load: LoadCase,
    materials: Mapping[str, AnyMaterial],
    grouped: GroupedMesh | None = None,
    law: str = "rubber",
) -> ShapeReference:
    """Solve a shape at finite strain by a `law`, ``"rubber"`` or ``"st-venant"``; otherwise as `solve_shape`."""
    return solve_shape(shape, load, materials, grouped, TOLERANCE, _Levels(materials, law == "rubber"))


class _Levels:
    """Makes levels, each of which begins at the last one."""

    def __init__(self, materials: Mapping[str, AnyMaterial], rubber: bool) -> None:
        self.last: _FiniteLevel | None = None
        self.kept = 0
        self.laws: dict[str, tuple[float, Law]] = {}
        for name, one in materials.items():
            if rubber and isinstance(one, Material):
                self.laws[name] = one.young_modulus, law_of(one, one.plane)
            else:
                stiffness = one.in_plane.plane_stress
                scale = float(stiffness.max())
                self.laws[name] = scale, StVenant(stiffness / scale)

    def __call__(self, problem: Problem, degree: int) -> "_FiniteLevel":
        try:
            self.last = _FiniteLevel(problem, degree, self)
        except FiniteStrainError as error:
            if self.last is None or self.kept or degree - LOWEST_DEGREE < FULL_LEVELS:
                raise
            self.kept = degree - 1
            try:
                self.last = _FiniteLevel(problem, degree, self)
            except FiniteStrainError:
                raise error from None
        return self.last


class _PartLaws:
    """`Law` of elements by the `names` of their materials; `scales` (elements,) are their units of stress [Pa]."""

    def __init__(self, names: np.ndarray, laws: Mapping[str, tuple[float, Law]]) -> None:
        self.rows = [(names == name, laws[name][1]) for name in np.unique(names).tolist()]
        self.scales = np.array([laws[name][0] for name in names.tolist()])

    def response(self, strain: np.ndarray) -> Response:
        stress, tangent = np.empty(strain.shape), np.empty((*strain.shape, 3))
        for rows, law in self.rows:
            found = law.response(strain[rows])
            stress[rows], tangent[rows] = found.stress, found.tangent
        return Response(stress, tangent)

    def energy(self, strain: np.ndarray) -> np.ndarray:
        total = np.empty(strain.shape[:-1])
        for rows, law in self.rows:
            total[rows] = law.energy(strain[rows])
        return total


class _FiniteLevel(Level, Body):
    """A shape solved at finite strain on one level, with one layer at corners: nearer, strain grows without end."""

    most_layers = 1

    def __init__(self, problem: Problem, degree: int, levels: _Levels) -> None:
        self.levels, self.kept_degree = levels, levels.kept
        if levels.kept:
            why = "as finer ones have no stable equilibrium there; the error estimate counts that"
            self.note = f"triangles at corners keep degree {levels.kept}, {why}"
        super().__init__(problem, degree)

    def _solve(self, forces: np.ndarray, held: np.ndarray, given: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Return coefficients and residual forces, shape (n_functions, 2), and the strain energy."""
        problem, space = self.problem, self.space
        weights, _, gradients = tabulated(space.degree, 2 * space.degree + (4 if space.curved.any() else 0))
        jacobian, determinant = space.jacobians(gradients)
        self.law = law = _PartLaws(np.array(space.mesh.names)[space.mesh.parts], self.levels.laws)
        self.nodes_of = space.numbers
        self.gradients = np.einsum("qiu,equa->eqai", gradients, inverse_of(jacobian, determinant), optimize=True)
        self.weights = weights * np.abs(determinant) * (problem.shape.thickness * law.scales)[:, None]
        kept = np.zeros(space.n_functions, dtype=bool)
        if self.kept_degree:
            at_corners = np.isin(space.corners, sorted(problem.rough)).any(axis=1)
            kept[space.numbers[at_corners]] = True
            kept[space.numbers[:, local_functions(self.kept_degree, space.degree)]] = False
        self.held, self.given, self.turning = held | kept[:, None], given, self._turning()
        self.load, self.extent = forces, float(np.ptp(space.mesh.points, axis=0).max())
        moved = self._continued()
        if moved is None:
            try:
                moved, _ = self.equilibrium_under(1.0, f"shape {problem.shape.name!r}, load {problem.load.name!r}")
            except FiniteStrainError as error:
                raise FiniteStrainError(f"{error}{self._where_it_gives_way()}") from None
        gradient = self._gradient(moved)
        strain = strain_of(gradient)
        external = self.load + (self.turning @ moved.ravel()).reshape(-1, 2)
        residual = self._forces(gradient, self.law.response(strain).stress) - external
        residual[kept] = 0.0
        return moved, residual, float((self.law.energy(strain) * self.weights).sum())

    def _where_it_gives_way(self) -> str:
        """Say that coarser triangles carried the whole load, and where these were pressed most."""
        last = self.levels.last
        if last is None:
            return ""
        growth = np.linalg.det(last._gradient(last.field) + np.eye(2)).min(axis=1)
        most = int(growth.argmin())
        x, y = 1e3 * last.space.mesh.points[last.space.corners[most]].mean(axis=0)
        degrees = f"on triangles of degree {self.space.degree}; those of degree {last.space.degree} carry it all"
        pressed = f"and are pressed to {growth[most]:.2f} of their area near ({x:.4g}, {y:.4g}) mm"
        why = "the law gives way there as triangles get finer, and the answer need not have a limit"
        return f" {degrees}, {pressed}: {why}. Round that corner, hold it less or load it less"

    def _continued(self) -> np.ndarray | None:
        """Find the equilibrium by Newton's method from the last level's; None if it is not stable."""
        space, last = self.space, self.levels.last
        if last is None:
            return None
        start = np.zeros((space.n_functions, 2))
        start[space.numbers[:, local_functions(last.space.degree, space.degree)]] = last.field[last.space.numbers]
        found = self.equilibrium(start, 1.0)
        return found[0] if found is not None and found[2] else None

    @cached_property
    def _slope(self) -> np.ndarray:
        """Linear solution under the whole load."""
        return Level._solve(self, self.load, self.held, self.given)[0]

    def _last_change(self, step: np.ndarray, moved: np.ndarray) -> float:
        """Largest change of a displacement in the last step, over the largest displacement [1]."""
        return float(np.abs(step).max() / np.abs(moved).max())

    def _turning(self) -> csr_array:
        """Forces of pressures that follow, of displacements: they act across the sides as these are now."""
        space, size = self.space, 2 * self.space.n_functions
        total = csr_array((size, size))
        for pressure in self.problem.load.pressures:
            for ends, sense in self.group_sides(pressure.group) if pressure.follower else ():
                along, weights = np.polynomial.legendre.leggauss(space.degree + 1)
                values, slopes = side_functions(space.degree, along)
                scale = pressure.pressure * sense * self.problem.shape.thickness
                block = values.T @ (weights[:, None] * slopes) * scale
                total = total + turning_of(block[None], space.on_side(ends)[None], size)
        return total

    def _area_growth(self) -> np.ndarray:
        """Growth of the areas of quadrature points [m2]."""
        slopes, _, determinant, weights = self._at_quadrature(2 * self.space.degree)
        return super()._area_growth() + np.linalg.det(slopes) * np.sign(determinant) * weights

    def _stresses(self, found: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Forces over lengths as they are now and the thickness at rest [Pa], shape (n, 3)."""
        slopes = self.slopes(found, local)
        law = _PartLaws(np.array(self.space.mesh.names)[self.space.mesh.parts[found]], self.levels.laws)
        total = law.scales[:, None] * law.response(strain_of(slopes)).stress
        deformation = slopes + np.eye(2)
        cauchy = deformation @ matrix_of(total) @ np.swapaxes(deformation, 1, 2)
        return (cauchy / np.linalg.det(deformation)[:, None, None])[:, [0, 1, 0], [0, 1, 1]]
