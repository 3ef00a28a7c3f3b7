"""An engine: explicit steps of springs."""

import numpy as np

import springtune as st


@st.engine("explicit", precisions=("float64",), iterates=False)
class Explicit:
    """Symplectic Euler: velocities change by the forces before a step, positions by the velocities after it."""

    def __init__(self, net, setting, damping):
        self.net, self.setting, self.damping = net, setting, damping
        self.moved, self.velocities = np.zeros(net.points.shape), np.zeros(net.points.shape)

    def advance(self, frames):
        """Take a number of frames."""
        net, step, (first, second) = self.net, self.setting.step, self.net.springs.T
        for _ in range(frames * self.setting.substeps):
            along = (net.points + self.moved)[second] - (net.points + self.moved)[first]
            pull = (net.stiffness * (1 - net.rest_lengths / np.linalg.norm(along, axis=1)))[:, None] * along
            forces = net.forces.copy()
            np.add.at(forces, np.append(first, second), np.append(pull, -pull, axis=0))
            self.velocities = (self.velocities + step * forces / net.masses[:, None]) / (1 + self.damping * step)
            self.moved += step * np.where(net.held, 0, self.velocities)

    def displacements(self):
        """Displacement of each particle [m]."""
        return self.moved.copy()
