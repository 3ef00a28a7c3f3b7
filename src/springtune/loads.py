"""Loads: how a beam is held and pulled.

Every load clamps the left end (x = 0) and spreads a force along x evenly over the right end (x = length).
"""

DIRECTION = {"traction": 1.0, "compression": -1.0}
"""Sign of the end force of a load; tension is positive."""
