r"""Contact without penetration, with or without Coulomb friction, and without a penalty to tune.

No corner of an outline may lie behind the nearest edge of another body, in both directions. Even pressure through a
plane joint is exact on any two meshes. Each Newton step minimises the bodies' quadratic energy,

.. math:: \min_d \tfrac{1}{2} d^T K d - r^T d \quad \text{with} \quad g + G d \ge 0,

by its dual: a dense problem for the contact forces, with one unknown for each corner that is closed or nearly so. Each
body has its own factorized tangent; rigid bodies and floors have no unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import permutations
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, cholesky, solve_triangular
from scipy.optimize import nnls
from scipy.sparse import block_array, block_diag, csc_array, diags_array, eye_array, sparray, vstack
from scipy.sparse.linalg import splu

from ..linalg.factors import SingularError, factorize
from ..mesh.cells import Mesh
from ..mesh.sheets import outline_of
from .network import FollowerPressure, Network

REACH_SIZES = 2.0  # distance up to which corners and edges are watched, over the mesh size

FLOOR_SIZES = 1e4  # half of the floor's width, and its depth, over the mesh size

STRAIGHT_SINE = 1e-6  # sine of the angle below which two edges are taken for one line

JOINT_DISTANCE = 1e-6
"""Distance from the joint of two edges at which a corner counts as being there, over the mesh size."""

LONGEST_STEP = 0.5  # longest way of a particle in one Newton step, over the mesh size

CONTACT_TOLERANCE = 1e-9  # longest last Newton step, over the mesh size: its error is of the order of its square

MAX_CONTACT_STEPS = 40

SMALLEST_LOAD_STEP = 1e-4  # smallest step of the load [1]

DIAGONAL_SHIFTS = (1e-6, 1e-3, 1e-2, 1e-1, 1.0)
"""Diagonal shifts tried in turn to make a tangent definite, over its mean diagonal."""

DEPTH_TOLERANCE = 1e-9  # depth of a corner behind an edge that counts as zero, over the mesh size

CONTACT_COMPLIANCE = 1e-11  # compliance added at a contact, over the bodies' own [1]

MOST_EXCHANGES = 30  # how often a set of closed contacts is exchanged before non-negative least squares look for it

MOST_SET_CHANGES = 4  # how often a Newton step may change which contacts it takes for closed

FRICTION_TOLERANCE = 1e-6  # the tolerance in place of `CONTACT_TOLERANCE` with friction, which lags a step behind

FRICTION_SLIP = 1e-3
"""Slip over which friction grows to its limit, over the mesh size; what sticks creeps by about as much a load step."""


class ContactError(RuntimeError):
    """Contact has no equilibrium near the last good load step; the message says which."""


def oriented_outline(mesh: Mesh) -> np.ndarray:
    """Sides of the outline, the body on their left, shape (n, 2)."""
    sides, _ = outline_of(mesh)
    return sides[np.argsort(np.sort(sides, axis=1) @ [len(mesh.points), 1])]


def neighbours(outline: np.ndarray) -> np.ndarray:
    """Edge after and edge before each edge of an outline, shape (2, n)."""
    leaving, arriving = np.argsort(outline, axis=0).T  # edges by their starts, and by their ends
    found = np.empty((2, len(outline)), dtype=int)
    found[0, arriving], found[1, leaving] = leaving, arriving
    return found


class Body:
    """Network that other bodies touch; `forces` and `prescribed` displacements [m] are those at full load."""

    def __init__(
        self,
        network: Network,
        reference: float,
        forces: np.ndarray | None = None,
        pressure: FollowerPressure | None = None,
        force: float = 0.0,
        moves_little: bool = False,
        prescribed: np.ndarray | None = None,
    ) -> None:
        self.network, self.reference, self.prescribed = network, reference, prescribed
        self.forces = np.zeros(network.held.shape) if forces is None else forces
        self.pressure, self.force, self.moves_little = pressure, force, moves_little
        self.outline = oriented_outline(network.mesh)
        self.neighbours = neighbours(self.outline)
        self.displacements = np.zeros(network.held.shape)
        self._solver: tuple[csc_array, Callable[[np.ndarray], np.ndarray]] | None = None

    @property
    def points(self) -> np.ndarray:
        """Current positions of the particles [m], shape (n_points, 2)."""
        return self.network.mesh.points + self.displacements

    def missing(self, share: float) -> np.ndarray:
        """Loads less resistance at a share of the load [N], shape (unknowns,)."""
        network, moved = self.network, self.displacements
        load = network.reduce(share * self.forces)
        if self.pressure is not None:
            load = load + share * self.force * network.reduce(self.pressure.forces(moved))
        return load - self.reference * network.free_forces_over_k(moved, self.moves_little)

    def tangent(self, share: float, more: sparray | None = None) -> csc_array:
        """Return the symmetric tangent of resistance less load [N/m], plus `more`, at a share of the load."""
        if self.moves_little:
            tangent = self._rest_tangent
        else:
            follower = None if self.pressure is None else (share * self.force / self.reference, self.pressure)
            tangent = self.network.tangent(self.displacements, follower)
            if follower:
                # A pressure on a side with free ends is not quite conservative; the minimum needs a symmetric matrix.
                tangent = 0.5 * (tangent + tangent.T)
            tangent = (self.reference * tangent).tocsc()
        return tangent if more is None else (tangent + more).tocsc()

    @cached_property
    def _rest_tangent(self) -> csc_array:
        return (self.reference * self.network.tangent()).tocsc()

    def solver(self, tangent: csc_array) -> Callable[[np.ndarray], np.ndarray]:
        """Return a function from forces [N] to displacements [m]; an indefinite tangent is made definite."""
        if self._solver is not None and self._solver[0] is tangent:
            return self._solver[1]
        scale = float(np.abs(tangent.diagonal()).mean())
        # A little resistance to any motion: free bodies are held by contact alone, which the tangent does not know.
        for added in DIAGONAL_SHIFTS:
            matrix = (tangent + added * scale * eye_array(tangent.shape[0], format="csc")).tocsc()
            factor = factorize(matrix, self.network.solver)
            with suppress(SingularError):  # a zero pivot
                if not factor.negative_pivots:
                    break
        self._solver = tangent, factor.solve
        return self._solver[1]


class Obstacle:
    """Rigid polygon; `points` has shape (n, 2), counter-clockwise [m]."""

    def __init__(self, points: np.ndarray) -> None:
        self.points, numbers = points, np.arange(len(points))
        self.outline = np.stack([numbers, np.roll(numbers, -1)], axis=1)
        self.neighbours = neighbours(self.outline)


class _Sides:
    """Outline now, normals outwards; `turn`: sine of the turn at an edge's end, convex > 0; `wraps`: where concave."""

    def __init__(self, body: Body | Obstacle) -> None:
        first, last = body.outline.T
        self.start = body.points[first]
        side = body.points[last] - self.start
        self.length = np.linalg.norm(side, axis=1)
        self.along = along = side / self.length[:, None]
        self.normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
        after, _ = body.neighbours
        self.turn = along[:, 0] * along[after, 1] - along[:, 1] * along[after, 0]
        order = np.argsort(last)
        self.corners = last[order]
        self.meeting = np.stack([self.normals, self.normals[after]], axis=1)[order]
        both = self.meeting.sum(axis=1)
        self.outward = both / np.maximum(np.linalg.norm(both, axis=1, keepdims=True), 1e-12)
        self.wraps = (self.turn < -STRAIGHT_SINE)[order]


class Contacts(NamedTuple):
    """Corners near edges: `shares` [1] are their places along the edge, `gaps` [m] are negative behind it."""

    owners: np.ndarray
    corners: np.ndarray
    targets: np.ndarray
    edges: np.ndarray
    shares: np.ndarray
    normals: np.ndarray
    gaps: np.ndarray


_Quadratic = tuple[list[csc_array], list[np.ndarray], list[csc_array], np.ndarray, np.ndarray]
"""Problem of a Newton step: by body tangent, missing forces and rows of its contacts; gaps, and likely contacts."""


class Contact:
    """Bodies, rigid obstacles and a floor at y = 0, with the mesh `size` [m] and Coulomb's `friction` [1]."""

    def __init__(
        self,
        bodies: Sequence[Body],
        obstacles: Sequence[Obstacle] = (),
        floor: bool = False,
        size: float = 1e-3,
        friction: float = 0.0,
    ) -> None:
        self.bodies, self.size, self.friction = list(bodies), size, friction
        far = FLOOR_SIZES * size
        below = [Obstacle(np.array([[-far, -far], [far, -far], [far, 0.0], [-far, 0.0]]))] if floor else []
        self.all: list[Body | Obstacle] = [*bodies, *obstacles, *below]
        self.iterations, self.share = 0, 0.0
        self.contacts: Contacts | None = None
        self.forces, self.drag = np.zeros(0), np.zeros((0, 2))
        self._anchor = [body.displacements.copy() for body in self.bodies]

    # -- geometry ------------------------------------------------------------------------------------------------------

    def find(self) -> Contacts:
        """Return the corners near a facing edge of another body, with the nearest edge of each and some next ones."""
        none = np.zeros(0, dtype=int)
        parts = [Contacts(none, none, none, none.reshape(0, 2), np.zeros(0), np.zeros((0, 2)), np.zeros(0))]
        sides = [_Sides(body) for body in self.all]
        for owner in range(len(self.all)):
            for target in range(len(self.all)):
                if target != owner and min(owner, target) < len(self.bodies):
                    corners, *near = self._near_edges(owner, sides[owner], target, sides[target])
                    parts.append(Contacts(np.full(len(corners), owner), corners, np.full(len(corners), target), *near))
        return Contacts(*map(np.concatenate, zip(*parts)))

    def _near_edges(self, owner: int, own: _Sides, target: int, met: _Sides) -> tuple[np.ndarray, ...]:
        """Corners of one body near edges of another one, these edges, shares, normals and gaps."""
        places, (after, before) = self.all[owner].points[own.corners], self.all[target].neighbours
        rows, edge = self._facing_edges(places, own, met, before)
        ahead, behind = met.turn[edge] < -STRAIGHT_SINE, met.turn[before[edge]] < -STRAIGHT_SINE
        rows = np.concatenate([rows, rows[ahead], rows[behind]])
        edge = np.concatenate([edge, after[edge[ahead]], before[edge[behind]]])
        offset, normals = places[rows] - met.start[edge], met.normals[edge]
        shares = np.einsum("na,na->n", offset, met.along[edge]) / met.length[edge]
        gaps = np.einsum("na,na->n", offset, normals)
        return own.corners[rows], self.all[target].outline[edge], shares, normals, gaps

    def _facing_edges(
        self, places: np.ndarray, own: _Sides, met: _Sides, before: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Corners near an edge that faces them, by their number in the outline, and the nearest such edge of each."""
        reach = REACH_SIZES * self.size
        near = _near(met.start, places, reach)
        shown = np.flatnonzero(_near(places, met.start, reach + met.length))
        if not near.any() or not len(shown):
            return np.zeros(0, dtype=int), np.zeros(0, dtype=int)
        start, along, length, normals = (part[shown] for part in (met.start, met.along, met.length, met.normals))
        offset = places[near][:, None, :] - start[None, :, :]
        gaps = np.einsum("nea,ea->ne", offset, normals)
        shares = np.einsum("nea,ea->ne", offset, along) / length
        beyond = length * np.maximum(np.maximum(-shares, shares - 1), 0)
        # Of two edges equally near it is the one that faces the corner.
        facing = JOINT_DISTANCE * self.size * (1 + own.outward[near] @ normals.T)
        nearest = (np.hypot(gaps, beyond) + facing).argmin(axis=1)
        rows, edge = np.flatnonzero(near), shown[nearest]
        gaps, shares, beyond = (part[np.arange(len(rows)), nearest] for part in (gaps, shares, beyond))
        at_end, at_start = met.turn[edge], met.turn[before[edge]]
        slack = np.where(own.wraps[rows], JOINT_DISTANCE * self.size / met.length[edge], -1e-9)
        # Beyond the end of an edge is the next one's place, or nobody's, unless the two make a notch.
        beside = (shares < np.where(at_start > STRAIGHT_SINE, slack, -1e-9)) & (at_start >= -STRAIGHT_SINE)
        beside |= (1 - shares < np.where(at_end > STRAIGHT_SINE, slack, -1e-9)) & (at_end >= -STRAIGHT_SINE)
        beside |= np.hypot(gaps, beyond) > reach
        # The far face of a thin body is turned away from the corner.
        opposed = np.einsum("na,nba->nb", met.normals[edge], own.meeting[rows]).min(axis=1) < 0
        return rows[opposed & ~beside], edge[opposed & ~beside]

    def _rows(self, contacts: Contacts, directions: np.ndarray) -> list[csc_array]:
        """Derivative of the corners' way against the edges along directions, for each body: (unknowns, n_contacts)."""
        count = len(contacts.corners)
        columns = []
        for number, body in enumerate(self.bodies):
            own, met = np.flatnonzero(contacts.owners == number), np.flatnonzero(contacts.targets == number)
            shares = contacts.shares[met, None]
            particles = np.concatenate([contacts.corners[own], *contacts.edges[met].T])
            of = np.concatenate([own, met, met])
            values = np.concatenate([directions[own], -(1 - shares) * directions[met], -shares * directions[met]])
            held = body.network.held
            places = (2 * particles[:, None] + [0, 1], np.repeat(of[:, None], 2, axis=1))
            full = csc_array((values.ravel(), [place.ravel() for place in places]), shape=(held.size, count))
            columns.append(full.tocsr()[~held.ravel()].tocsc())
        return columns

    @property
    def penetration(self) -> float:
        """Largest depth of a corner inside another body or below the floor [m]."""
        corners = [one.points[np.unique(one.outline)] for one in self.all]
        sides = [one.points[one.outline].transpose(1, 0, 2) for one in self.all]
        pairs = [pair for pair in permutations(range(len(self.all)), 2) if min(pair) < len(self.bodies)]
        return float(max((_depth(corners[owner], *sides[target]) for owner, target in pairs), default=0.0))

    # -- mechanics -----------------------------------------------------------------------------------------------------

    def solve(self, first: float = 0.02) -> None:
        """Find the equilibrium under the whole load, in the longest load steps [1] that converge."""
        step = first
        while self.share < 1.0:
            step = min(step, 1.0 - self.share)
            kept = [body.displacements.copy() for body in self.bodies]
            count = self.newton(self.share + step)
            if count is None:
                for body, before in zip(self.bodies, kept):
                    body.displacements = before
                step *= 0.35
                if step < SMALLEST_LOAD_STEP:
                    raise ContactError(f"no equilibrium beyond {100 * self.share:.3g} % of the load")
                continue
            self.share += step
            self._anchor = [body.displacements.copy() for body in self.bodies]
            if count <= 12:
                step *= 2.0

    def newton(self, share: float) -> int | None:
        """Run Newton's method at a share of the load [1]."""
        near = False
        for body in self.bodies:
            if body.prescribed is not None:
                body.displacements = np.where(body.network.held, share * body.prescribed, body.displacements)
        for count in range(1, MAX_CONTACT_STEPS + 1):
            self.iterations += 1
            longest = self._step(share, near)
            if longest is None:
                return None
            near = longest <= LONGEST_STEP * self.size
            if longest <= (FRICTION_TOLERANCE if self.friction else CONTACT_TOLERANCE) * self.size:
                return None if any(body.network.inverted(body.displacements) for body in self.bodies) else count
        return None

    def _step(self, share: float, near: bool) -> float | None:
        """Take a bounded Newton step; return its largest displacement [m], or None. `near`: the last was short."""
        contacts = self.find()
        with np.errstate(all="ignore"):
            missing = [body.missing(share) for body in self.bodies]
        if not all(np.isfinite(part).all() for part in missing):
            return None
        known = self._last_forces(contacts)
        more = self._turning_stiffness(contacts, known)
        drag = np.zeros((len(known), 2))
        if self.friction:
            rubbing, stiffening, drag = self._friction(contacts, known)
            missing = [part + force for part, force in zip(missing, rubbing)]
            more = [rubbed if turned is None else turned + rubbed for turned, rubbed in zip(more, stiffening)]
        rows = self._rows(contacts, contacts.normals)
        try:
            tangents = [body.tangent(share, part) for body, part in zip(self.bodies, more)]
            quadratic = tangents, missing, rows, contacts.gaps, known > 0
            found = self._solve_closed(quadratic) if near else None
            if found is None:
                found = self._solve_opening(quadratic)
        except (RuntimeError, SingularError, ValueError, np.linalg.LinAlgError):
            return None
        steps, forces = found
        longest = max(np.abs(part).max() if len(part) else 0.0 for part in steps)
        if not np.isfinite(longest):
            return None
        shorter = min(1.0, LONGEST_STEP * self.size / longest) if longest > 0 else 1.0
        for body, part in zip(self.bodies, steps):
            body.displacements = body.displacements + body.network.expand(shorter * part)
        self.contacts, self.forces, self.drag = contacts, forces, drag
        return longest

    def _solve_opening(self, quadratic: _Quadratic) -> tuple[list[np.ndarray], np.ndarray]:
        """Return steps and forces of the minimum: under the likely contacts first, then with violated ones."""
        tangents, missing, rows, gaps, likely = quadratic
        solves = [body.solver(tangent) for body, tangent in zip(self.bodies, tangents)]
        steps = free = [solve(part) for solve, part in zip(solves, missing)]
        opening = gaps + sum(row.T @ part for row, part in zip(rows, free))
        forces, watched = np.zeros(len(gaps)), np.zeros(0, dtype=int)
        answers = [np.zeros((len(part), 0)) for part in free]
        more = np.flatnonzero(likely) if likely.any() else np.flatnonzero(opening < 0)[:1]
        while len(more):
            watched = np.concatenate([watched, more])
            for number, (solve, row) in enumerate(zip(solves, rows)):
                answers[number] = np.hstack([answers[number], solve(row[:, more].toarray())])
            schur = sum(row[:, watched].T @ answer for row, answer in zip(rows, answers))
            forces[watched] = _solve_complementarity(schur, opening[watched], likely[watched])
            steps = [part + answer @ forces[watched] for part, answer in zip(free, answers)]
            left = gaps + sum(row.T @ part for row, part in zip(rows, steps))
            left[watched] = 0.0
            # The worst first: most others are then kept, too.
            more = np.flatnonzero(left < min(-DEPTH_TOLERANCE * self.size, 0.5 * left.min()))
        return steps, forces

    def _solve_closed(self, quadratic: _Quadratic) -> tuple[list[np.ndarray], np.ndarray] | None:
        """Return the Newton step with the contacts that were closed; None if the set of closed contacts is unclear."""
        tangents, missing, rows, gaps, closed = quadratic
        scale = np.mean([np.abs(tangent.diagonal()).mean() for tangent in tangents])
        stacked, stiffness = vstack(rows, format="csc"), block_diag(tangents)
        sizes = np.cumsum([len(part) for part in missing])
        for _ in range(MOST_SET_CHANGES):
            conditions = stacked[:, np.flatnonzero(closed)]
            # Two corners may close one gap: a hair of compliance lets them share its force.
            corner = -1e-10 / scale * eye_array(conditions.shape[1], format="csc")
            matrix = block_array([[stiffness, -conditions], [-conditions.T, corner]], format="csc")
            answer = splu(matrix).solve(np.concatenate([*missing, gaps[closed]]))
            if not np.isfinite(answer).all():
                return None
            forces = np.zeros(len(gaps))
            forces[closed] = answer[sizes[-1] :]
            left = gaps + stacked.T @ answer[: sizes[-1]]
            pulls = closed & (forces < -1e-9 * np.abs(forces).max(initial=0.0))
            closes = ~closed & (left < -DEPTH_TOLERANCE * self.size)
            if not pulls.any() and not closes.any():
                return np.split(answer[: sizes[-1]], sizes[:-1]), np.maximum(forces, 0.0)
            closed = (closed & ~pulls) | closes
        return None

    def _last_forces(self, contacts: Contacts) -> np.ndarray:
        """Return the last step's contact forces on corners still near [N], shape (n_contacts,)."""
        old = self.contacts
        if old is None:
            return np.zeros(len(contacts.gaps))
        forces = dict(zip(zip(old.owners, old.corners, old.targets, old.edges[:, 0]), self.forces))
        keys = zip(contacts.owners, contacts.corners, contacts.targets, contacts.edges[:, 0])
        return np.array([forces.get(key, 0.0) for key in keys])

    def _turning_stiffness(self, contacts: Contacts, forces: np.ndarray) -> list[csc_array | None]:
        """Return the stiffness of contact forces as their edges turn, by body: the curvature of the gaps."""
        parts: list[csc_array | None] = [None] * len(self.bodies)
        for number, body in enumerate(self.bodies):
            met = np.flatnonzero((contacts.targets == number) & (forces > 0))
            if not len(met) or body.moves_little:
                continue
            edges = contacts.edges[met]
            start, end = (body.points[edges[:, i]] for i in range(2))
            side = end - start
            length = np.linalg.norm(side, axis=1)[:, None, None]
            along = (side / length[:, :, 0])[:, :, None]
            # From the start of the edge to the corner: along the edge, since the gap is closed.
            corner = contacts.shares[met][:, None] * side
            turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
            first, second = (corner @ turn.T)[:, :, None], (side @ turn)[:, :, None]
            sides = (first @ along.transpose(0, 2, 1) + along @ first.transpose(0, 2, 1)) / length**2
            mixed = -turn / length + along @ second.transpose(0, 2, 1) / length**2
            curvature = np.block([[sides, mixed], [mixed.transpose(0, 2, 1), 0 * sides]])
            change = np.kron([[-1, 1], [-1, 0]], np.eye(2))
            matrices = -forces[met][:, None, None] * (change.T @ curvature @ change)
            parts[number] = body.network.stiffness_of(edges, matrices)
        return parts

    def _friction(self, contacts: Contacts, forces: np.ndarray) -> tuple[list[np.ndarray], list[csc_array], np.ndarray]:
        """Forces and stiffness of friction, its normal forces those of the step before; its force at each contact."""
        tangents = np.stack([contacts.normals[:, 1], -contacts.normals[:, 0]], axis=1)
        rows = self._rows(contacts, tangents)
        slip = np.zeros(len(forces))
        for row, body, anchor in zip(rows, self.bodies, self._anchor):
            slip += row.T @ body.network.reduce(body.displacements - anchor)
        width = FRICTION_SLIP * self.size
        size = np.sqrt(slip**2 + width**2)
        pull = self.friction * forces * slip / size
        stiffness = self.friction * forces * width**2 / size**3 + 1e-3 * self.friction * forces / size
        parts = [(row @ diags_array(stiffness) @ row.T).tocsc() for row in rows]
        return [-(row @ pull) for row in rows], parts, -pull[:, None] * tangents

    def contact_force(self) -> np.ndarray:
        """Sum of the contact forces and friction on the bodies from obstacles and floor [N], shape (2,)."""
        bodies, contacts = len(self.bodies), self.contacts
        assert contacts is not None  # solved
        forces = self.forces[:, None] * contacts.normals + self.drag
        outer, inner = contacts.targets >= bodies, contacts.owners >= bodies
        return forces[outer].sum(axis=0) - forces[inner].sum(axis=0)


def _near(others: np.ndarray, places: np.ndarray, reach: np.ndarray | float) -> np.ndarray:
    """Mask of the places within reach of the box around others, shape (n,)."""
    reach = np.broadcast_to(reach, len(places))[:, None]
    return ((places >= others.min(axis=0) - reach) & (places <= others.max(axis=0) + reach)).all(axis=1)


def _depth(places: np.ndarray, start: np.ndarray, end: np.ndarray) -> float:
    """Largest depth of places inside a polygon of sides from start to end [m]."""
    places = places[_near(start, places, 0.0)]
    offset, side = places[:, None, :] - start, end - start
    with np.errstate(divide="ignore", invalid="ignore"):
        # Sides to the right of a place, at its height: an odd number of them where it is inside.
        crossing = start[:, 0] + (places[:, 1:] - start[:, 1]) * side[:, 0] / side[:, 1] > places[:, :1]
    passing = (start[:, 1] > places[:, 1:]) != (end[:, 1] > places[:, 1:])
    inside = (passing & crossing).sum(axis=1) % 2 == 1
    offset = offset[inside]
    shares = np.clip(np.einsum("nea,ea->ne", offset, side) / np.einsum("ea,ea->e", side, side), 0, 1)
    return np.linalg.norm(offset - shares[:, :, None] * side, axis=2).min(axis=1).max(initial=0.0)


def _solve_complementarity(schur: np.ndarray, opening: np.ndarray, likely: np.ndarray) -> np.ndarray:
    """Return forces >= 0 that open the gaps ``opening + schur @ forces`` to >= 0 and act on closed contacts alone.

    Primal-dual active set from the contacts `likely` to close (Hintermueller, Ito and Kunisch, SIAM J. Optim. 13:865,
    2002); non-negative least squares if it cycles. A small compliance lets redundant corners share a force.
    """
    # Corners of stiff and of soft bodies: each in units of its own compliance.
    own = np.diagonal(schur)
    unit = np.where(own > CONTACT_COMPLIANCE * own.max(), 1 / np.sqrt(np.maximum(own, 1e-300)), 0.0)
    matrix = unit[:, None] * (0.5 * (schur + schur.T)) * unit
    matrix[np.diag_indices(len(unit))] += CONTACT_COMPLIANCE
    right = -unit * opening
    closed = likely | (right > 0)
    for _ in range(MOST_EXCHANGES):
        forces = np.zeros(len(unit))
        at = np.flatnonzero(closed)
        try:
            forces[at] = cho_solve(cho_factor(matrix[np.ix_(at, at)], lower=True), right[at])
        except LinAlgError:
            break
        new = np.where(closed, forces > 0, matrix @ forces < right)
        if (new == closed).all():
            return unit * forces
        closed = new
    root = cholesky(matrix, lower=True)
    return unit * nnls(root.T, solve_triangular(root, right, lower=True), maxiter=30 * len(unit))[0]
