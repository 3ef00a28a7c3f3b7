"""Predictions without a study: which definition on a mesh, how large its error, and which mesh keeps an error.

`choices` solves the definitions on one mesh, `search` finds the coarsest mesh that keeps an error.
"""
