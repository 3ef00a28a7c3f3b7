"""Mechanics of spring networks: energies, equilibria, contact, motion; here the names of time integrators."""

from dataclasses import dataclass

EXPLICIT = ("symplectic-euler", "central-difference-lagged", "central-difference")
"""Explicit schemes; they differ in the velocity.

`symplectic-euler` gives it at the time of the displacements, to first order; central differences half a step before.
`central-difference` takes mass damping implicitly; spring dampers lag by half a step in all schemes.
"""

IMPLICIT = ("backward-euler", "implicit-midpoint")
"""Implicit schemes: SOFA's with one linear solve a step, and one of second order."""

INTEGRATORS = (*EXPLICIT, *IMPLICIT)

LAGGED_INTEGRATORS = ("symplectic-euler", "central-difference-lagged")
"""Schemes in which all damping lags, which reduces the stable step."""

PRECISIONS = ("float64", "float32")  # floating-point numbers that explicit schemes compute in

BEHAVIOURS = ("stable", "decaying", "growing", "nan")  # meanings of the flags of ``behaviour``: how a run treats noise


@dataclass(frozen=True)
class BackwardEuler:
    """Scheme ``backward-euler`` with conjugate-gradient `iterations` a step (None factorizes) and their `tolerance`."""

    iterations: int | None = None
    tolerance: float = 1e-5
