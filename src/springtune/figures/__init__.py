"""Figures from the dataset; they compute no mechanics.

`names` says which figures a study has, without importing matplotlib; the other modules draw.
"""
