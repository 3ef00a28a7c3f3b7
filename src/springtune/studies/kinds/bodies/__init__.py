"""Beams of the grids and shapes: meshes, references, networks and sensitivity curves.

`plan` makes the tasks and their keys and declares the stages, each done by the module of its name. `stored` reads what
they store, and `collect` makes rows of it for the groups that `variables` declares. Files ``beam_*`` or ``shape_*`` are
of beams or of shapes alone.
"""
