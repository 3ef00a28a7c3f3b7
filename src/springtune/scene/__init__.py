"""Scenes: the one recipe from a mesh to an answer, and what is read from it.

`single` has a scene and its result, `boundary_problem` what holds and loads its body, `mesh_cache` the recipe from
springs to network to equilibrium and what scenes of a mesh share. `curve` has the displacement over uniform stiffness,
`moduli` patch tests, `motion` a scene in time; `measured` and `identify` go from tests to constants. A stage of a study
depends on the modules that it imports.
"""
