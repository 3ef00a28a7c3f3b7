"""Reference for a shape: linear elasticity at small strain, plane stress, by hp finite elements on the shape itself."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import spatial
from scipy.sparse import coo_array

from ..linalg.factors import SingularError, entry_places, factorize
from ..mesh.cells import MeshError, signed_areas
from ..mesh.sheets import GroupedMesh
from ..mesh.sides import in_words
from ..problem.boundary import check_held
from ..problem.materials import AnyMaterial, Materials
from ..problem.shapes import LoadCase, Quantity, Shape, check_names
from . import triangles
from .answers import most_rotation_and_strain
from .small_strain import ReferenceNotConvergedError
from .triangles import CoarseMesh, Corner, Side, Space

#: Degrees of the first level and of the last one tried.
LOWEST_DEGREE, HIGHEST_DEGREE = 2, 10

#: Error of a stress that is accepted, over that of other quantities.
STRESS_TOLERANCE_FACTOR = 10.0

#: Largest accepted estimate over the tolerance where corners keep their degree, see `Level.kept_degree`.
KEPT_DEGREE_FACTOR = 10.0

#: Quantities below this share of the largest one of their kind are judged by that share.
NEGLIGIBLE_SHARE = 1e-3

#: A value of less than so many times the bound on its error is zero as far as can be told.
ZERO_BOUND_FACTOR = 10.0

#: Force on a support at a point, over all of them, that is taken for none.
SMALLEST_REACTION = 1e-6

#: Most entries of the triangles' matrices on a level: half a gigabyte.
MOST_LEVEL_ENTRIES = 60_000_000

#: Layers at corners, from none, whose triangles are looked at before: those of later ones have the same form.
LAYERS_CHECKED = 4

Field = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Vectors, shape (n, 2), at points of sides and their outward normals, shape (n, 2) each."""


@dataclass(frozen=True, eq=False)
class ShapeReference:
    """Converged displacements of a shape under a load case.

    - `values`: Quantities of interest, in SI units; zero if less than ten times their error bound, as by symmetry.
    - `error_estimates`: Relative error bounds [1]: over the value, or over a thousandth of the body's largest value of
      its kind; smaller ones are `negligible`.
    - `rotation`, `strain`: Rotation [rad] and strain [1] that limit its use, see `springtune.reference.answers`.
    - `note`: Why error estimates are larger than those of other references, or an empty string.
    """

    values: dict[str, float]
    error_estimates: dict[str, float]
    energy: float
    rotation: float
    strain: float
    unknowns: int
    _level: "Level" = field(repr=False)
    _kinds: dict[str, str] = field(repr=False)
    negligible: tuple[str, ...] = ()
    note: str = ""
    _factor: float = 1.0

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return displacements [m] at points of the body, (n, 2) [m]; just outside, by extrapolation.

        No error estimate covers them: in published benchmarks they are off by up to 4e-4 at the tolerance 1e-4.
        """
        return self._factor * self._level.at(points, self._level._displacements)

    def stress_at(self, points: np.ndarray) -> np.ndarray:
        """Return stresses xx, yy and xy [Pa], shape (n, 3), at points of the body, see `at`."""
        return self._factor * self._level.at(points, self._level._stresses)

    def scaled(self, factor: float) -> "ShapeReference":
        """The solution under so many times the load, prescribed displacements included: small strain is linear."""
        values = {name: one * factor ** (1 + (self._kinds[name] == "energy")) for name, one in self.values.items()}
        by = {"energy": factor**2, "rotation": abs(factor), "strain": abs(factor), "_factor": factor}
        return replace(self, values=values, **{name: getattr(self, name) * one for name, one in by.items()})


def solve_shape(
    shape: Shape,
    load: LoadCase,
    materials: Materials,
    grouped: GroupedMesh | None = None,
    tolerance: float = 1e-4,
    level_of: "Callable[[Problem, int], Level] | None" = None,
) -> ShapeReference:
    r"""Solve for the displacements of a shape under a load case, at small strain in plane stress.

    `grouped` is the mesh of a shape from a file: the polygon around its cells is the geometry. `tolerance` is the
    largest accepted relative error estimate [1], of stresses ten times as much.

    A level of degree p has p layers at each corner. With :math:`u \sim r^\lambda` one more layer scales the missing
    energy by :math:`.2^{2\lambda}`, one more degree similarly. So steps from level to level fall geometrically: while
    each is at most half of the last, all later ones together are at most the last one. A step may be small by chance:
    the estimate is the larger of the last step and a quarter of the one before, and steps must be seen to halve.

    Curves are polynomials of the level's degree (isoparametric), reactions are the work of the solution on a unit
    displacement of their group, and stresses are not smoothed.
    """
    problem = Problem(shape, load, materials if isinstance(materials, Mapping) else {"": materials}, grouped)
    names = [quantity.name for quantity in load.quantities]
    values, estimates, bounds = list[dict[str, float]](), dict[str, float](), dict[str, float]()
    complaint = ""
    for degree in range(LOWEST_DEGREE, HIGHEST_DEGREE + 1):
        if complaint and problem.size(degree) > MOST_LEVEL_ENTRIES:
            complaint += "; the next level would not fit into memory: a simpler outline has fewer triangles"
            break
        level = (level_of or Level)(problem, degree)
        values.append(level.values())
        if len(values) < 3:
            continue
        complaint = ""
        problem.note_reactions(level)
        for name in names + ([] if problem.infinite_energy else [""]):
            kind = problem.kinds[name]
            scale = max(abs(values[-1][name]), NEGLIGIBLE_SHARE * level.scale(kind)) or 1.0
            before, last = (abs(values[i][name] - values[i - 1][name]) / scale for i in (-2, -1))
            estimates[name] = max(last, before / 4) + level.round_off
            accepted = tolerance * (STRESS_TOLERANCE_FACTOR if kind == "stress" else 1.0)
            if kept := level.kept_degree:
                of_full = [one[name] for one in values[: kept - LOWEST_DEGREE + 1]]
                estimates[name] += 2 * float(np.abs(np.diff(of_full[-3:])).max()) / scale
                accepted = max(accepted, KEPT_DEGREE_FACTOR * tolerance)
            bounds[name] = estimates[name] * scale
            why = refusal_reason(estimates[name], accepted, before, last)
            if why and not complaint:
                at = f"{estimates[name]:.1e} at degree {degree} ({level.unknowns} unknowns)"
                complaint = f"{problem.shown(name)}: relative error estimate {at}, {why}{problem.reason(name)}"
        if not complaint:
            last_values, kinds, errors = values[-1], problem.kinds, {name: estimates[name] for name in names}
            size = {name: abs(last_values[name]) for name in names}
            sure = {name: last_values[name] if size[name] > ZERO_BOUND_FACTOR * bounds[name] else 0.0 for name in names}
            little = tuple(name for name in names if size[name] < NEGLIGIBLE_SHARE * level.scale(kinds[name]))
            limits = *level.rotation_and_strain(), level.unknowns
            return ShapeReference(sure, errors, last_values[""], *limits, level, kinds, little, level.note)
    raise ReferenceNotConvergedError(f"reference of shape {shape.name!r}, load {load.name!r}: {complaint}")


def solve_each(
    shape: Shape,
    load: LoadCase,
    materials: Materials,
    grouped: GroupedMesh | None = None,
    solve: Callable[..., ShapeReference] | None = None,
) -> tuple[list[ShapeReference], dict[str, str]]:
    """Return references that together have every quantity of interest that converges, and the faults of the others."""
    try:
        return [(solve or solve_shape)(shape, load, materials, grouped)], {}
    except (ReferenceNotConvergedError, ValueError) as error:
        if len(load.quantities) < 2:
            return [], dict.fromkeys([one.name for one in load.quantities] or [""], str(error))
    found, lacking = list[ShapeReference](), dict[str, str]()
    for one in load.quantities:
        more, why = solve_each(shape, replace(load, quantities=(one,)), materials, grouped, solve)
        found += more
        lacking |= why
    return found, lacking


def refusal_reason(estimate: float, accepted: float, before: float, last: float) -> str:
    """Return why an error estimate is refused, or an empty string; `before` and `last` are the last two steps.

    >>> refusal_reason(1e-4, 1e-5, 3e-4, 1e-4)
    'the tolerance is 1.0e-05'
    >>> refusal_reason(1e-5, 1e-4, 1.5e-5, 1e-5)
    'within the tolerance of 1.0e-04, but it is no bound: steps do not halve yet, 1.5e-05 and then 1.0e-05'
    """
    if not estimate <= accepted:
        return f"the tolerance is {accepted:.1e}"
    if last <= before / 2 or before <= accepted / 10:
        return ""
    steps = f"steps do not halve yet, {before:.1e} and then {last:.1e}"
    return f"within the tolerance of {accepted:.1e}, but it is no bound: {steps}"


class Problem:
    """Data that all levels share: coarse triangles, stiffnesses, supports and loads by group, corners."""

    def __init__(
        self, shape: Shape, load: LoadCase, materials: Mapping[str, AnyMaterial], grouped: GroupedMesh | None
    ) -> None:
        self.shape, self.load = shape, load
        points = {**shape.points, **(grouped.points if grouped else {})}
        self.points = {name: np.array(point, dtype=float) for name, point in points.items()}
        if grouped is None and not shape.outline:
            raise ValueError(f"shape {shape.name!r} has no outline; give the mesh of its file")
        used = ({one.group for one in load.supports} | {one.group for one in load.tractions}) & set(self.points)
        # Small triangles where something is asked for: values at points are the last to converge.
        probed = {quantity.of for quantity in load.quantities} & set(self.points)
        corners = {name: tuple(self.points[name]) for name in sorted(used | probed)}
        for halvings in range(5):
            self.mesh = triangles.outline_mesh(shape, grouped, corners, triangles.LARGEST_TURN / 2**halvings)
            self._find_corners(materials, used, probed)
            graded = [self._graded.copy() for _ in range(LAYERS_CHECKED)]
            for layers, mesh in enumerate(graded):
                for _ in range(layers):
                    mesh.grade(self.rough)
            if all(triangles.is_unfolded(mesh) for mesh in (self.mesh, *graded)):
                return
        raise MeshError(f"triangles of {shape.name!r} fold along its arcs; look for sides that nearly touch")

    def _find_corners(self, materials: Mapping[str, AnyMaterial], used: set[str], probed: set[str]) -> None:
        """Check materials, groups and quantities on the mesh, and find its corners."""
        load = self.load
        present = [self.mesh.names[part] for part in np.unique(self.mesh.parts)]
        if missing := [name for name in present if name not in materials]:
            lacking, given = (", ".join(map(repr, names)) for names in (missing, materials))
            raise ValueError(f"parts without a material: {lacking}; there are materials of {given}")
        planes = {name: materials[name].in_plane.plane_stress for name in present}
        self.stiffness = np.array([planes.get(name, np.zeros((3, 3))) for name in self.mesh.names])
        self.density = np.zeros(len(self.mesh.names))
        for name in present if any(load.gravity) else ():
            density = materials[name].density
            if density is None:
                raise ValueError(f"material {materials[name].name!r} has no density; gravity needs one")
            self.density[self.mesh.names.index(name)] = density

        groups = {group for side in self.mesh.sides.values() for group in side.groups}
        check_names(load, sorted(groups), sorted(self.points))

        loads: dict[str, list[object]] = {}
        for number, traction in enumerate(load.tractions):
            loads.setdefault(traction.group, []).append(("traction", number))
        for pressure in load.pressures:
            loads.setdefault(pressure.group, []).append(("pressure", pressure.pressure))
        supported: dict[str, list[tuple[float | None, float | None]]] = {}
        for support in load.supports:
            supported.setdefault(support.group, []).append((support.x, support.y))

        def condition(side: Side) -> object:
            found = [(group, supported.get(group, []), loads.get(group, [])) for group in side.groups]
            return sorted((repr(item[1]), repr(item[2])) for item in found if item[1] or item[2])

        def mirror(side: Side, way: np.ndarray) -> bool:
            if side.arc is not None or np.abs(self.stiffness[:, :2, 2]).max() > 1e-12 * self.stiffness.max():
                return False
            conditions = [value for group in side.groups for value in supported.get(group, [])]
            if any(group in loads for group in side.groups) or len(conditions) != 1:
                return False
            x, y = conditions[0]
            flat = np.abs(way) < 1e-12
            return bool(flat[1] and x is None and y is not None or flat[0] and y is None and x is not None)

        def held(side: Side) -> bool:
            return not supported.keys().isdisjoint(side.groups)

        self.corners = triangles.corners_of(self.mesh, condition, held, mirror)
        self.loaded_points = {t.group for t in load.tractions if t.group in self.points and any(t.force)}
        rough = {point for point, corner in self.corners.items() if corner.rough}
        for name in used:
            what = "a force acts on a point" if name in self.loaded_points else "a point is held"
            self.corners[self.mesh.named[name]] = Corner(what)
        self.rough = rough | {self.mesh.named[name] for name in used | probed}
        self.infinite_energy = bool(self.loaded_points)
        self.reacting: list[str] = []
        self.kinds = {quantity.name: quantity.kind for quantity in load.quantities} | {"": "energy"}
        self._quantities = {quantity.name: quantity for quantity in load.quantities}
        for quantity in load.quantities:
            if why := self._objection(quantity):
                raise ValueError(f"quantity {quantity.name!r}: {why}")
        self._graded = self.mesh.copy()
        self._graded.isolate(self.rough)
        self._layers = 0

    def _objection(self, quantity: Quantity) -> str:
        """Why a quantity has no value in a continuum, with the remedy, or an empty string."""
        kind, of = quantity.kind, quantity.of
        corner = self.corners.get(self.mesh.named.get(of, -1)) if kind == "stress" else None
        if corner and corner.infinite:
            remedy = "ask for it beside the corner"
            if not self.shape.outline:
                remedy += ", or give the shape as an outline with arcs rather than as a mesh"
            return f"the stress at {of!r} is infinite in a continuum, since {corner.what} there: {remedy}"
        if kind == "stress":
            beside = self.mesh.parts[(self.mesh.triangles == self.mesh.named[of]).any(axis=1)]
            if len(set(beside.tolist())) > 1:
                where = f"{of!r} is where parts of different materials meet"
                return f"{where}, and the stress has a jump there: ask for it on one side"
        for point in self.loaded_points if kind in ("displacement", "stress") and of in self.points else ():
            if np.allclose(self.points[point], self.points[of], rtol=0, atol=1e-9 * np.ptp(self.mesh.points)):
                why = f"the {kind} under a point force is infinite in a continuum"
                return f"{why}: spread the force on {point!r} over a side"
        if kind == "energy" and self.infinite_energy:
            points = ", ".join(sorted(self.loaded_points))
            return f"the energy of a point force is infinite in a continuum: spread the force on {points} over a side"
        return ""

    def note_reactions(self, level: "Level") -> None:
        """Note point supports that carry a force: a continuum's displacements and energy are infinite there."""
        least = SMALLEST_REACTION * level.scale("reaction")
        held = [support.group for support in self.load.supports if support.group in self.points]
        self.reacting = [name for name in held if np.abs(level.residual[self.mesh.named[name]]).max() > least]
        self.infinite_energy = bool(self.loaded_points or self.reacting)

    def shown(self, name: str) -> str:
        """Name of a quantity with its group or point, for messages."""
        of = self._quantities[name].of if name else ""
        return (repr(name) if name else "the energy") + (f" of {of!r}" if of else "")

    def reason(self, name: str) -> str:
        """Why a quantity may not converge."""
        quantity = self._quantities.get(name)
        if quantity and self.reacting and quantity.kind != "reaction":
            names = ", ".join(map(repr, dict.fromkeys(self.reacting)))
            return f"; held points carry forces, which displace a continuum without limit: hold sides, not {names}"
        if quantity is None or quantity.of not in self.points:
            return ""
        corner = self.corners.get(self.mesh.named.get(quantity.of, -1))
        if corner is None or not corner.rough or quantity.kind == "reaction":
            return ""
        then = "the stress there may be infinite" if quantity.kind == "stress" else "the solution is not smooth there"
        return f"; {quantity.of!r} is where {corner.what}: {then}"

    def graded(self, layers: int) -> CoarseMesh:
        """Return the mesh with `layers` of graded triangles at its corners; call it with rising numbers."""
        while self._layers < layers:
            self._graded.grade(self.rough)
            self._layers += 1
        return self._graded.copy()

    def size(self, degree: int) -> int:
        """Approximate number of entries of a level's matrices."""
        return len(self._graded.triangles) * ((degree + 1) * (degree + 2)) ** 2


VOIGT = np.array([[0, 2], [2, 1]])  # place of a pair of axes among xx, yy and xy


class Level:
    """A shape solved on one level; triangles at corners have at most `kept_degree`, if it is not zero."""

    most_layers = HIGHEST_DEGREE
    kept_degree = 0
    note = ""

    def __init__(self, problem: Problem, degree: int) -> None:
        self.problem = problem
        mesh = problem.graded(min(degree, self.most_layers))
        self.space = Space(mesh, degree)
        self.outlines = mesh.part_sides()
        thickness = problem.shape.thickness
        # Stiffness by axes: of strain d u_c / d x_a on stress along d, b.
        self._tensor = thickness * problem.stiffness[:, VOIGT[:, :, None, None], VOIGT[None, None]]
        forces, (held, given) = self.forces(), self.supports()
        self.field, self.residual, self.energy = self._solve(forces, held, given)
        self.held, free = held, ~held
        forcing = max(np.abs(self.residual[held]).max(initial=0.0), np.abs(forces).max(initial=0.0))
        self.round_off = float(np.abs(self.residual[free]).max(initial=0.0) / forcing) if forcing else 0.0
        self.unknowns = int(free.sum())

    # Unknowns are numbered by function, then axis.
    def _matrices(self) -> np.ndarray:
        """Stiffness matrices of the triangles, shape (n, 2 n_functions, 2 n_functions), axes last."""
        space, degree = self.space, self.space.degree
        n, count = len(space.corners), space.numbers.shape[1]
        result = np.empty((n, count, 2, count, 2))
        tensors = self._tensor[space.mesh.parts]
        straight = np.flatnonzero(~space.curved)
        weights, _, gradients = triangles.tabulated(degree, 2 * degree - 2)
        jacobian, determinant = space.jacobians(gradients[:1], straight)
        inverse = triangles.inverse_of(jacobian[:, 0], determinant[:, 0])
        products = np.einsum("q,qia,qjb->abij", weights, gradients, gradients, optimize=True)
        area = np.abs(determinant[:, 0])
        metric = np.einsum("eua,ecadb,evb,e->ecduv", inverse, tensors[straight], inverse, area, optimize=True)
        blocks = metric.reshape(-1, 4) @ products.reshape(4, -1)
        result[straight] = blocks.reshape(len(straight), 2, 2, count, count).transpose(0, 3, 1, 4, 2)
        curved = np.flatnonzero(space.curved)
        weights, _, gradients = triangles.tabulated(degree, 2 * degree + 4)
        for rows in np.array_split(curved, max(1, len(curved) * gradients.size // 4_000_000)) if len(curved) else ():
            jacobian, determinant = space.jacobians(gradients, rows)
            inverse = triangles.inverse_of(jacobian, determinant)
            slopes = np.einsum("qiu,equa->eaqi", gradients, inverse, optimize=True)
            weighted = slopes * (weights * np.abs(determinant))[:, None, :, None]
            flat = slopes.reshape(len(rows), -1, count)
            for c in range(2):
                for d in range(2):
                    mixed = np.einsum("eab,ebqj->eaqj", tensors[rows][:, c, :, d, :], weighted)
                    result[rows, :, c, :, d] = flat.transpose(0, 2, 1) @ mixed.reshape(len(rows), -1, count)
        return result.reshape(n, 2 * count, 2 * count)

    def group_sides(self, group: str) -> list[tuple[tuple[int, int], float]]:
        """Sides of a group, and 1 where the body is to the left of them from the lower number, else -1."""
        found = [ends for ends, side in self.space.mesh.sides.items() if group in side.groups]
        return [(ends, 1.0 if self.outlines[ends][0][1] else -1.0) for ends in found]

    def integral(self, group: str, given: Field) -> np.ndarray:
        """Integral over a group of the functions times vectors."""
        space, total = self.space, np.zeros((self.space.n_functions, 2))
        along, weights = np.polynomial.legendre.leggauss(space.degree + 3)
        values, slopes = triangles.side_functions(space.degree, along)
        for ends, sense in self.group_sides(group):
            functions = space.on_side(ends)
            at = space.places[functions]
            normals = sense * (slopes @ at)[:, ::-1] * [1, -1]
            lengths = np.linalg.norm(normals, axis=1)
            vectors = given(values @ at, normals / lengths[:, None])
            total[functions] += values.T @ (vectors * (weights * lengths)[:, None])
        return total

    def _shares(self, group: str) -> np.ndarray:
        """Integral of the functions over a group, divided by its length."""
        whole = self.integral(group, lambda points, _: np.ones_like(points))[:, 0]
        return whole / whole[: len(self.space.mesh.points)].sum()

    def forces(self) -> np.ndarray:
        """Forces on the functions [N], shape (n_functions, 2)."""
        problem, space = self.problem, self.space
        load, thickness = problem.load, problem.shape.thickness
        total = np.zeros((space.n_functions, 2))
        for traction in load.tractions:
            if traction.group in space.mesh.named:
                total[space.mesh.named[traction.group]] += traction.force
            else:
                total += self._shares(traction.group)[:, None] * traction.force
        for pressure in load.pressures:
            total -= pressure.pressure * thickness * self.integral(pressure.group, lambda _, normals: normals)
        if any(load.gravity):
            weights, values, gradients = triangles.tabulated(space.degree, 3 * space.degree)
            volume = weights * np.abs(space.jacobians(gradients)[1])
            shares = (volume @ values) * (thickness * problem.density[space.mesh.parts])[:, None]
            by_function = np.bincount(space.numbers.ravel(), shares.ravel(), space.n_functions)
            total += by_function[:, None] * load.gravity
        return total

    def supports(self) -> tuple[np.ndarray, np.ndarray]:
        """Return held directions and prescribed coefficients, shape (n_functions, 2)."""
        problem, space = self.problem, self.space
        held, values = np.zeros((space.n_functions, 2), dtype=bool), np.zeros((space.n_functions, 2))
        for support in problem.load.supports:
            for axis, value in enumerate((support.x, support.y)):
                if value is None:
                    continue
                if support.group in space.mesh.named:
                    functions = corners = np.array([space.mesh.named[support.group]])
                else:
                    sides = [ends for ends, _ in self.group_sides(support.group)]
                    functions = np.unique(np.concatenate([space.on_side(ends) for ends in sides]))
                    corners = np.unique(sides)
                other = np.asarray(held[corners, axis] & (values[corners, axis] != value))
                if other.any():
                    where = f"along {'xy'[axis]} at {in_words(space.mesh.points[corners[np.argmax(other)]])}"
                    both = f"supports prescribe {values[corners, axis][other][0]:g} and {value:g} m {where}"
                    why = "the energy is infinite: leave a gap between them"
                    raise ValueError(f"load {problem.load.name!r}: {both}; {why}")
                held[functions, axis], values[corners, axis] = True, value
        where = f"load {problem.load.name!r} of shape {problem.shape.name!r}"
        check_held(space.mesh.points, space.edges, held[: len(space.mesh.points)], where)
        return held, values

    def _solve(self, forces: np.ndarray, held: np.ndarray, given: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Return coefficients and residual forces, both (n_functions, 2), and the strain energy."""
        space, matrices = self.space, self._matrices()
        n, outer = len(space.corners), 2 * space.n_local_outer
        numbers = (2 * space.numbers[:, :, None] + np.arange(2)).reshape(n, -1)
        free = ~held.ravel()
        solution, load = np.where(held, given, 0.0).ravel(), forces.ravel()
        inner = numbers[:, outer:]
        coupled, stiff = matrices[:, outer:, :outer], matrices[:, outer:, outer:]
        eliminated = np.linalg.solve(stiff, np.concatenate([coupled, load[inner][:, :, None]], axis=2))
        taken = coupled.transpose(0, 2, 1) @ eliminated
        reduced, passed = matrices[:, :outer, :outer] - taken[:, :, :outer], taken[:, :, outer:]
        rows = numbers[:, :outer]
        right_side = load[: 2 * space.n_outer] - np.bincount(rows.ravel(), passed.ravel(), 2 * space.n_outer)
        known = (reduced @ solution[rows][:, :, None]).ravel()
        right_side -= np.bincount(rows.ravel(), known, 2 * space.n_outer)
        free_outer = free[: 2 * space.n_outer]
        order = np.cumsum(free_outer) - 1
        i, j = entry_places(rows)
        keep = free_outer[i] & free_outer[j]
        size = int(free_outer.sum())
        if size:
            matrix = coo_array((reduced.ravel()[keep], (order[i[keep]], order[j[keep]])), shape=(size, size)).tocsc()
            try:
                factor = factorize(matrix)
            except SingularError as error:
                raise ValueError(f"shape {self.problem.shape.name!r}: {error}; look at its supports") from error
            found = factor.solve(right_side[free_outer])
            found += factor.solve(right_side[free_outer] - matrix @ found)
            solution[: 2 * space.n_outer][free_outer] = found
        solution[inner] = eliminated[:, :, outer] - (eliminated[:, :, :outer] @ solution[rows][:, :, None])[:, :, 0]
        local = solution[numbers]
        internal = (matrices @ local[:, :, None])[:, :, 0]
        residual = np.bincount(numbers.ravel(), internal.ravel(), 2 * space.n_functions) - load
        energy = float((local * internal).sum() / 2)
        return solution.reshape(-1, 2), residual.reshape(-1, 2), energy

    def values(self) -> dict[str, float]:
        """Quantities of interest by name, and the energy by none."""
        return {quantity.name: self._value(quantity) for quantity in self.problem.load.quantities} | {"": self.energy}

    def _value(self, quantity: Quantity) -> float:
        space = self.space
        if quantity.kind == "energy":
            return self.energy
        if quantity.kind == "area":
            return float(self._area_growth().sum())
        if quantity.kind == "stress":
            # The mean in the triangles at its corner.
            rows, places = np.nonzero(space.corners == space.mesh.named[quantity.of])
            stresses = self._stresses(rows, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])[places])
            return float(stresses.mean(axis=0)[("xx", "yy", "xy").index(quantity.component)])
        axis = "xy".index(quantity.component)
        if quantity.kind == "reaction":
            return self._reaction(quantity.of, axis)
        if quantity.of in space.mesh.named:
            return float(self.field[space.mesh.named[quantity.of], axis])
        return float(self._shares(quantity.of) @ self.field[:, axis])

    def _reaction(self, group: str, axis: int) -> float:
        space, problem = self.space, self.problem
        # A corner where two supports meet has a share in both; layers make its force vanish.
        claims = np.zeros(len(space.mesh.points))
        for support in problem.load.supports:
            if (support.x, support.y)[axis] is not None and support.group not in space.mesh.named:
                claims[np.unique([ends for ends, _ in self.group_sides(support.group)])] += 1
        if group in space.mesh.named:
            point = space.mesh.named[group]
            return 0.0 if claims[point] else float(self.residual[point, axis])
        corners = np.unique([ends for ends, _ in self.group_sides(group)])
        return float((self.residual[corners, axis] / np.maximum(claims[corners], 1)).sum())

    def _at_quadrature(self, exact: int) -> tuple[np.ndarray, ...]:
        """Displacements' slopes by reference coordinates, derivatives and determinants of the map, and weights."""
        weights, _, gradients = triangles.tabulated(self.space.degree, exact)
        slopes = np.einsum("eic,qiu->eqcu", self.field[self.space.numbers], gradients, optimize=True)
        return slopes, *self.space.jacobians(gradients), weights

    def _area_growth(self) -> np.ndarray:
        """Divergence of the displacements times the areas of quadrature points [m2]."""
        slopes, jacobian, determinant, weights = self._at_quadrature(2 * self.space.degree)
        # The determinant cancels: cofactors of the map, with its sense.
        by_x = slopes[..., 0, 0] * jacobian[..., 1, 1] - slopes[..., 0, 1] * jacobian[..., 1, 0]
        by_y = slopes[..., 1, 1] * jacobian[..., 0, 0] - slopes[..., 1, 0] * jacobian[..., 0, 1]
        return (by_x + by_y) * np.sign(determinant) * weights

    def scale(self, kind: str) -> float:
        """Return the largest value of a kind of quantity in the body."""
        mesh = self.space.mesh
        motion = float(np.abs(self.field[: len(mesh.points)]).max())
        if kind == "displacement":
            return motion
        if kind == "area":
            return float(np.abs(self._area_growth()).sum())  # what shrinks apart from what grows
        if kind == "reaction":
            points = self.residual[: len(mesh.points)]
            return float(np.abs(points[self.held[: len(mesh.points)]]).sum())
        if kind == "stress":
            volume = self.problem.shape.thickness * float(signed_areas(mesh.points, mesh.triangles).sum())
            return float(np.sqrt(2 * max(self.energy, 0.0) * self.problem.stiffness.max() / volume))
        return self.energy

    def rotation_and_strain(self) -> tuple[float, float]:
        """Rotation [rad] and strain [1] by which the solution is judged."""
        slopes, jacobian, determinant, weights = self._at_quadrature(4)
        slopes = slopes @ triangles.inverse_of(jacobian, determinant)
        return most_rotation_and_strain(slopes.reshape(-1, 2, 2), (weights * np.abs(determinant)).ravel())

    def _locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Triangles of points, and their reference coordinates there."""
        space = self.space
        corners = space.mesh.points[space.corners]
        sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)
        inverse = np.linalg.inv(sides)
        heights = 1 / np.linalg.norm(np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1), axis=2)
        found, local = np.zeros(len(points), dtype=int), np.empty((len(points), 2))
        deepest = np.full(len(points), -np.inf)

        def look(cells: np.ndarray, rows: np.ndarray) -> None:
            """Take triangles for points where these are deeper inside than before; pairs by ascending point."""
            shares = np.einsum("pua,pa->pu", inverse[cells], points[rows] - corners[cells, 0])
            depths = (np.column_stack([1 - shares.sum(axis=1), shares]) * heights[cells]).min(axis=1)
            order = np.lexsort((depths, rows))
            last = order[np.flatnonzero(np.diff(rows[order], append=-1))]
            better = last[depths[last] > deepest[rows[last]]]
            deepest[rows[better]], found[rows[better]] = depths[better], cells[better]
            local[rows[better]] = shares[better]

        middles = corners.mean(axis=1)
        reach = 1.001 * np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
        near = spatial.cKDTree(points).query_ball_point(middles, reach)
        look(np.repeat(np.arange(len(corners)), [len(rows) for rows in near]), np.concatenate(near).astype(int))
        beside = np.flatnonzero(deepest < 0)  # of all triangles: those along arcs, and what is outside
        for rows in np.array_split(beside, max(1, len(beside) * len(corners) // 500_000)):
            look(np.tile(np.arange(len(corners)), len(rows)), np.repeat(rows, len(corners)))
        curved = np.flatnonzero(space.curved[found])
        for _ in range(20):
            if not len(curved):
                break
            values, gradients = triangles.shape_functions(space.degree, local[curved])
            at = space.places[space.numbers[found[curved]]]
            off = np.einsum("pi,pic->pc", values, at) - points[curved]
            jacobian = np.einsum("pic,pia->pca", at, gradients)
            step = np.linalg.solve(jacobian, off[:, :, None])[:, :, 0]
            local[curved] -= step
            curved = curved[np.flatnonzero(np.abs(step).max(axis=1) > 1e-13)]
        return found, local

    def at(self, points: np.ndarray, value: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
        """Values at points, some thousand at a time to save memory."""
        points = np.asarray(points, dtype=float)
        chunks = np.array_split(points, max(1, len(points) // 4000))
        return np.concatenate([value(*self._locate(chunk)) for chunk in chunks])

    def _displacements(self, found: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Displacements in triangles at reference coordinates [m], shape (n, 2)."""
        values, _ = triangles.shape_functions(self.space.degree, local)
        return np.einsum("pi,pic->pc", values, self.field[self.space.numbers[found]])

    def slopes(self, found: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Derivatives of displacements (component, axis) in triangles at reference coordinates, shape (n, 2, 2)."""
        _, gradients = triangles.shape_functions(self.space.degree, local)
        numbers = self.space.numbers[found]
        jacobian = np.einsum("pic,pia->pca", self.space.places[numbers], gradients)
        return np.einsum("pic,pia->pca", self.field[numbers], gradients) @ np.linalg.inv(jacobian)

    def _stresses(self, found: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Stresses in triangles at reference coordinates [Pa], shape (n, 3)."""
        slopes = self.slopes(found, local)
        strains = np.stack([slopes[:, 0, 0], slopes[:, 1, 1], slopes[:, 0, 1] + slopes[:, 1, 0]], axis=1)
        return np.einsum("pij,pj->pi", self.problem.stiffness[self.space.mesh.parts[found]], strains)
