"""Scenes: the one recipe from a mesh to an answer, and what is read from it."""
