"""Scenes: a body with a mesh, material, load and definition, solved as a network and compared with its reference."""
