"""Names of time integrators, options of one of them, and what a run makes of noise."""

from dataclasses import dataclass

EXPLICIT = ("symplectic-euler", "central-difference-lagged", "central-difference")
"""Explicit schemes. Of the same steps, apart from the velocity: that of `symplectic-euler` belongs to the displacements
it comes with, to first order; that of central differences half a step earlier. `central-difference` takes damping in
proportion to mass implicitly; dampers along springs lag by half a step in all of them."""

IMPLICIT = ("backward-euler", "implicit-midpoint")
"""Implicit schemes: the first one in the manner of SOFA, one linear solve a step, the second one of second order."""

INTEGRATORS = (*EXPLICIT, *IMPLICIT)

LAGGED = ("symplectic-euler", "central-difference-lagged")
"""Schemes in which all damping lags, and narrows the step."""

PRECISIONS = ("float64", "float32")
"""Floating-point numbers that explicit schemes compute in."""

BEHAVIOURS = ("stable", "decaying", "growing", "nan")
"""Meanings of the flags of ``behaviour``: what a run makes of noise."""


@dataclass(frozen=True)
class BackwardEuler:
    """The scheme ``backward-euler`` with options, in the place of its name.

    Attributes
    ----------
    stiffness_damping : float
        Rayleigh's beta [s].
    iterations : int or None
        Conjugate-gradient iterations of each step; each is solved by a factorization without.
    tolerance : float
        Relative residual at which they end earlier [1]; SOFA's default.
    """

    stiffness_damping: float = 0.0
    iterations: int | None = None
    tolerance: float = 1e-5
