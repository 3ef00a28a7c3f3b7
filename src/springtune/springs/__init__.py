"""Definitions: rules that give every spring of a mesh its stiffness. One module each.

A definition is a function ``springs(mesh, material, thickness)`` that returns `Springs`; a stiffness or cases to
match come as a fourth argument. It raises `DefinitionError` for meshes or materials that it does not support. The
decorator `definition` declares it; `DEFINITIONS` finds all that this package's modules and the user declare. All
modules are imported for that, so slow imports (scipy, the network) belong inside functions.

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
