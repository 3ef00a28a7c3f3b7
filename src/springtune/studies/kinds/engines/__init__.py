"""Scenes in engines: error and time of a frame by setting."""

SETTING = ("precision", "dt", "substeps", "iterations")
"""Parameters of a setting; a run also has a factor on the typed stiffness."""

RUN_ENDS = ("not_requested", "rest", "swings", "moving", "diverged", "absent", "refused", "failed", "inverted")
"""How a run ends, in order of the flags of `engine_status`."""
