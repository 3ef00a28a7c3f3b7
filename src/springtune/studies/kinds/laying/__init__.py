"""Strips laid on a trapezoid."""
