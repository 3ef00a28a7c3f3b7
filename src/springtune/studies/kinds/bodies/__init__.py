"""Beams of the grids and shapes: meshes, references, networks and sensitivity curves.

`plan` makes the tasks of a study and their keys and declares the stages, each done by the module of its name
(`reference`, `mesh`, `sensitivity`, `calibrate`, `solve`). `stored` reads what they store, and `collect` makes rows of
it for the groups of the dataset that `variables` declares. Files whose names begin with ``beam_`` or ``shape_`` are of
beams or of shapes alone. Sections of beams and grids are in `springtune.studies.config`, those of shapes here.
"""
