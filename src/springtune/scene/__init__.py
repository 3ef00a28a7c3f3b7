"""Scenes: the one recipe from a mesh to an answer, and what is read from it.

`sheet` has the recipe, springs to network to problem to equilibrium, and `statements` the problem of a beam or a shape;
`single` one scene and its result, `curve` the displacement over uniform stiffness, `moduli` patch tests, `motion` a
scene in time. `measured`, `identify` and `damping` go from tests to constants. A stage of a study depends on the
modules that it imports.
"""
