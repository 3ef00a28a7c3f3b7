"""Loads: how a beam is held and pulled.

::

    traction, compression          bending                       shear
     //+------------+->          //+------------+ ^           o  o  o  o  o  o     rollers: u_y = 0
     //|            |->          //|            | |          +--------------+ ->
     //|            |->          //|            | |          |              | ->
     //+------------+->          //+------------+ |          +--------------+
      clamped        even         clamped        even        ////// clamped

    pressure, follower-pressure
     v  v  v  v  v  v
    +----------------+
    |                |
    +----------------+
    ////// clamped

A load's displacement is the mean one of the loaded side, along the force; under pressure, that of the side's middle.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Load:
    """A load.

    Attributes
    ----------
    kind : str
        What is held, and where and along what the force acts: one of `KINDS`.
    sign : float
        Sign of the force of a load [1]; tension is positive.
    follower : bool
        Whether the force turns and grows with the side that it acts on, in nonlinear kinematics.
    """

    kind: str
    sign: float
    follower: bool = False


LOADS = {
    "traction": Load("axial", 1.0),
    "compression": Load("axial", -1.0),
    "bending": Load("bending", 1.0),
    "shear": Load("shear", 1.0),
    "pressure": Load("face", -1.0),
    "follower-pressure": Load("face", -1.0, follower=True),
}
"""Loads by name."""

KINDS = ("axial", "bending", "shear", "face")
"""Kinds of load; loads of one kind differ by a factor."""
