"""Beams of the grids and shapes: meshes, references, networks and sensitivity curves.

Files whose name begins with ``beam_`` or ``shape_`` are of beams or of shapes alone. Sections of beams and grids are in
`springtune.studies.config`, those of shapes here. The way of a scene: `beam_plan` and `shape_plan` make its tasks and
their keys, `stages` declares the stages that do them, each with a module of its name (`reference`, `mesh`,
`sensitivity`, `calibrate`, `solve`), `stored` reads what these stored, and `collect` makes rows of the groups that
`variables` declares.
"""
