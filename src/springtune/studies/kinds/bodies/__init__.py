"""Beams of the grids and shapes: meshes, references, networks and sensitivity curves.

`kind` makes the tasks and declares the stages, each done by the module of its name; `stored` reads what they store, and
`collect` makes rows for the groups that `collect.csv` declares.
"""
