"""A meshed sheet and its networks: the recipe mesh, springs, network, problem, solve, judge."""

import hashlib
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeVar

import numpy as np

from ..mechanics.moduli import lateral_forces
from ..mechanics.network import FollowerPressure, Network
from ..mechanics.newton import Equilibrium
from ..mechanics.statics import StaticProblem
from ..mesh import Mesh
from ..mesh.groups import GroupedMesh
from ..problem.boundary import held, loaded_edges, measured, weights
from ..problem.loads import LoadKind
from ..problem.materials import AnyMaterial
from ..problem.quantities import nearest
from ..problem.status import Status
from ..springs import DEFINITIONS, Definition, DefinitionError, Springs
from ..springs.identification import Case, patch_cases

NETWORKS = 6
"""Factorized networks of a mesh that are kept: scenes come in an order in which few are enough."""


@dataclass(frozen=True)
class OwnDefinition:
    """A function of one's own in the place of a definition of `springtune.springs.DEFINITIONS`.

    Attributes
    ----------
    function : callable
        (mesh, material, thickness) -> Springs.
    """

    function: Callable[..., Springs]
    uniform: bool = False
    uniaxial: bool = False
    needs: str = ""
    finite_strain: bool = False

    @property
    def name(self) -> str:
        """What it is called in messages."""
        return getattr(self.function, "__name__", type(self.function).__name__)

    def springs(self, mesh: Mesh, material: AnyMaterial, thickness: float, given: object = None) -> Springs:
        """Springs of a mesh, checked."""
        found = self.function(mesh, material, thickness)
        if not isinstance(found, Springs):
            raise DefinitionError(f"returns {type(found).__name__}; return springtune.Springs(reference, relative)")
        if np.shape(found.relative) != (len(mesh.edges),) or not found.reference > 0:
            raise DefinitionError(
                f"returns {np.shape(found.relative)} stiffnesses over {found.reference!r} N/m; return one for each of "
                f"the {len(mesh.edges)} edges of the mesh, over a reference stiffness above zero"
            )
        return found


AnyDefinition = str | Definition | OwnDefinition | Callable[..., Springs]
"""Definition by its name, or a function of one's own."""

Entry = TypeVar("Entry")


def definition_of(definition: AnyDefinition) -> Definition | OwnDefinition:
    """Definition by its name, or of a function of one's own.

    Parameters
    ----------
    definition : str, Definition or callable
        Key of `springtune.springs.DEFINITIONS`, or (mesh, material, thickness) -> Springs.

    Examples
    --------
    >>> definition_of("lattice").name
    'lattice'
    """
    if isinstance(definition, Definition | OwnDefinition):
        return definition
    if callable(definition):
        return OwnDefinition(definition)
    return chosen(DEFINITIONS, definition, "definition")


def chosen(known: Mapping[str, Entry], name: object, what: str) -> Entry:
    """Entry of a mapping, or an error that says what there is."""
    if isinstance(name, str) and name in known:
        return known[name]
    raise ValueError(f"{what}: {name!r} is unknown; {nearest(str(name), known)}")


def check_stiffness(definition: Definition | OwnDefinition, stiffness: object) -> None:
    """Refuse a definition that lacks the uniform stiffness that it is told, or has one that it does not use."""
    if (definition.needs == "stiffness") == (stiffness is not None):
        return
    if stiffness is None:
        raise ValueError(
            f"stiffness: definition {definition.name!r} needs a uniform one; give a stiffness such as '170e6 N/m'"
        )
    raise ValueError(
        f"stiffness: {stiffness!r} is not used, since definition {definition.name!r} derives its own; leave it out, or "
        "choose 'paper'"
    )


@contextmanager
def named(definition: Definition | OwnDefinition) -> Iterator[None]:
    """Context in which a definition that refuses a mesh or material is named."""
    try:
        yield
    except DefinitionError as error:
        raise DefinitionError(f"definition {definition.name!r}: {error}") from None


@dataclass(frozen=True, eq=False)
class Loading:
    """What a load does to the particles of a mesh.

    Attributes
    ----------
    held : ndarray of bool, shape (n_points, 2)
        Directions that cannot move, or move as they are told.
    pattern : ndarray of float, shape (n_points, 2)
        Forces at rest for a factor of 1 [N].
    given : ndarray of float, shape (n_points, 2), or None
        Prescribed displacements for a factor of 1 [m]; None where there are none.
    follower : FollowerPressure or None
        Forces that turn with their sides for a factor of 1 [N].
    dead : ndarray of float, shape (n_points, 2), or None
        The pattern without those; None where they are all of it, or none.
    """

    key: tuple[object, ...]
    held: np.ndarray
    pattern: np.ndarray
    given: np.ndarray | None = None
    follower: FollowerPressure | None = None
    dead: np.ndarray | None = None


@dataclass(frozen=True)
class Solution:
    """An equilibrium of a network, judged.

    Attributes
    ----------
    load : float
        Force over the reference stiffness [m].
    negative_pivots : int or float
        Negative eigenvalues of the tangent; NaN where there is no equilibrium, or the tangent is singular.
    displacement : float
        Of the load [m], or the first quantity of a load case; NaN where there is no equilibrium.
    """

    problem: StaticProblem
    load: float
    equilibrium: Equilibrium
    status: Status
    message: str
    negative_pivots: float
    displacement: float


def solved(
    problem: StaticProblem, load: float, kinematics: str, displacement: Callable[[np.ndarray], float]
) -> Solution:
    """Equilibrium of a problem, judged.

    Parameters
    ----------
    load : float
        Force over the reference stiffness [m].
    displacement : callable
        What is read from displacements of the particles [m], shape (n_points, 2).
    """
    found = problem.linear(load) if kinematics == "linear" else problem.nonlinear(load)
    status, message, pivots = problem.judge(load, found)
    value = displacement(found.displacements) if found.converged else np.nan
    return Solution(problem, load, found, status, message, pivots, value)


class Sheet:
    """A meshed sheet on which scenes are solved.

    Networks that differ in their reference stiffness alone are assembled and factorized once; networks with the same
    directions held share their numbering of unknowns; the springs derived last are kept for further loads.

    Parameters
    ----------
    thickness : float
        Of the sheet [m].

    Attributes
    ----------
    held, weights, measured : callable
        Of a kind of load, see `springtune.problem.boundary`: directions held, pattern of the forces, and weights of the
        displacements that make its displacement; each computed once.
    deriving : float
        Seconds that deriving springs has taken so far.
    references : dict
        Those of load cases of a shape that have been solved.

    Examples
    --------
    >>> from springtune.mesh import MESH_TYPES
    >>> from springtune.problem.loads import LOADS
    >>> from springtune.problem.materials import Material
    >>> sheet = Sheet(MESH_TYPES["structured"](0.1, 0.02, 5e-3), 1e-3)
    >>> springs, _ = sheet.derive("lattice", Material(210e9, 0.3))
    >>> found = sheet.solve(LOADS["traction"].kind, springs, 20e3, "linear")
    >>> f"{found.status}: {1e3 * found.displacement:.3f} mm"
    'solved: 0.447 mm'
    """

    def __init__(self, mesh: Mesh, thickness: float, networks: int = NETWORKS, like: "Sheet | None" = None) -> None:
        self.mesh, self.thickness, self.deriving = mesh, thickness, 0.0
        self.held = cache(lambda kind: held(mesh, kind))
        self.weights = cache(lambda kind: weights(mesh, kind))
        self.measured = cache(lambda kind: measured(mesh, kind))
        self.references: dict[tuple[object, ...], Any] = {}
        self._most = networks
        self._derived: tuple[tuple[object, ...], Springs, float] | None = None
        shared = like is not None and mesh.shares_cells(like.mesh)
        self._patterns: dict[bytes, Network] = dict(like._patterns) if like is not None and shared else {}
        self._networks: dict[bytes, tuple[Network, dict[tuple[object, ...], StaticProblem]]] = {}

    def derive(
        self,
        definition: AnyDefinition,
        material: AnyMaterial,
        stiffness: float | None = None,
        case: tuple[LoadKind, float, np.ndarray | None] | None = None,
    ) -> tuple[Springs, float]:
        """Springs of a definition.

        Parameters
        ----------
        stiffness : float, optional
            Uniform stiffness [N/m], for definitions that are told one.
        case : tuple of LoadKind, float and ndarray, optional
            For definitions that are told cases: load, force [N] and displacements for 1 N that the network should have
            [m/N], shape (n_points, 2), or None where there are none; even tension and shear of the mesh itself without.
        """
        definition = definition_of(definition)
        key: tuple[object, ...] = definition, material, stiffness
        given: float | list[Case] | None = stiffness
        if definition.needs == "cases":
            given = patch_cases(self.mesh, material, self.thickness) if case is None else self._cases(*case)
            key += case[:2] if case else ()
        elif definition.needs == "stiffness" and stiffness is None:
            raise DefinitionError("needs a uniform stiffness, and there is none; give one in N/m")
        return self._once(key, lambda: definition.springs(self.mesh, material, self.thickness, given))

    def derive_on_shape(
        self,
        definition: Definition | OwnDefinition,
        materials: Mapping[str, AnyMaterial],
        grouped: GroupedMesh,
        stiffness: float | None = None,
        cases: list[Case] | None = None,
        case_key: tuple[object, ...] = (),
    ) -> tuple[Springs, float]:
        """As `derive`, of a body of any outline and of one material or more.

        Parameters
        ----------
        stiffness : float, optional
            Uniform stiffness [N/m], for definitions that are told one.
        """
        given = cases if definition.needs == "cases" else stiffness
        key = definition, grouped, tuple(materials.items()), stiffness, case_key if definition.needs == "cases" else ()
        if len(materials) == 1:
            (material,) = materials.values()
            return self._once(key, lambda: definition.springs(self.mesh, material, self.thickness, given))
        from ..springs.parts import derive_by_parts  # here: most bodies are of one material

        return self._once(key, lambda: derive_by_parts(definition, grouped, materials, self.thickness, given))

    def _once(self, key: tuple[object, ...], make: Callable[[], Springs]) -> tuple[Springs, float]:
        """Springs, and the seconds that deriving them took: the last ones are kept."""
        if self._derived is None or self._derived[0] != key:
            begin = time.perf_counter()
            springs = make()
            seconds = time.perf_counter() - begin
            self.deriving += seconds
            self._derived = key, springs, seconds
        return self._derived[1], self._derived[2]

    def _cases(self, kind: LoadKind, force: float, field: np.ndarray | None) -> list[Case]:
        if field is None:
            raise DefinitionError("needs the reference's displacements, and there are none")
        return [Case(self.held(kind), force * self.weights(kind), force * field)]

    def network(self, directions: np.ndarray, springs: Springs) -> Network:
        """Network of springs, some of its directions held.

        Parameters
        ----------
        directions : ndarray of bool, shape (n_points, 2)
            True where a particle cannot move in x or y.
        """
        return self._known(directions, springs)[0]

    def _known(
        self, directions: np.ndarray, springs: Springs
    ) -> tuple[Network, dict[tuple[object, ...], StaticProblem]]:
        """Network, and its problems so far."""
        parts = [directions, springs.relative, *(energy.key for energy in springs.energies)]
        name = hashlib.sha256(b"".join(bytes(memoryview(part).cast("B")) for part in parts)).digest()
        if name in self._networks:
            network, problems = self._networks.pop(name)
        else:
            like = self._patterns.get(directions.tobytes())
            network = Network(self.mesh, directions, springs.relative, springs.energies, like)
            problems = {}
            self._patterns.setdefault(directions.tobytes(), network)
        while len(self._networks) >= self._most:
            self._networks.pop(next(iter(self._networks)))
        self._networks[name] = network, problems  # the last one used is the last one to go
        return network, problems

    def pattern(self, kind: LoadKind, springs: Springs) -> np.ndarray:
        """Forces of a load of 1, those that go with the springs included [1], shape (n_points, 2)."""
        pattern = self.weights(kind)
        if springs.lateral:
            pattern = pattern + springs.lateral / np.ptp(self.mesh.points[:, 1]) * lateral_forces(self.mesh)
        return pattern

    def problem(self, kind: LoadKind, springs: Springs, follower: bool = False) -> StaticProblem:
        """Static problem of springs under a load."""
        network, problems = self._known(self.held(kind), springs)
        label = (kind, springs.lateral, follower)
        if label not in problems:
            turning = FollowerPressure.of_side(self.mesh, *loaded_edges(self.mesh, kind)) if follower else None
            problems[label] = StaticProblem(network, self.pattern(kind, springs), turning)
        return problems[label]

    def stated(self, loading: Loading, springs: Springs) -> StaticProblem:
        """Static problem of springs under any loading; at ``s = 1 / springs.reference`` it is the whole load."""
        network, problems = self._known(loading.held, springs)
        label = loading.key, None if loading.given is None else springs.reference
        if label not in problems:
            given = None if loading.given is None else springs.reference * loading.given
            problems[label] = StaticProblem(network, loading.pattern, loading.follower, dead=loading.dead, given=given)
        return problems[label]

    def solve(
        self, kind: LoadKind, springs: Springs, force: float, kinematics: str, follower: bool = False
    ) -> Solution:
        """Equilibrium of springs under a force, judged.

        Parameters
        ----------
        force : float
            With its sign [N].
        """
        problem = self.problem(kind, springs, follower)
        return solved(problem, force / springs.reference, kinematics, lambda moved: self.displacement(kind, moved))

    def displacement(self, kind: LoadKind, displacements: np.ndarray) -> float:
        """Displacement of a load [m] from those of the particles [m], shape (n_points, 2)."""
        return float(np.tensordot(displacements, self.measured(kind), axes=2))
