"""Implicit Euler, linearised once a step: Baraff and Witkin, Large steps in cloth simulation, SIGGRAPH 1998.

A step solves ``(M + h^2 K) dv = h (f - h K v)`` by some iterations of conjugate gradients from ``dv = 0``, as SOFA's
EulerImplicitSolver with its CGLinearSolver, whose default is 25. It rests in our equilibrium at any number of
iterations; too few make it slow, or it does not come to rest. In single precision forces are still computed in double.
"""

import numpy as np

from ..handover.net import SpringNet
from ..handover.simulation import FORMULAS, network_of
from ..mechanics import BackwardEuler
from ..mechanics.dynamics import Motion
from ..mechanics.stepping import make_stepper
from .base import Setting, energy_parameters, engine

TOLERANCE = 1e-5  # relative residual that ends conjugate gradients: SOFA's default


@engine(
    "implicit-cg",
    order=50,
    laws=tuple(FORMULAS),
    parameters=energy_parameters(*FORMULAS),
    measured="1e-6, twenty scenes",
    source="Baraff 1998",
)
class ImplicitEuler:
    """Implicit Euler, linearised once a step, with iterations of conjugate gradients; SOFA takes 25."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        reference = float(net.header["reference_stiffness"])
        motion = Motion(network_of(net, reference), net.masses / reference, net.forces / reference)
        solver = BackwardEuler(setting.iterations, TOLERANCE)
        self.steps = make_stepper(motion, solver, setting.step, setting.precision or "float64")
        self.steps.begin(np.zeros_like(net.points), np.zeros_like(net.points))
        self.substeps, self.velocity_share = setting.substeps, 1 / (1 + damping * setting.step)

    def advance(self, frames: int) -> None:
        """Take a number of frames."""
        with np.errstate(all="ignore"):
            for _ in range(frames * self.substeps):
                self.steps.advance(1)
                self.steps.v = self.steps.v * self.velocity_share

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m]."""
        return self.steps.u.astype(float)
