"""Scenes of the grids: meshes, references, networks and sensitivity curves."""
