"""Cache that scenes of a mesh share, and the recipe of a scene: springs, network, problem, equilibrium, judgement."""

import hashlib
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from math import inf
from typing import Any, TypeVar, get_args

import numpy as np

from ..mechanics.continuum import lateral_forces
from ..mechanics.network import FollowerPressure, Network
from ..mechanics.newton import Equilibrium
from ..mechanics.statics import StaticProblem
from ..mesh.cells import Mesh, share_edges
from ..mesh.sheets import GroupedMesh
from ..problem.boundary import box, displacement_weights, even_weights, support_directions
from ..problem.loads import LoadKind
from ..problem.materials import AnisotropicMaterial, Material, Materials, check_isotropic
from ..problem.quantities import Status, choose, positive
from ..problem.shapes import Beam, Shape
from ..springs.base import DEFINITIONS, Definition, DefinitionError, Springs
from ..springs.identification import Case, patch_cases
from ..springs.parts import derive_by_parts

_T = TypeVar("_T")

NETWORKS_KEPT = 6  # factorized networks of a mesh that are kept; few are enough for scenes in order


EXAMPLES: dict[type, str] = {
    Beam: "springtune.Beam('200 mm', '40 mm')",
    Shape: "springtune.Shape.rectangle('200 mm', '40 mm')",
    Mesh: "springtune.make_mesh(beam, 'structured', '5 mm')",
    GroupedMesh: "springtune.mesh_shape(shape, '5 mm')",
    Material: "springtune.Material('210 GPa', 0.3)",
}
"""Calls that make arguments, for messages."""

AnyDefinition = str | Definition | Callable[..., Springs]
"""Definition, its name, or a function (mesh, material, thickness) -> Springs."""


def definition_of(definition: AnyDefinition) -> Definition:
    """Definition by its name, or of a function (mesh, material, thickness) -> Springs."""
    if isinstance(definition, Definition):
        return definition
    if callable(definition):
        name = getattr(definition, "__name__", type(definition).__name__)
        return Definition(name, definition, inf, False, (3, 4), False, "", True, False)
    return choose(DEFINITIONS, definition, "definition")


def check_type(value: object, wanted: type[_T] | Any, name: str) -> _T:
    """Return an argument of the expected type; refuse any other."""
    if wanted is Material and isinstance(value, AnisotropicMaterial):
        check_isotropic(value, "give a springtune.Shape, whose reference takes any material")
    if not isinstance(value, wanted):
        first: Any = (*get_args(wanted), wanted)[0]
        example = EXAMPLES.get(first, f"springtune.{first.__name__}(...)")
        raise ValueError(f"{name}: {value!r} is not a {first.__name__}; give one such as {example}")
    return value


def given_stiffness(definition: Definition, stiffness: float | str | None) -> float | None:
    """Return the uniform stiffness [N/m] of a definition that needs one; refuse a missing or an unused one."""
    name, needed = definition.name, definition.needs == "stiffness"
    if needed and stiffness is None:
        raise ValueError(f"stiffness: definition {name!r} needs a uniform one; give a stiffness such as '170e6 N/m'")
    if stiffness is not None and not needed:
        raise ValueError(f"stiffness: {stiffness!r} is not used, definition {name!r} derives its own; leave it out")
    return None if stiffness is None else positive(stiffness, "stiffness", "stiffness")


@contextmanager
def naming_errors(definition: Definition) -> Iterator[None]:
    """Context that adds the name of a definition to its errors."""
    try:
        yield
    except DefinitionError as error:
        raise DefinitionError(f"definition {definition.name!r}: {error}") from None


@dataclass(frozen=True, eq=False)
class Loading:
    """Supports and forces [N] of a load of factor 1, (n_points, 2); `dead` keep their direction, if others do not."""

    key: tuple[object, ...]
    held: np.ndarray
    pattern: np.ndarray
    given: np.ndarray | None = None
    follower: FollowerPressure | None = None
    dead: np.ndarray | None = None


def box_loading(grouped: GroupedMesh, kind: LoadKind, follower: bool) -> Loading:
    """Load of 1 N on a box; with `follower` it turns with its side."""
    side, (held, _) = kind.loaded.name, support_directions(grouped, kind.case)
    turning = FollowerPressure.of_side(grouped.mesh, grouped.sides[side], kind.along) if follower else None
    return Loading((kind, follower), held, even_weights(grouped, side, kind.axis), follower=turning)


@dataclass(frozen=True)
class Solution:
    """An equilibrium of a network, judged, NaN without one."""

    problem: StaticProblem
    equilibrium: Equilibrium
    status: Status
    message: str
    negative_pivots: float
    displacement: float


def solve_and_judge(
    problem: StaticProblem, load: float, kinematics: str, displacement: Callable[[np.ndarray], float]
) -> Solution:
    """Equilibrium of a problem, judged; `displacement` reads its value from displacements [m], (n_points, 2)."""
    found = problem.linear(load) if kinematics == "linear" else problem.nonlinear(load)
    status, message, pivots = problem.judge(load, found)
    value = displacement(found.displacements) if found.converged else np.nan
    return Solution(problem, found, status, message, pivots, value)


KnownNetwork = tuple[Network, dict[tuple[object, ...], StaticProblem]]  # network, and its problems so far


class MeshCache:
    """Cache of a meshed sheet of a thickness [m]; networks that differ in reference stiffness alone are one."""

    def __init__(
        self, mesh: Mesh, thickness: float, networks: int = NETWORKS_KEPT, like: "MeshCache | None" = None
    ) -> None:
        self.mesh, self.thickness, self.networks = mesh, thickness, networks
        self.loaded = box_of = cache(partial(box, mesh))
        self.loading = cache(lambda kind, follower=False: box_loading(box_of(kind), kind, follower))
        self.measured = cache(lambda kind: displacement_weights(box_of(kind), kind.case.quantities[0]))
        self.filled: set[Beam] = set()
        self.references: dict[tuple[object, ...], Any] = {}
        self._derived: tuple[tuple[object, ...], Springs, float] | None = None
        self._patterns: dict[bytes, Network] = dict(like._patterns) if like and share_edges(mesh, like.mesh) else {}
        self._networks: dict[bytes, KnownNetwork] = {}

    def derive(
        self,
        definition: AnyDefinition,
        material: Materials,
        stiffness: float | None = None,
        case: tuple[LoadKind | Loading, float, np.ndarray | None] | None = None,
        grouped: GroupedMesh | None = None,
    ) -> tuple[Springs, float]:
        """Derive the springs of a definition; return them and the seconds that this took.

        `case`, for fitted definitions, is a load, its factor, and target displacements; by default tension and shear.
        """
        definition = definition_of(definition)
        by_part = material if isinstance(material, Mapping) else {"": material}
        first, *others = by_part.values()
        given: float | list[Case] | None = stiffness
        key: tuple[object, ...] = definition, tuple(by_part.items()), grouped if others else None, stiffness
        if definition.needs == "cases" and not case:
            given = patch_cases(self.mesh, first, self.thickness)
        elif definition.needs == "cases" and case:
            loading, factor, field = self._loading(case[0]), *case[1:]
            if field is None:
                raise DefinitionError("needs the reference's displacements, and there are none")
            given = [Case(loading.held, factor * loading.pattern, factor * field)]
            key += loading.key, factor
        if self._derived is None or self._derived[0] != key:
            begin = time.perf_counter()
            if others and grouped is not None:
                springs = derive_by_parts(definition, grouped, by_part, self.thickness, given)
            else:
                springs = definition.springs(self.mesh, first, self.thickness, given)
            self._derived = key, springs, time.perf_counter() - begin
        return self._derived[1:]

    def network(self, directions: np.ndarray, springs: Springs) -> Network:
        """Network of springs that is held in some `directions`, shape (n_points, 2)."""
        return self._known(directions, springs)[0]

    def _known(self, directions: np.ndarray, springs: Springs) -> KnownNetwork:
        """Network, and its problems so far."""
        parts = [directions, springs.relative, *(energy.key for energy in springs.energies)]
        name = hashlib.sha256(b"".join(bytes(memoryview(part).cast("B")) for part in parts)).digest()
        known = self._networks.pop(name, None)
        if known is None:
            like = self._patterns.get(directions.tobytes())
            known = Network(self.mesh, directions, springs.relative, springs.energies, like), {}
            self._patterns.setdefault(directions.tobytes(), known[0])
        while len(self._networks) >= self.networks:
            self._networks.pop(next(iter(self._networks)))
        self._networks[name] = known  # the last one used is dropped last
        return known

    def _loading(self, load: LoadKind | Loading, follower: bool = False) -> Loading:
        return load if isinstance(load, Loading) else self.loading(load, follower)

    def pattern(self, load: LoadKind | Loading, springs: Springs) -> np.ndarray:
        """Forces of a load for a factor of 1, those that go with the springs included, shape (n_points, 2)."""
        pattern = self._loading(load).pattern
        if springs.lateral:
            pattern = pattern + springs.lateral / np.ptp(self.mesh.points[:, 1]) * lateral_forces(self.mesh)
        return pattern

    def problem(self, load: LoadKind | Loading, springs: Springs, follower: bool = False) -> StaticProblem:
        """Static problem of springs under a load; its factor is over the reference stiffness."""
        loading = self._loading(load, follower)
        network, problems = self._known(loading.held, springs)
        label = loading.key, springs.lateral, None if loading.given is None else springs.reference
        if label not in problems:
            given = None if loading.given is None else springs.reference * loading.given
            pattern = self.pattern(loading, springs)
            problems[label] = StaticProblem(network, pattern, loading.follower, dead=loading.dead, given=given)
        return problems[label]

    def solve(
        self, kind: LoadKind, springs: Springs, force: float, kinematics: str, follower: bool = False
    ) -> Solution:
        """Equilibrium of springs under a force with its sign [N], judged."""
        problem = self.problem(kind, springs, follower)
        return solve_and_judge(problem, force / springs.reference, kinematics, partial(self.displacement, kind))

    def displacement(self, kind: LoadKind, displacements: np.ndarray) -> float:
        """Displacement of a load [m] from those of the particles [m], shape (n_points, 2)."""
        return float(np.tensordot(displacements, self.measured(kind), axes=2))
