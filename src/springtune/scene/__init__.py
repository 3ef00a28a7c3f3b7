"""Scenes: the one recipe from a mesh to an answer, and what is read from it.

`single` has a scene and its result, `boundary_problem` what holds and loads its body, `mesh_cache` what scenes of a
mesh share. A stage of a study depends on the modules that it imports.
"""
