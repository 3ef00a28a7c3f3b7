"""Predictions without a study: which definition on a mesh, how large its error, and which mesh keeps an error."""
