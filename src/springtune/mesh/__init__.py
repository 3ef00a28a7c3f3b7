"""Meshes of beams and shapes: their types, quality, checks, named groups and files."""
