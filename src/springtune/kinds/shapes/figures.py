"""Figures of shapes."""
