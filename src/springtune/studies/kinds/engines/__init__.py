"""Scenes in engines: how far off they are at a setting, and what a frame takes."""

SETTING = ("precision", "dt", "substeps", "iterations")
"""Parameters of a setting; a run has a factor on the typed stiffness besides."""

RUN_ENDS = ("not_requested", "rest", "swings", "moving", "diverged", "absent", "refused", "failed", "inverted")
"""How a run ends, in order of the flags of `engine_status`."""
