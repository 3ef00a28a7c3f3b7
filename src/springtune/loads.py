"""Loads: how a beam is held and pulled.

::

    traction, compression          bending                       shear
     //+------------+->          //+------------+ ^           o  o  o  o  o  o     rollers: u_y = 0
     //|            |->          //|            | |          +--------------+ ->
     //|            |->          //|            | |          |              | ->
     //+------------+->          //+------------+ |          +--------------+
      clamped        even         clamped        even        ////// clamped

A load's displacement is the mean one of the loaded side, along the force.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Load:
    """A load.

    Attributes
    ----------
    kind : str
        What is held, and where and along what the force acts: ``"axial"``, ``"bending"`` or ``"shear"``.
    sign : float
        Sign of the force of a load [1]; tension is positive.
    """

    kind: str
    sign: float


LOADS = {
    "traction": Load("axial", 1.0),
    "compression": Load("axial", -1.0),
    "bending": Load("bending", 1.0),
    "shear": Load("shear", 1.0),
}
"""Loads by name."""

KINDS = ("axial", "bending", "shear")
"""Kinds of load; loads of one kind differ by a factor."""
