"""Definitions: rules that give every spring of a mesh its stiffness. One module each.

A definition is a function ``springs(mesh, material, thickness)`` that returns `Springs`; where it is told a uniform
stiffness or cases to match, these come as a fourth argument. It raises `DefinitionError` where it cannot live on a mesh
or with a material. The decorator `definition` declares it where it stands; `DEFINITIONS` finds all that the modules
of this package declare, and those of one's own. All modules are imported to be found, so what takes long to import
(scipy, the network) is imported inside the functions that need it.

Examples
--------
>>> from springtune.mesh import MESH_TYPES
>>> from springtune.problem.materials import Material
>>> from springtune.springs import DEFINITIONS
>>> list(DEFINITIONS)[:3]
['paper', 'calibrated', 'uniform']
>>> mesh = MESH_TYPES["structured"](0.2, 0.04, 5e-3)
>>> steel = Material(name="steel", young_modulus=210e9, poisson_ratio=0.3)
>>> springs = DEFINITIONS["lattice"].springs(mesh, steel, thickness=1e-3)
>>> print(f"{springs.reference:.4g} N/m inside, {springs.relative.min():g} of it on the outline")
1.819e+08 N/m inside, 0.5 of it on the outline
"""

from .base import DEFINITIONS, Definition, DefinitionError, Springs, definition

__all__ = ["DEFINITIONS", "Definition", "DefinitionError", "Springs", "definition"]
