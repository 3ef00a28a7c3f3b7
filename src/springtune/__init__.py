"""springtune: which stiffness to give the springs of a 2-D mass-spring model, and how far off it then is."""

__version__ = "0.1.0"
