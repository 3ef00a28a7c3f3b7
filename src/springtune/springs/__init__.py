"""Definitions: rules that give every spring of a mesh its stiffness. One module each.

A definition's module has ``springs(mesh, material, thickness, stiffness)`` and returns the reference stiffness [N/m]
and each spring's multiple of it, shape (n_edges,). `stiffness` is the uniform stiffness that a study or a calibration
hands to those definitions that do not derive one, and None for all others.
"""

from dataclasses import dataclass
from types import ModuleType

from . import calibrated, lattice, paper


@dataclass(frozen=True)
class Definition:
    """A definition as a study knows it.

    Attributes
    ----------
    name : str
        Label in a study and in the dataset.
    module : module
        Where its formula stands.
    uniform : bool
        Whether all springs have one stiffness, so that it is a number to report.
    """

    name: str
    module: ModuleType
    uniform: bool

    @property
    def summary(self):
        """First line of the module's docstring."""
        return self.module.__doc__.partition("\n")[0]

    def springs(self, mesh, material, thickness, stiffness=None):
        """Reference stiffness [N/m] and each spring's multiple of it [1]; see the module."""
        return self.module.springs(mesh, material, thickness, stiffness)


DEFINITIONS = {
    definition.name: definition
    for definition in (
        Definition("paper", paper, uniform=True),
        Definition("calibrated", calibrated, uniform=True),
        Definition("lattice", lattice, uniform=False),
    )
}
"""Definitions by name."""
