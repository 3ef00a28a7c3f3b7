r"""Shapes: bodies of any outline with named groups, and what is done to them.

::

                 upper                     an outline is a round of sides, counter-clockwise; each side is named by
          4 ---------------- 3             the group that it belongs to, and runs from its corner to the next one,
          |      ____        |             straight or along an arc about a centre.
     left |     / hole\      | right
          |     \____/       |             Groups hold what supports, loads and quantities speak of: sides of the
          1 ---------------- 2             outline and of holes, points, and parts of the body that have a material
                 lower                     of their own.

Nothing here knows a mesh: `springtune.mesh.groups` has the groups of one.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

Point = tuple[float, float]
"""Coordinates [m]."""


@dataclass(frozen=True)
class Segment:
    """A side of an outline, from its corner to that of the next one.

    Attributes
    ----------
    start : tuple of float
        Its corner [m].
    centre : tuple of float or None
        Of the arc that it is: of a circle, or of an ellipse with its axes along x and y where its ends are not equally
        far from it; the way of less than half a turn. Straight without.
    group : str
        Name of the group that it belongs to; none where it is empty.
    """

    start: Point
    centre: Point | None = None
    group: str = ""


@dataclass(frozen=True)
class Hole:
    """A hole, or what fills it.

    Attributes
    ----------
    outline : tuple of Segment
        A closed round, in either sense.
    part : str
        Part of the body that fills it, of a material of its own; nothing does where it is empty.
    """

    outline: tuple[Segment, ...]
    part: str = ""


@dataclass(frozen=True)
class Support:
    """What a group's displacement is.

    Attributes
    ----------
    group : str
        Sides or a point.
    x, y : float or None
        Prescribed displacement [m], zero where it is held; free without.
    """

    group: str
    x: float | None = None
    y: float | None = None


@dataclass(frozen=True)
class Traction:
    """A force that is spread evenly over a group, by length.

    Attributes
    ----------
    group : str
        Sides, or a point.
    force : tuple of float
        Total force along x and y [N].
    """

    group: str
    force: tuple[float, float]


@dataclass(frozen=True)
class Pressure:
    """A pressure on a group, positive towards the body.

    Attributes
    ----------
    group : str
        Sides.
    pressure : float
        [Pa]
    follower : bool
        Whether it turns and grows with the sides, in nonlinear kinematics.
    """

    group: str
    pressure: float
    follower: bool = False


QUANTITY_KINDS = ("displacement", "reaction", "stress", "area", "energy")
"""What a quantity of interest may be of."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of interest.

    Attributes
    ----------
    name : str
        Label in the dataset.
    kind : str
        ``"displacement"``: of a point, or the mean one of sides, by length [m]; ``"reaction"``: force of the supports
        on a group [N]; ``"stress"``: at a point, recovered from cells [Pa]; ``"area"``: growth of the area of the body
        [m2]; ``"energy"``: strain energy [J].
    of : str
        Group, or point; empty for area and energy.
    component : str
        ``"x"`` or ``"y"``; of stress ``"xx"``, ``"yy"`` or ``"xy"``; empty for area and energy.
    expected : float or None
        Value that others give, in SI units.
    source : str
        Who gives it.
    """

    name: str
    kind: str
    of: str = ""
    component: str = ""
    expected: float | None = None
    source: str = ""


@dataclass(frozen=True)
class LoadCase:
    """What is done to a shape, and what is asked of it; the first quantity stands for all where one is wanted.

    Attributes
    ----------
    name : str
    supports : tuple of Support
    tractions : tuple of Traction
    pressures : tuple of Pressure
    gravity : tuple of float
        Acceleration along x and y [m/s2]; needs densities.
    quantities : tuple of Quantity
    """

    name: str
    supports: tuple[Support, ...]
    tractions: tuple[Traction, ...] = ()
    pressures: tuple[Pressure, ...] = ()
    gravity: tuple[float, float] = (0.0, 0.0)
    quantities: tuple[Quantity, ...] = ()


@dataclass(frozen=True)
class Shape:
    """A plane body.

    Attributes
    ----------
    name : str
    thickness : float
        [m]
    outline : tuple of Segment
        Counter-clockwise; nothing where the body is that of a mesh file.
    holes : tuple of Hole
    points : mapping of str to tuple of float
        Named points [m]; those in supports and loads become particles of every mesh.
    loads : mapping of str to LoadCase
    file : str
        Mesh file whose cells are the body; empty where it has an outline.
    unit : float
        Unit of the coordinates in the file [m].
    """

    name: str
    thickness: float
    outline: tuple[Segment, ...] = ()
    holes: tuple[Hole, ...] = ()
    points: Mapping[str, Point] = field(default_factory=dict)
    loads: Mapping[str, LoadCase] = field(default_factory=dict)
    file: str = ""
    unit: float = 1.0
