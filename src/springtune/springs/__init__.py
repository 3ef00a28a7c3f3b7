"""Definitions: rules that give every spring of a mesh its stiffness. One module each.

A definition is a function ``springs(mesh, material, thickness)`` that returns `Springs`; a stiffness or cases to match
come as a fourth argument. It raises `DefinitionError` for meshes or materials that it does not support. The decorator
`definition` declares it. All modules are imported for that, so slow imports (scipy, the network) belong inside
functions.
"""

from .base import DEFINITIONS, Definition, DefinitionError, Springs, definition

__all__ = ["DEFINITIONS", "Definition", "DefinitionError", "Springs", "definition"]
