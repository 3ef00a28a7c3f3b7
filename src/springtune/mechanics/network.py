"""Particles and springs: forces, tangent and factorized tangent of a network.

A spring of stiffness k_e and rest length L_e, with distance vector d and length l, pulls with ``k_e (l - L_e) d / l``.
Its exact tangent is ``k_e [(1 - L_e/l) I + (L_e/l) n n^T]`` with ``n = d / l``.

Scaling: each spring's stiffness is over one reference stiffness k [N/m], so forces are in m and energies in m2 (names
end in ``_over_k``), and ``s = F / k`` is the load. One solution in s serves all forces and reference stiffnesses of
equal F/k.
"""

import copy
from collections.abc import Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csc_array

from ..linalg import SOLVERS
from ..linalg.factors import CHOLESKY, Factor, SingularError, SuperLUFactor, factorize_pinned
from ..mesh.cells import Mesh
from ..problem.boundary import check_held
from .energies import Energy
from .pattern import Pattern

if TYPE_CHECKING:
    from ..linalg.kernels import Blocks

MULTIGRID_FROM_UNKNOWNS = 200_000
"""Unknowns above which multigrid replaces SuperLU: as fast there, with a third of the memory."""

NO_CHOLESKY_FROM_UNKNOWNS = 600_000
"""Unknowns above which multigrid also replaces Cholesky: faster there, with half the memory."""

MOST_CHOLESKY_UNKNOWNS = 2_500_000
"""Most unknowns for which Cholesky (2 kB each) replaces multigrid that does not converge; SuperLU: the number above."""

PINS_FROM_UNKNOWNS = 5_000
"""Unknowns above which an indefinite matrix gets a `PinnedFactor`; SuperLU is as fast on smaller ones."""


def successor(solver: str | None, unknowns: int, symmetric: bool, cholesky: bool = CHOLESKY) -> str | None:
    """Return the solver that takes over if conjugate gradients with multigrid do not converge."""
    direct = symmetric and cholesky
    most = MOST_CHOLESKY_UNKNOWNS if direct else NO_CHOLESKY_FROM_UNKNOWNS
    return ("Cholesky" if direct else "SuperLU") if solver is None and unknowns <= most else None


NO_STIFFNESS = 1e-12  # stiffness of a spring or a motion, over the stiffest spring, that counts as zero

SMALL_PIVOT = 1e-8  # pivot over the stiffest spring below which a mechanism is looked for


class FollowerPressure:
    """Pressure [1/m] that turns and grows with its edges (n, 2), which have the body to their left."""

    def __init__(self, mesh: Mesh, edges: np.ndarray, pressure: float | np.ndarray) -> None:
        self.edges = edges
        self.rest = mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]
        self.half = 0.5 * np.broadcast_to(pressure, len(edges))[:, None]
        turn = np.array([[0.0, -1.0], [1.0, 0.0]])
        on_either = np.block([-turn, turn])
        self.derivative = self.half[:, :, None] * np.vstack([on_either, on_either])

    @classmethod
    def of_side(cls, mesh: Mesh, edges: np.ndarray, axis: int) -> "FollowerPressure":
        """Return the pressure on a straight side of total force 1 at rest; `edges` (n, 2) may run either way."""
        along = mesh.points[edges[:, 1], axis] - mesh.points[edges[:, 0], axis]
        sign = 1 if axis == 0 else -1
        turned = np.where((sign * along < 0)[:, None], edges[:, ::-1], edges)
        return cls(mesh, turned, 1.0 / np.abs(along).sum())

    @cached_property
    def symmetric(self) -> "FollowerPressure":
        """A load with the symmetric part of the derivative."""
        load = copy.copy(self)
        load.derivative = 0.5 * (self.derivative + self.derivative.swapaxes(1, 2))
        return load

    def forces(self, displacements: np.ndarray) -> np.ndarray:
        """Return the forces on the particles [1], shape (n_points, 2)."""
        sides = self.rest + displacements[self.edges[:, 1]] - displacements[self.edges[:, 0]]
        field = np.zeros(displacements.shape)
        np.add.at(field, self.edges, (self.half * np.stack([-sides[:, 1], sides[:, 0]], axis=1))[:, None, :])
        return field


class Network:
    """Particles joined by springs, with some directions held (n_points, 2).

    Springs run from particle `first` to `second`, with `rest_vectors` (n_springs, 2) and `rest_lengths` [m];
    `stiffness` (n_springs,) is over the reference stiffness [1]. `unknowns` directions are free to move; `expand` and
    `reduce` are those of its `Pattern`.
    """

    def __init__(
        self,
        mesh: Mesh,
        held: np.ndarray,
        stiffness: np.ndarray,
        energies: Sequence[Energy] = (),
        like: "Network | None" = None,
        solver: str | None = None,
    ) -> None:
        if solver not in (None, *SOLVERS):  # a wrong name would be SuperLU's
            raise ValueError(f"unknown solver '{solver}'; known: {', '.join(SOLVERS)}")
        self.mesh, self.held, self.stiffness, self.solver = mesh, held, stiffness, solver
        self.energies = tuple(energies)
        self.has_springs = bool(np.any(stiffness)) or not self.energies
        self._indefinite = False  # the last matrix that was factorized, a large one
        pattern = Pattern(mesh, held) if like is None else like._pattern
        pattern = pattern if pattern.mesh is mesh else pattern.moved(mesh)
        self._pattern: Pattern = pattern
        self.unknowns, self.expand, self.reduce = pattern.size, pattern.expand, pattern.reduce
        self.first, self.second = pattern.first, pattern.second
        self.rest_vectors = mesh.points[self.second] - mesh.points[self.first]
        self.rest_lengths = mesh.edge_lengths

    def end_differences(self, displacements: np.ndarray) -> np.ndarray:
        """Difference of the displacements of each spring's ends [m], shape (n_springs, 2)."""
        return displacements.take(self.second, axis=0) - displacements.take(self.first, axis=0)

    def gather(self, forces: np.ndarray) -> np.ndarray:
        """Unknowns' share of spring forces, shape (n_springs, 2), that pull the first end towards the second."""
        return self.reduce(self._pattern.sum_springs(forces))

    # -- mechanics --------------------------------------------------------------------------------------------------

    def free_forces_over_k(self, displacements: np.ndarray, linear: bool = False) -> np.ndarray:
        """Return the internal forces over k [m], shape (unknowns,); `linear`: in linear kinematics."""
        return self.reduce((self.linear_forces_over_k if linear else self.forces_over_k)(displacements))

    def forces_over_k(self, displacements: np.ndarray) -> np.ndarray:
        """Return the internal forces at all particles over k [m], shape (n_points, 2)."""
        total = np.zeros(self.held.shape)
        if self.has_springs:
            total -= self._pattern.sum_springs(self._end_forces(displacements))
        for energy in self.energies:
            total += self._pattern.sum_cells(energy.corners, energy.forces(displacements))
        return total

    def _spring_vectors(self, displacements: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return each spring's vector [m], length [m] and growth of the squared length [m2], without cancellation."""
        relative = self.end_differences(displacements)
        vectors = self.rest_vectors + relative
        squares = np.einsum("ij,ij->i", self.rest_vectors + vectors, relative)
        return vectors, np.sqrt(np.einsum("ij,ij->i", vectors, vectors)), squares

    def _end_forces(self, displacements: np.ndarray) -> np.ndarray:
        """Return the force of each spring on its first end over k [m], shape (n_springs, 2)."""
        vectors, lengths, squares = self._spring_vectors(displacements)
        with np.errstate(divide="ignore", invalid="ignore"):
            pull = self.stiffness * squares / ((lengths + self.rest_lengths) * lengths)
        return pull[:, None] * vectors

    def spring_forces_over_k(self, displacements: np.ndarray, linear: bool = False) -> np.ndarray:
        """Return axial spring forces over k, tension positive [m]; energies are left out."""
        if linear:
            along = np.einsum("ij,ij->i", self.rest_vectors, self.end_differences(displacements))
            return self.stiffness * along / self.rest_lengths
        _, lengths, squares = self._spring_vectors(displacements)
        return self.stiffness * squares / (lengths + self.rest_lengths)

    def rounding(self, displacements: np.ndarray, linear: bool) -> np.ndarray:
        """Return the size of the rounding errors in internal forces [m], (unknowns,): only sums at particles round."""
        total = np.zeros(self.held.shape)
        if linear:
            apart = self.end_differences(displacements)
            sizes = np.abs(self._linear_end_forces(apart))
            if self.energies:
                sizes = sizes + np.einsum("abn,bn->na", np.abs(self._rest_couplings), np.abs(apart.T))
        else:
            sizes = np.abs(self._end_forces(displacements)) if self.has_springs else np.zeros(self.rest_vectors.shape)
            for energy in self.energies:
                total += self._pattern.sum_cells(energy.corners, np.abs(energy.forces(displacements)))
        total += self._pattern.sum_springs(sizes, -sizes)
        return np.finfo(float).eps * self.reduce(total)

    def _linear_end_forces(self, apart: np.ndarray) -> np.ndarray:
        """Return `_end_forces` in linear kinematics, from the differences of the ends' displacements."""
        normals = self.rest_vectors / self.rest_lengths[:, None]
        return (self.stiffness * np.einsum("ij,ij->i", normals, apart))[:, None] * normals

    def linear_forces_over_k(self, displacements: np.ndarray) -> np.ndarray:
        """Forces of a linear network against displacements, with held directions [m], shape (n_points, 2)."""
        apart = self.end_differences(displacements)
        resistance = -self._pattern.sum_springs(self._linear_end_forces(apart))
        if self.energies:
            at_first = np.einsum("abn,nb->na", self._rest_couplings, apart)
            at_second = np.einsum("ban,nb->na", self._rest_couplings, apart)
            resistance += self._pattern.sum_springs(at_first, at_second)
        return resistance

    @cached_property
    def _rest_couplings(self) -> np.ndarray:
        return self._pattern.cell_couplings(self.energies)

    def energy_over_k(self, displacements: np.ndarray) -> float:
        """Energy of the network over k [m2]."""
        _, lengths, squares = self._spring_vectors(displacements)
        springs = 0.5 * float(self.stiffness @ (squares / (lengths + self.rest_lengths)) ** 2)
        return springs + sum(energy.value(displacements) for energy in self.energies)

    def tangent(
        self, displacements: np.ndarray | None = None, follower: tuple[float, FollowerPressure] | None = None
    ) -> csc_array:
        """Derivative of internal forces [1], (unknowns, unknowns), symmetric except for a follower's part."""
        data = self._pattern.coupling_entries(self._couplings(displacements))
        if follower is not None:
            s, load = follower
            data -= s * self._pattern.entries(load.edges, load.derivative)
        return self._pattern.matrix(data)

    def blocks(self, displacements: np.ndarray | None = None) -> "Blocks":
        """Return `tangent` in blocks of 2 x 2."""
        return self._pattern.blocks(self._couplings(displacements))

    def _couplings(self, displacements: np.ndarray | None) -> np.ndarray:
        """Blocks of the tangent that couple the ends of each spring, shape (2, 2, n_springs)."""
        if not self.energies:
            return self._spring_couplings(displacements)
        at_rest, energies = displacements is None, self.energies
        couplings = self._rest_couplings.copy() if at_rest else self._pattern.cell_couplings(energies, displacements)
        if self.has_springs:
            couplings += self._spring_couplings(displacements)
        return couplings

    def _spring_couplings(self, displacements: np.ndarray | None) -> np.ndarray:
        """Share of the springs in `_couplings`."""
        if displacements is None:
            vectors, squares, ratio = self.rest_vectors, self.rest_lengths**2, np.ones(len(self.rest_lengths))
        else:
            vectors = self.rest_vectors + self.end_differences(displacements)
            squares = np.einsum("ij,ij->i", vectors, vectors)
            ratio = self.rest_lengths / np.sqrt(squares)
        along = self.stiffness * ratio / squares
        across = self.stiffness * (1.0 - ratio)
        x, y = vectors.T
        couplings = np.empty((2, 2, len(along)))
        couplings[0, 0] = -across - along * x * x
        couplings[0, 1] = couplings[1, 0] = -along * x * y
        couplings[1, 1] = -across - along * y * y
        return couplings

    @cached_property
    def local_stiffness(self) -> np.ndarray:
        """Return sums of stiffness about particles (n_points, 2); over mass they bound eigenvalues (Gershgorin)."""
        if self.energies:
            return self._pattern.row_sums(self._couplings(None))
        count, size = len(self.held), np.abs(self.stiffness)
        sums = 2 * (np.bincount(self.first, size, count) + np.bincount(self.second, size, count))
        return np.repeat(sums[:, None], 2, axis=1)

    def stiffness_of(self, particles: np.ndarray, matrices: np.ndarray) -> csc_array:
        """Assemble `matrices` (n, 2 m, 2 m) of groups of joined `particles` (n, m) with the tangent's sparsity."""
        return self._pattern.matrix(self._pattern.entries(particles, matrices))

    @cached_property
    def rest_factor(self) -> Factor:
        """Tangent factorized at rest; refused with its place where a part of the network is a mechanism."""
        slack = self._slack_springs()
        try:
            factor = self.factorize_tangent()
        except SingularError as error:
            raise SingularError(self._mechanism(slack) or str(error)) from error
        if slack.any() and getattr(factor, "least_pivot", np.inf) < SMALL_PIVOT * np.abs(self.stiffness).max():
            if mechanism := self._mechanism(slack):
                raise SingularError(mechanism)
        return factor

    def _slack_springs(self) -> np.ndarray:
        """Mask of the springs without stiffness, shape (n_springs,); none where no mechanism is looked for."""
        sizes = np.abs(self.stiffness)
        slack = sizes <= NO_STIFFNESS * sizes.max(initial=0.0)
        # Rounding has either sign; a contrast that somebody states has one, and is reported as ill-conditioned.
        looked_for = not self.energies and not self._by_multigrid and (self.stiffness[slack] <= 0).any()
        return slack if looked_for else np.zeros_like(slack)

    def _mechanism(self, slack: np.ndarray) -> str:
        """Say where slack springs let a part move without resistance, or return an empty string."""
        if not slack.any():
            return ""
        little = NO_STIFFNESS * np.abs(self.stiffness).max()
        more, less, rest = copy.copy(self), copy.copy(self), np.zeros(self.held.shape)
        more.stiffness, less.stiffness = self.stiffness + little, self.stiffness - little
        if not more.is_stable(rest) or less.is_stable(rest):
            return ""
        moved = self.expand(more.factorize_tangent().solve(np.random.default_rng(0).standard_normal(self.unknowns)))
        x, y = 1e3 * self.mesh.points[np.square(moved).sum(axis=1).argmax()]
        slack_springs = f"{slack.sum()} of {len(slack)} springs have no stiffness"
        where = f"near ({x:.4g}, {y:.4g}) mm a part moves without resistance"
        return f"{where}: {slack_springs}; take another definition or another mesh"

    def factorize_tangent(
        self, displacements: np.ndarray | None = None, follower: tuple[float, FollowerPressure] | None = None
    ) -> Factor:
        """Factorize the tangent at `displacements`, or at rest."""
        if self._by_multigrid and self._free_body:
            raise SingularError(self._free_body)
        if self._by_multigrid and not (self._by_cholesky and follower is None):
            return self._multigrid(displacements, follower)
        return self.factorize_matrix(self.tangent(displacements, follower), symmetric=follower is None)

    @cached_property
    def _free_body(self) -> str:
        """Reason why a separate body is free to move, or an empty string."""
        edges, whole = self.mesh.edges, self.energies or self.stiffness.all()
        try:
            check_held(self.mesh.points, edges if whole else edges[self.stiffness != 0], self.held, "the network")
        except ValueError as error:
            return str(error)
        return ""

    def factorize_matrix(self, matrix: csc_array, symmetric: bool = True) -> Factor:
        """Factorize a matrix with the tangent's sparsity, such as a sum of `stiffness_of`, by a direct solver."""
        return (symmetric and self._by_cholesky and self._cholesky(matrix)) or self._superlu(matrix)

    def _superlu(self, matrix: csc_array) -> SuperLUFactor:
        order, places, indices, pointers = self._pattern.elimination
        return SuperLUFactor(csc_array((matrix.data[places], indices, pointers), shape=matrix.shape), order)

    def _cholesky(self, matrix: csc_array) -> Factor | None:
        """Return Cholesky's factor, with pins if needed; None if they do not help."""
        tried = self._indefinite
        if tried and (pinned := self._factorize_pinned(matrix)):
            return pinned
        factor = self._pattern.analysis.factorize(matrix.data)
        self._indefinite = factor is None and self.unknowns > PINS_FROM_UNKNOWNS
        return self._factorize_pinned(matrix) if self._indefinite and not tried else factor

    def _factorize_pinned(self, matrix: csc_array) -> Factor | None:
        """Return Cholesky's factor with pins; None if they do not suffice, or are not needed."""
        factor = factorize_pinned(matrix, self._pattern.analysis, self._pattern.pins)
        return factor if factor is not None and factor.negative_pivots else None

    @property
    def _by_cholesky(self) -> bool:
        """Whether Cholesky's method is tried first."""
        if self.solver is None:
            return CHOLESKY and self.unknowns <= NO_CHOLESKY_FROM_UNKNOWNS
        return self.solver == "Cholesky"

    @property
    def _by_multigrid(self) -> bool:
        """Whether multigrid solves matrices that Cholesky's method does not factorize."""
        return self.solver == "multigrid" or self.solver is None and self.unknowns > MULTIGRID_FROM_UNKNOWNS

    def is_stable(self, displacements: np.ndarray, follower: tuple[float, FollowerPressure] | None = None) -> bool:
        """Return whether the tangent's symmetric part is positive definite; cheaper than `factorize_tangent`."""
        if follower is not None:
            follower = follower[0], follower[1].symmetric
        if self._by_cholesky:
            return self._pattern.analysis.factorize(self.tangent(displacements, follower).data) is not None
        try:
            if self._by_multigrid:
                return not self._free_body and self._multigrid(displacements, follower).negative_pivots == 0
            return self._superlu(self.tangent(displacements, follower)).negative_pivots == 0
        except SingularError:
            return False

    def _multigrid(self, displacements: np.ndarray | None, follower: tuple[float, FollowerPressure] | None) -> Factor:
        from ..linalg.multigrid import Multigrid

        next_one = successor(self.solver, self.unknowns, follower is None)

        def otherwise() -> Factor:
            matrix = self.tangent(displacements, follower)
            if factor := self._cholesky(matrix) if next_one == "Cholesky" else self._superlu(matrix):
                return factor
            raise SingularError("the tangent is singular, or unstable in more ways than pins can hold")

        besides = None
        if follower is not None:
            s, load = follower
            besides = self._pattern.loose_entries(load.edges, -s * load.derivative)
        at_rest = self.__dict__.get("rest_factor")
        like = at_rest if isinstance(at_rest, Multigrid) else None
        takes_over = otherwise if next_one else None
        return Multigrid(partial(self.blocks, displacements), self.mesh.points, self.held, takes_over, like, besides)

    def largest_stretch(self, displacements: np.ndarray) -> float:
        """Largest change of a spring's length over that at rest [1]."""
        return float(np.abs(self._spring_vectors(displacements)[1] / self.rest_lengths - 1.0).max())

    def largest_change(self, displacements: np.ndarray) -> float:
        """Largest change of a spring's vector over its length at rest [1]."""
        changes = self.end_differences(displacements)
        return float(np.sqrt(np.einsum("ij,ij->i", changes, changes) / self.rest_lengths**2).max())

    def inverted(self, displacements: np.ndarray) -> bool:
        """Whether any cell of the mesh is turned inside out."""
        return self.mesh.inverted(self.mesh.points + displacements)
