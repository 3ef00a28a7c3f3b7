"""Experiments on numerical stability."""
