"""Definitions: rules that give every spring of a mesh its stiffness. One module each.

A definition is a function ``springs(mesh, material, thickness)`` that returns `Springs`; where it is told a uniform
stiffness or cases to match, these come as a fourth argument. It raises `DefinitionError` where it cannot live on a mesh
or with a material.
"""

import importlib
from dataclasses import dataclass

from .base import DefinitionError, Springs

__all__ = ["DEFINITIONS", "Definition", "DefinitionError", "Springs"]


@dataclass(frozen=True)
class Definition:
    """A definition as a study knows it.

    Attributes
    ----------
    name : str
        Label in a study and in the dataset.
    place : str
        Module and function where its formula stands.
    uniform : bool
        Whether all springs have one stiffness, so that it is a number to report.
    cells : tuple of int
        Numbers of corners of the cells that it can have.
    uniaxial : bool
        Whether it is for loads alone that stretch a beam along its length, see `LoadKind.uniaxial`.
    needs : str
        What it is told besides mesh, material and thickness: ``"stiffness"``, ``"cases"`` or nothing.
    """

    name: str
    place: str
    uniform: bool = False
    cells: tuple = (3, 4)
    uniaxial: bool = False
    needs: str = ""

    @property
    def function(self):
        """The function; its module is imported when first asked for."""
        module, _, name = self.place.partition(":")
        return getattr(importlib.import_module(f".{module}", __name__), name or "springs")

    @property
    def summary(self):
        """First line of the function's docstring, references to other docstrings left out."""
        return self.function.__doc__.partition("\n")[0].partition("; see `")[0].rstrip(".")

    def springs(self, mesh, material, thickness, given=None):
        """Springs of a mesh; `given` is what the definition `needs`, [N/m] or a list of cases."""
        arguments = (given,) if self.needs else ()
        return self.function(mesh, material, thickness, *arguments)


DEFINITIONS = {
    definition.name: definition
    for definition in (
        Definition("paper", "paper", uniform=True, needs="stiffness"),
        Definition("calibrated", "calibrated", uniform=True, needs="stiffness"),
        Definition("uniform", "uniform", uniform=True),
        Definition("density", "density", uniform=True),
        Definition("oriented", "oriented", uniform=True),
        Definition("lattice", "lattice"),
        Definition("lloyd", "lloyd"),
        Definition("van-gelder", "van_gelder", cells=(3,)),
        Definition("van-gelder-general", "van_gelder:general", cells=(3,)),
        Definition("baudet", "baudet", cells=(4,)),
        Definition("baudet-corrected", "baudet:corrected", cells=(4,), uniaxial=True),
        Definition("flechon", "baudet:incompressible", cells=(4,)),
        Definition("axis-exact", "axis_exact"),
        Definition("element-fit", "element_fit"),
        Definition("annealed", "annealed", needs="cases"),
        Definition("evolved", "evolved", needs="cases"),
        Definition("adjoint", "adjoint"),
        Definition("delingette-tensile", "delingette:tensile", cells=(3,)),
        Definition("patch", "patch"),
        Definition("patch-area", "patch:with_area"),
        Definition("area", "area"),
        Definition("angular", "angular", cells=(3,)),
        Definition("delingette", "delingette", cells=(3,)),
    )
}
"""Definitions by name."""
