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

A load's displacement is the mean of the loaded side along the force; under pressure, that of the side's middle.

To add a load, add a row to `OWN_LOADS`, and a `LoadKind` if its supports, side or direction are new. Other packages
have entry points in the group ``springtune.loads``.
"""

import hashlib
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from ..registry import NAME, NAME_RULE, ExtensibleMapping
from .shapes import Beam, LoadCase, Quantity, Support, Traction

MIDDLE = "middle"  # name of the middle of a pressed side, as a group


@dataclass(frozen=True, order=True)
class Side:
    """Side of a rectangle at the origin; `far` is True at the larger coordinate."""

    axis: int
    far: bool

    @property
    def name(self) -> str:
        """Name of the side as a group."""
        return (("left", "right"), ("bottom", "top"))[self.axis][self.far]

    def place(self, length: float, height: float) -> float:
        """Coordinate along `axis` of the side of a rectangle, in the unit of its length and height."""
        return (length, height)[self.axis] if self.far else 0.0


LEFT, RIGHT, BOTTOM, TOP = Side(0, False), Side(0, True), Side(1, False), Side(1, True)

AXES = (0, 1)  # directions that a clamp holds


@dataclass(frozen=True)
class LoadKind:
    """Supports, loaded side and direction of the force; `pressed` measures the side's middle instead of its mean.

    `held` has sides and their held axes: ``(0, 1)`` is a clamp, ``(1,)`` rollers on a horizontal side.
    """

    name: str
    loaded: Side
    axis: int
    held: tuple[tuple[Side, tuple[int, ...]], ...]
    pressed: bool = False

    def __str__(self) -> str:
        """Return the name."""
        return self.name

    @property
    def normal(self) -> int:
        """Axis normal to the loaded side."""
        return self.loaded.axis

    @property
    def along(self) -> int:
        """Axis along the loaded side."""
        return 1 - self.normal

    @property
    def direct(self) -> bool:
        """Whether the force is normal to the loaded side, in tension or compression, rather than along it."""
        return self.axis == self.normal

    @property
    def uniaxial(self) -> bool:
        """Whether the force stretches a beam along its length."""
        return self.direct and self.normal == 0

    @property
    def clamped(self) -> bool:
        """Whether the side opposite to the loaded one is clamped and nothing else is held."""
        return self.held == ((Side(self.normal, not self.loaded.far), AXES),)

    @property
    def mirrored(self) -> bool:
        """Whether the supports are symmetric about the middle of the loaded side."""
        held = {(side, *directions) for side, directions in self.held}
        return held == {(Side(side.axis, side.far != (side.axis == self.along)), *axes) for side, axes in self.held}

    @property
    def symmetric(self) -> bool:
        """Whether the beam under load is its own mirror image, and stays it in large displacements."""
        return self.direct and self.mirrored

    @property
    def cut(self) -> Side:
        """Side of the half model that lies on the axis of symmetry: of the upper half, or of the left one."""
        return BOTTOM if self.along == 1 else RIGHT

    @property
    def half_held(self) -> tuple[tuple[Side, tuple[int, ...]], ...]:
        """Supports of the half model, as `held`: on the axis of symmetry nothing moves normal to the force."""
        return (*((side, axes) for side, axes in self.held if side != self.cut), (self.cut, (1 - self.axis,)))

    @cached_property
    def case(self) -> LoadCase:
        """The kind as any load of a shape, whose groups are the sides of the rectangle; its force is 1 N."""
        supports = (Support(side.name, *(0.0 if n in axes else None for n in range(2))) for side, axes in self.held)
        force = (1.0, 0.0) if self.axis == 0 else (0.0, 1.0)
        where = MIDDLE if self.pressed else self.loaded.name
        quantity = Quantity("displacement", "displacement", where, "xy"[self.axis])
        return LoadCase(self.name, tuple(supports), (Traction(self.loaded.name, force),), quantities=(quantity,))

    def side_length(self, beam: Beam) -> float:
        """Length of the loaded side [m]."""
        return (beam.length, beam.height)[self.along]


AXIAL = LoadKind("axial", loaded=RIGHT, axis=0, held=((LEFT, AXES),))
BENDING = LoadKind("bending", loaded=RIGHT, axis=1, held=((LEFT, AXES),))
SHEAR = LoadKind("shear", loaded=TOP, axis=0, held=((BOTTOM, AXES), (TOP, (1,))))
FACE = LoadKind("face", loaded=TOP, axis=1, held=((BOTTOM, AXES),), pressed=True)


@dataclass(frozen=True)
class Load:
    """Load of a `kind`; `sign` is -1 against its axis, and a `follower` turns and grows with its side if nonlinear."""

    kind: LoadKind
    sign: float
    follower: bool = False


OWN_LOADS = {
    "traction": Load(AXIAL, 1.0),
    "compression": Load(AXIAL, -1.0),
    "bending": Load(BENDING, 1.0),
    "shear": Load(SHEAR, 1.0),
    "pressure": Load(FACE, -1.0),
    "follower-pressure": Load(FACE, -1.0, follower=True),
}
"""Loads of this package by name."""


class _Kinds(dict[str, LoadKind]):
    """Kinds of load by name; those of other packages are looked up when asked for."""

    def __missing__(self, name: str) -> LoadKind:
        self.update({load.kind.name: load.kind for load in LOADS.values() if load.kind.name == name})
        return {**self}[name]


LOAD_KINDS = _Kinds({load.kind.name: load.kind for load in OWN_LOADS.values()})  # kinds of load by name


def _check_load(name: str, load: Any) -> Load:
    """Check a load of another package, and put a hash into its kind's name: keys of results then depend on the kind."""
    if not NAME.fullmatch(name):
        raise ValueError(f"it cannot name a load; {NAME_RULE}")
    if type(load) is not Load or type(load.kind) is not LoadKind:
        raise ValueError(f"{load!r} is not a springtune.problem.loads.Load of a LoadKind")
    if load.kind in LOAD_KINDS.values():
        return load
    content = repr((load.kind.loaded, load.kind.axis, load.kind.held, load.kind.pressed))
    return replace(load, kind=replace(load.kind, name=f"{name}-{hashlib.sha256(content.encode()).hexdigest()[:8]}"))


LOADS = ExtensibleMapping("load", "loads", OWN_LOADS, _check_load)
"""Loads by name."""

KINEMATICS = ("nonlinear", "linear")
"""Kinematics under a load: springs that keep their length law, or their tangent at rest."""
