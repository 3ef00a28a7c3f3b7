r"""Shapes: bodies of any outline with named groups, and their load cases.

::

                 upper                     An outline is a closed round of sides, counter-clockwise. A side runs from
          4 ---------------- 3             its corner to the next one, straight or along an arc about a centre, and
          |      ____        |             may belong to a named group.
     left |     / hole\      | right
          |     \____/       |             Supports, loads and quantities refer to groups: sides of the outline and of
          1 ---------------- 2             holes, points, and parts of the body with their own material.
                 lower

The module does not depend on meshes: `springtune.mesh.sheets` has the groups of one.
"""

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ..mesh.sides import OutlineSide, Point, Round, enclosed, extent, find_meeting, in_words, reverse_round, winds_about
from ..registry import NAME, NAME_RULE
from .quantities import Number, choose, nearest, positive, put, quantity


class AssumptionWarning(UserWarning):
    """An input violates an assumption of the model, such as a thin sheet."""


LEAST_SIDE, MOST_SIDE = 1e-5, 100.0  # longer sides of bodies [m] beyond which a unit is likely to be missing


def warn_of_body(sides: Sequence[float], thickness: float, what: str) -> None:
    """Warn if the longer side of a body [m] is likely to lack a unit, or if it is no thin sheet, as in plane stress."""
    smaller, longer = min(sides), max(sides)
    if not LEAST_SIDE <= longer <= MOST_SIDE:
        usual = f"more than {MOST_SIDE:g} m" if longer > MOST_SIDE else f"less than {1e6 * LEAST_SIDE:g} um"
        remedy = "check the unit: numbers in Python are in m, a text such as '200 mm' has its own"
        message = f"{what}: its longer side is {longer:.6g} m, {usual}; {remedy}"
        warnings.warn(message, AssumptionWarning, stacklevel=4)
    if thickness > smaller:
        why = f"{1e3 * thickness:g} mm exceeds its smaller side, {1e3 * smaller:.6g} mm; plane stress is of thin sheets"
        message = f"{what}, thickness: {why}; give a smaller thickness, or a material in plane strain"
        warnings.warn(message, AssumptionWarning, stacklevel=4)


@dataclass(frozen=True)
class Beam:
    """A rectangular sheet with its lower left corner at the origin.

    Parameters
    ----------
    length, height, thickness : float or str
        Extent along x, along y and out of the plane [m], or texts with their unit.
    name : str, optional
        Label; by default length and height in mm, e.g. ``"200x40"``.

    Raises
    ------
    ValueError
        If a length is not above zero, or a text not a length.

    Warns
    -----
    AssumptionWarning
        If it is thicker than its smaller side (plane stress is for thin sheets), or its longer side is more than 100 m
        or less than 10 um (numbers are in m).

    Examples
    --------
    >>> import springtune as st
    >>> st.Beam("200 mm", "40 mm"), st.Beam("80 mm", "30 mm", name="pad").label
    (Beam(length=0.2, height=0.04, thickness=0.001, name='200x40'), 'pad (80 x 30 mm)')
    """

    length: Number
    height: Number
    thickness: Number = 1e-3
    name: str = ""

    def __post_init__(self) -> None:
        for side in ("length", "height", "thickness"):
            put(self, **{side: positive(getattr(self, side), "length", side)})
        if not self.name:
            put(self, name=f"{1e3 * self.length:g}x{1e3 * self.height:g}")
        warn_of_body((self.length, self.height), self.thickness, f"beam {self.name!r}")

    @property
    def label(self) -> str:
        """Name and size of the sheet, for titles, see `beam_label`."""
        return beam_label(self.name, self.length, self.height)


def beam_label(name: str, length: float, height: float) -> str:
    """Return ``"200x40 mm"``, or ``"pad (80 x 30 mm)"`` for a name without the size [m]; only the name for NaN."""
    long, high = (round(1e3 * side, 9) for side in (length, height))
    if long != long or high != high:
        return name
    return f"{name} mm" if name == f"{long:g}x{high:g}" else f"{name} ({long:.4g} x {high:.4g} mm)"


def size_text(length: float, height: float) -> str:
    """Return extents [m] as text, such as ``80 x 30 mm``.

    >>> size_text(0.08, 0.06), size_text(80, 60), size_text(8e-5, 1e-6)
    ('80 x 60 mm', '80 x 60 m', '80 x 1 um')
    """
    longer = max(length, height)
    unit, name = (1.0, "m") if longer >= 10 else (1e-3, "mm") if longer >= 1e-4 else (1e-6, "um")
    return f"{length / unit:.4g} x {height / unit:.4g} {name}"


Place = tuple[Number, Number]  # coordinates [m]

SIDE_TOLERANCE = 1e-6
"""Distance from a side at which a named point is put on it, over the extent of the shape: coordinates are rounded."""


def _vector(value: Any, kind: str, name: str, example: str) -> tuple[float, float]:
    """Return both components of a quantity in SI units; refuse what is no pair."""
    if isinstance(value, str) or not (hasattr(value, "__len__") and len(value) == 2):
        raise ValueError(f"{name}: {value!r} is not x and y; give two such as {example}")
    x, y = value
    return quantity(x, kind, f"{name}, x"), quantity(y, kind, f"{name}, y")


def _place(value: Any, name: str) -> Point:
    """Return the coordinates of a point in m; refuse what is no point."""
    return _vector(value, "length", name, "('20 mm', '5 mm')")


def _check_name(value: object, what: str, *, empty: bool = False) -> None:
    """Refuse a name that is not allowed."""
    if not (isinstance(value, str) and (NAME.fullmatch(value) or (empty and not value))):
        raise ValueError(f"{what}: {value!r} cannot be a name; {NAME_RULE}")


def _tuple_of(values: Any, expected: type, name: str) -> tuple[Any, ...]:
    """Return a value, or several, as a tuple; refuse other types."""
    found = tuple(values) if isinstance(values, Iterable) else (values,)
    for one in found:
        if not isinstance(one, expected):
            raise ValueError(f"{name}: {one!r} is not a {expected.__name__}; give springtune.{expected.__name__}(...)")
    return found


@dataclass(frozen=True)
class Segment:
    """A side of an outline, from its corner to the next side's corner.

    Parameters
    ----------
    start : tuple of float or str
        Its corner [m], or texts with their unit.
    centre : tuple of float or str, optional
        Centre of an arc of less than half a turn; straight without. The arc is of a circle, or of an ellipse with its
        axes along x and y if its ends are not equally far from the centre.
    group : str, optional
        Name of its group, or empty.

    Raises
    ------
    ValueError
        If coordinates are not lengths, or the group's name is not allowed.

    Examples
    --------
    >>> import springtune as st
    >>> st.Segment(("20 mm", 0), group="lower")
    Segment(start=(0.02, 0.0), centre=None, group='lower')
    """

    start: Place
    centre: Place | None = None
    group: str = ""

    def __post_init__(self) -> None:
        put(self, start=_place(self.start, "start of a segment"))
        if self.centre is not None:
            put(self, centre=_place(self.centre, "centre of a segment"))
        _check_name(self.group, "group of a segment", empty=True)


def _round(segments: Sequence[Segment], what: str) -> tuple[OutlineSide, ...]:
    """Sides of a round of segments, checked by themselves."""
    least = 2 if any(segment.centre for segment in segments) else 3
    if len(segments) < least:
        raise ValueError(f"{what}: has {len(segments)} sides, and a round has 3 or more, with arcs 2; add sides")
    sides = []
    for number, (one, after) in enumerate(zip(segments, [*segments[1:], segments[0]]), 1):
        try:
            sides.append(OutlineSide(one.start, after.start, one.centre, one.group))
        except ValueError as error:
            raise ValueError(f"{what}, side {number}: {error}") from None
    return tuple(sides)


@dataclass(frozen=True)
class Hole:
    """A hole, or an inclusion.

    Parameters
    ----------
    outline : tuple of Segment
        A closed round, in either sense.
    part : str, optional
        Part of the body, of its own material, that fills it; a hole if empty.

    Raises
    ------
    ValueError
        If the round is not closed, the part's name is not allowed, or sides of an inclusion have a group: they are
        inside the body.

    Examples
    --------
    >>> import springtune as st
    >>> hole = st.Hole.circle(("50 mm", "20 mm"), "8 mm")
    >>> len(hole.outline), hole.outline[0].group
    (4, 'hole')
    >>> slot = st.Hole.ellipse(("50 mm", "20 mm"), "10 mm", "2 mm", group="slot")
    >>> [round(segment.start[0], 6) for segment in slot.outline]
    [0.06, 0.05, 0.04, 0.05]
    """

    outline: tuple[Segment, ...]
    part: str = ""

    def __post_init__(self) -> None:
        put(self, outline=_tuple_of(self.outline, Segment, "outline of a hole"))
        _check_name(self.part, "part of a hole", empty=True)
        what = f"part {self.part!r}" if self.part else "hole"
        _round(self.outline, what)
        groups = [segment.group for segment in self.outline if segment.group]
        if self.part and groups:
            raise ValueError(f"{what}: a side has the group {groups[0]!r}, but is inside the body; leave the group out")

    @classmethod
    def circle(cls, centre: Place, radius: Number, group: str | None = None, part: str = "") -> "Hole":
        """Make a circle of four arcs.

        Parameters
        ----------
        centre, radius : tuple of float or str, float or str
            [m], or texts with their unit.
        group : str, optional
            Group of its sides; by default ``"hole"``, or no group if a part fills it.
        part : str, optional
            As of `Hole`.

        Returns
        -------
        Hole
        """
        return cls.ellipse(centre, radius, radius, group, part)

    @classmethod
    def ellipse(cls, centre: Place, across: Number, along: Number, group: str | None = None, part: str = "") -> "Hole":
        """Make an ellipse of four arcs.

        Parameters
        ----------
        across, along : float or str
            Semi-axes along x and y [m].
        centre, group, part : optional
            As of `circle`.

        Returns
        -------
        Hole
        """
        x, y = _place(centre, "centre")
        a, b = positive(across, "length", "radius"), positive(along, "length", "radius")
        group = ("" if part else "hole") if group is None else group
        corners = [(x + a, y), (x, y + b), (x - a, y), (x, y - b)]
        return cls(tuple(Segment(corner, (x, y), group) for corner in corners), part)


@dataclass(frozen=True)
class Support:
    """Prescribed displacements of a group.

    Parameters
    ----------
    group : str
        Sides or a point.
    x, y : float or str, optional
        Prescribed displacement [m], or a text with its unit; 0 holds, None is free.

    Raises
    ------
    ValueError
        If it holds nothing, or a displacement is not a length.

    Examples
    --------
    Held along x, free along y:

    >>> import springtune as st
    >>> st.Support("left", x=0)
    Support(group='left', x=0.0, y=None)
    """

    group: str
    x: Number | None = None
    y: Number | None = None

    def __post_init__(self) -> None:
        _check_name(self.group, "group of a support")
        for axis in ("x", "y"):
            if getattr(self, axis) is not None:
                put(self, **{axis: quantity(getattr(self, axis), "length", f"support on {self.group!r}, {axis}")})
        if self.x is None and self.y is None:
            raise ValueError(f"support on {self.group!r}: holds neither x nor y; give x=0, y=0 or both")


@dataclass(frozen=True)
class Traction:
    """A force spread evenly over a group, by length.

    Parameters
    ----------
    group : str
        Sides, or a point.
    force : tuple of float or str
        Total force along x and y [N], or texts with their unit; ValueError for another unit.

    Examples
    --------
    >>> import springtune as st
    >>> st.Traction("right", ("4 kN", 0))
    Traction(group='right', force=(4000.0, 0.0))
    """

    group: str
    force: tuple[Number, Number]

    def __post_init__(self) -> None:
        _check_name(self.group, "group of a traction")
        put(self, force=_vector(self.force, "force", f"traction on {self.group!r}, force", "('4 kN', 0)"))


@dataclass(frozen=True)
class Pressure:
    """A pressure on a group, positive towards the body.

    Parameters
    ----------
    group : str
        Sides.
    pressure : float or str
        [Pa], or a text with its unit.
    follower : bool, optional
        Whether it turns and grows with the sides, in nonlinear kinematics.

    Raises
    ------
    ValueError
        If it is not a pressure.

    Examples
    --------
    >>> import springtune as st
    >>> st.Pressure("hole", "10 MPa")
    Pressure(group='hole', pressure=10000000.0, follower=False)
    """

    group: str
    pressure: Number
    follower: bool = False

    def __post_init__(self) -> None:
        _check_name(self.group, "group of a pressure")
        put(self, pressure=quantity(self.pressure, "stress", f"pressure on {self.group!r}"))
        if not isinstance(self.follower, bool):
            raise ValueError(f"pressure on {self.group!r}, follower: {self.follower!r}; give True or False")


COMPONENTS: dict[str, tuple[str, ...]] = {
    "displacement": ("x", "y"),
    "reaction": ("x", "y"),
    "stress": ("xx", "yy", "xy"),
    "area": (),
    "energy": (),
}
"""Kinds of quantities of interest, and their components."""


QUANTITY_UNITS = {"displacement": "m", "stress": "Pa", "reaction": "N", "area": "m2", "energy": "J"}
"""Unit of each kind of quantity."""


@dataclass(frozen=True)
class Quantity:
    """A quantity of interest.

    Parameters
    ----------
    name : str
        Label in the dataset.
    kind : str
        ``"displacement"``: of a point, or the mean of sides, by length [m]; ``"reaction"``: force of the supports on
        a group [N]; ``"stress"``: at a point, recovered from cells [Pa]; ``"area"``: growth of the body's area [m2];
        ``"energy"``: strain energy [J].
    of : str, optional
        Group or point; empty for area and energy.
    component : str, optional
        ``"x"`` or ``"y"``; of stress ``"xx"``, ``"yy"`` or ``"xy"``; empty for area and energy.
    expected : float or str, optional
        Published value in SI units, or a text with its unit.
    source : str, optional
        Its source.

    Raises
    ------
    ValueError
        If the kind is unknown, or the other fields do not fit it.

    Examples
    --------
    >>> import springtune as st
    >>> st.Quantity("tip", "displacement", of="right", component="y", expected="23.96 mm").expected
    0.02396
    """

    name: str
    kind: str
    of: str = ""
    component: str = ""
    expected: Number | None = None
    source: str = ""

    def __post_init__(self) -> None:
        _check_name(self.name, "quantity")
        what = f"quantity {self.name!r}"
        if components := choose(COMPONENTS, self.kind, f"{what}, kind"):
            _check_name(self.of, f"{what}, of")
            choose(dict.fromkeys(components), self.component, f"{what}, component")
        elif self.of or self.component:
            raise ValueError(f"{what}: {self.kind} is of the entire body; leave 'of' and 'component' out")
        if self.expected is not None:
            dimension = {"displacement": "length", "reaction": "force"}.get(self.kind, self.kind)
            put(self, expected=quantity(self.expected, dimension, f"{what}, expected"))


@dataclass(frozen=True)
class LoadCase:
    """Supports, loads and quantities of interest of a shape; the first quantity is the main one.

    Parameters
    ----------
    name : str
    supports : tuple of Support
    tractions : tuple of Traction, optional
    pressures : tuple of Pressure, optional
    gravity : tuple of float, optional
        Acceleration along x and y [m/s2]; needs densities.
    quantities : tuple of Quantity, optional

    Raises
    ------
    ValueError
        If there are no supports or no load, a direction of a group is held twice, or two quantities have one name.

    Examples
    --------
    >>> import springtune as st
    >>> pull = st.LoadCase(
    ...     "pull",
    ...     supports=(st.Support("left", x=0), st.Support("corner", y=0)),
    ...     tractions=(st.Traction("right", ("4 kN", 0)),),
    ...     quantities=(st.Quantity("elongation", "displacement", "right", "x"),),
    ... )
    >>> pull.quantities[0].of
    'right'
    """

    name: str
    supports: tuple[Support, ...]
    tractions: tuple[Traction, ...] = ()
    pressures: tuple[Pressure, ...] = ()
    gravity: tuple[float, float] = (0.0, 0.0)
    quantities: tuple[Quantity, ...] = ()

    def __post_init__(self) -> None:
        _check_name(self.name, "load")
        what = f"load {self.name!r}"
        kinds = {"supports": Support, "tractions": Traction, "pressures": Pressure, "quantities": Quantity}
        for name, kind in kinds.items():
            put(self, **{name: _tuple_of(getattr(self, name), kind, f"{what}, {name}")})
        put(self, gravity=_vector(self.gravity, "acceleration", f"{what}, gravity", "(0, -9.81), in m/s2"))
        if not self.supports:
            raise ValueError(f"{what}: has no supports, so nothing keeps the body in its place; add some")
        for axis in ("x", "y"):
            held = [support.group for support in self.supports if getattr(support, axis) is not None]
            if twice := [group for group in held if held.count(group) > 1]:
                raise ValueError(f"{what}: supports hold {twice[0]!r} along {axis} twice; remove one of them")
        moved = any(support.x or support.y for support in self.supports)
        if not (moved or self.tractions or self.pressures or any(self.gravity)):
            remedy = "give forces, or a support such as {end: {x: 1 mm}}"
            raise ValueError(f"{what}: neither moves nor pulls the body; {remedy}")
        names = [one.name for one in self.quantities]
        if twice := [name for name in names if names.count(name) > 1]:
            raise ValueError(f"{what}: two quantities are named {twice[0]!r}; rename one")


def check_names(
    case: LoadCase, sides: Iterable[str], points: Iterable[str], unusable: Mapping[str, str] | None = None
) -> None:
    """Refuse names of groups that are unknown, of the wrong kind, or `unusable` in a mesh file for the given reason."""
    sides, points, unusable = tuple(sides), tuple(points), unusable or {}
    both, where = (*sides, *points), f"load {case.name!r}"
    uses = [("support", one.group, both) for one in case.supports]
    uses += [("traction", one.group, both) for one in case.tractions]
    uses += [("pressure", one.group, sides) for one in case.pressures]
    of = {"displacement": both, "reaction": both, "stress": points}
    uses += [(f"quantity {one.name!r}", one.of, of[one.kind]) for one in case.quantities if one.kind in of]
    for what, name, known in uses:
        if name in known:
            continue
        if name in unusable:
            raise ValueError(f"{where}, {what}: {name!r} {unusable[name]}")
        if name in both:
            wrong = "is a point, and needs sides" if name in points else "is sides, and needs a point"
            raise ValueError(f"{where}, {what}: {name!r} {wrong}; {nearest(name, known)}")
        there = nearest(name, known) if known else "there are none; name some"
        raise ValueError(f"{where}, {what}: no group is named {name!r}; {there}")
    for one in [one for one in case.quantities if one.kind == "reaction"]:
        held = [support.group for support in case.supports if getattr(support, one.component) is not None]
        if one.of not in held:
            why = f"no support holds {one.of!r} along {one.component}; held: {', '.join(held) or 'none'}"
            raise ValueError(f"{where}, quantity {one.name!r}: {why}")


@dataclass(frozen=True)
class Shape:
    """A plane body.

    Parameters
    ----------
    name : str
    thickness : float or str
        [m], or a text with its unit.
    outline : tuple of Segment
        A closed round that does not cross itself; a clockwise one is turned. Empty if the body is a mesh file's.
    holes : tuple of Hole, optional
        Inside the body, apart from its outline and each other; one may be inside an inclusion.
    points : mapping of str to tuple of float, optional
        Named points of the body [m]: particles of every mesh. Points within a millionth of its extent from a side are
        moved onto it.
    loads : mapping of str to LoadCase, optional
    file : str, optional
        Mesh file whose cells are the body; empty with an outline.
    unit : float or str, optional
        Unit of the coordinates in the file [m].

    Raises
    ------
    ValueError
        If there is neither an outline nor a file, sides meet where they must not, holes or points are outside the
        body, or names are not allowed, used twice or unknown.

    Warns
    -----
    AssumptionWarning
        As of `Beam`, by the bounding box of a shape with an outline.

    Examples
    --------
    A plate with a hole, and one with a core:

    >>> import springtune as st
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[st.Hole.circle(("50 mm", "20 mm"), "8 mm")])
    >>> plate.label, plate.groups, plate.extent
    ('100x40 mm', ('lower', 'right', 'upper', 'left', 'hole'), ((0.0, 0.0), (0.1, 0.04)))
    >>> print(f"{1e6 * plate.area:.2f} mm2")  # 100 x 40 - pi 8^2
    3798.94 mm2
    >>> [(len(one.sides), one.inner, one.outer) for one in plate.rounds]
    [(4, '', None), (4, None, '')]
    >>> plate.part_at((0.01, 0.01)), plate.part_at((0.05, 0.02))
    ('', None)
    >>> core = st.Hole.circle(("50 mm", "20 mm"), "8 mm", part="core")
    >>> st.Shape.rectangle("100 mm", "40 mm", holes=[core]).parts
    ('core',)
    """

    name: str
    thickness: Number
    outline: Sequence[Segment] = ()
    holes: Sequence[Hole] = ()
    points: Mapping[str, Place] = field(default_factory=dict)
    loads: Mapping[str, LoadCase] = field(default_factory=dict)
    file: str = ""
    unit: Number = 1.0

    def __repr__(self) -> str:
        made_of = f"file {self.file}" if self.file else f"sides: {len(self.outline)}, holes: {len(self.holes)}"
        return f"Shape({self.name}, {made_of}, loads {', '.join(self.loads) or 'none'})"

    def __post_init__(self) -> None:
        _check_name(self.name, "shape")
        what = f"shape {self.name!r}"
        put(self, thickness=positive(self.thickness, "length", f"{what}, thickness"))
        put(self, unit=positive(self.unit, "length", f"{what}, unit"))
        put(self, outline=_tuple_of(self.outline, Segment, f"{what}, outline"))
        put(self, holes=_tuple_of(self.holes, Hole, f"{what}, holes"))
        put(self, points={name: _place(at, f"{what}, point {name!r}") for name, at in dict(self.points).items()})
        for name, load in dict(self.loads).items():
            _tuple_of([load], LoadCase, f"{what}, loads")
            if name != load.name:
                raise ValueError(f"{what}, loads: {name!r} has a load that is named {load.name!r}; give both one name")
        put(self, file=str(self.file))
        if bool(self.outline) == bool(self.file):
            both = "both an outline and a file" if self.file else "neither an outline nor a file"
            raise ValueError(f"{what}: has {both}; give one of them")
        if self.file:
            if self.holes or self.points:
                raise ValueError(f"{what}: holes and points are those of the file; leave them out")
            return
        try:
            self._check_rounds()
            put(self, points={name: self._place_point(name, point) for name, point in self.points.items()})
            for load in self.loads.values():
                check_names(load, self.groups, self.points)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
        (left, low), (right, high) = self.extent
        warn_of_body((right - left, high - low), self.thickness, what)

    def _check_rounds(self) -> None:
        """Refuse rounds that meet each other or themselves, or are at a wrong place; turn a clockwise outline."""
        sides = _round(self.outline, "outline")
        least = SIDE_TOLERANCE * max(high - low for low, high in zip(*extent(sides)))
        rounds = [("outline", sides)]
        rounds += [(f"hole {number}", _round(hole.outline, "hole")) for number, hole in enumerate(self.holes, start=1)]
        for what, one in rounds:
            short = [i for i, side in enumerate(one, 1) if math.dist(*extent([side])) < least]
            if short:
                raise ValueError(f"{what}, side {short[0]}: is shorter than a millionth of the shape; leave it out")
            for before, side in zip((one[-1], *one[:-1]), one):
                (x, y), (u, v) = before.slope(1.0), side.slope(0.0)
                if x * u + y * v < 0 and abs(x * v - y * u) < 1e-6 * math.hypot(x, y) * math.hypot(u, v):
                    raise ValueError(f"{what}: turns back on itself at {in_words(side.start)}; move a corner")
        if met := find_meeting([one for _, one in rounds]):
            (first, i), (second, j), where = met
            if first == second:
                both = f"sides {i + 1} and {j + 1} meet"
                raise ValueError(f"{rounds[first][0]}: {both} at {in_words(where)}; move a corner")
            raise ValueError(f"{rounds[second][0]} meets {rounds[first][0]} at {in_words(where)}; keep them apart")
        for what, one in rounds[1:]:
            if not winds_about(sides, one[0].start):
                raise ValueError(f"{what}: is outside the outline, at {in_words(one[0].start)}; move it")
        for (other_what, other), hole in zip(rounds[1:], self.holes):
            inside = [what for what, one in rounds[1:] if one is not other and winds_about(other, one[0].start)]
            if inside and not hole.part:
                raise ValueError(f"{inside[0]}: is inside {other_what}, where nothing is; remove one of them")
        if enclosed(sides) < 0:
            put(self, outline=tuple(Segment(one.start, one.centre, one.group) for one in reverse_round(sides)))
        if names := sorted({*self.groups} & {*self.points}):
            raise ValueError(f"{names[0]!r} names a point and sides; rename one of them")

    def _place_point(self, name: str, point: Point) -> Point:
        """A named point, on the side that it is next to."""
        _check_name(name, "point")
        near = SIDE_TOLERANCE * max(high - low for low, high in zip(*self.extent))
        for one in self.rounds:
            for side in one.sides:
                parameter, distance = side.nearest(point)
                if distance <= near:
                    corners = [corner for corner in (side.start, side.end) if math.dist(corner, point) <= near]
                    return corners[0] if corners else side.at(parameter)
        if self.part_at(point) is None:
            raise ValueError(f"point {name!r}: {in_words(point)} is not in the body; move it")
        for other, place in self.points.items():
            if 0 < math.dist(point, place) <= near:
                raise ValueError(f"points {name!r} and {other!r}: coincide at {in_words(point)}; make them one")
        return point

    @cached_property
    def rounds(self) -> tuple[Round, ...]:
        """The outline and those of holes, each counter-clockwise; empty for a mesh file."""
        if not self.outline:
            return ()
        given = [_round(hole.outline, "hole") for hole in self.holes]
        holes = [reverse_round(sides) if enclosed(sides) < 0 else sides for sides in given]
        found = [Round(_round(self.outline, "outline"), "")]
        filled = sorted((enclosed(sides), number) for number, sides in enumerate(holes) if self.holes[number].part)
        for number, (hole, sides) in enumerate(zip(self.holes, holes)):
            around = [other for _, other in filled if other != number and winds_about(holes[other], sides[0].start)]
            outer, which = (self.holes[around[0]].part, around[0] + 1) if around else ("", 0)
            found.append(Round(sides, hole.part or None, outer, which))
        return tuple(found)

    def part_at(self, point: Point) -> str | None:
        """Return the part of the body at a point that is on no side; None outside the body.

        Parameters
        ----------
        point : tuple of float
            [m]

        Returns
        -------
        str or None
            Empty in the main part.
        """
        around = [one for one in self.rounds if winds_about(one.sides, point)]
        return min(around, key=lambda one: one.area).inner if around else None

    @cached_property
    def area(self) -> float:
        """Area of the body [m2], exact for arcs; NaN for a mesh file."""
        return sum(one.area * (one.outer is None) - one.area * (one.inner is None) for one in self.rounds) or math.nan

    @cached_property
    def extent(self) -> tuple[Point, Point]:
        """Lower left and upper right corner of the bounding box [m]; NaN for a mesh file."""
        nowhere = math.nan, math.nan
        return extent(self.rounds[0].sides) if self.rounds else (nowhere, nowhere)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups of its sides, each once; empty for a mesh file."""
        rounds = [self.outline, *(hole.outline for hole in self.holes)]
        return tuple(dict.fromkeys(one.group for sides in rounds for one in sides if one.group))

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts that fill holes, each once."""
        return tuple(dict.fromkeys(hole.part for hole in self.holes if hole.part))

    @property
    def label(self) -> str:
        """Name and size, for titles; only the name for a mesh file."""
        (left, low), (right, high) = self.extent
        return beam_label(self.name, right - left, high - low)

    @classmethod
    def rectangle(
        cls,
        length: Number,
        height: Number,
        thickness: Number = 1e-3,
        name: str = "",
        holes: Iterable[Hole] = (),
        points: Mapping[str, Place] | None = None,
        loads: Mapping[str, LoadCase] | None = None,
    ) -> "Shape":
        """Make a rectangle at the origin with the sides ``lower``, ``right``, ``upper`` and ``left``.

        Parameters
        ----------
        length, height, thickness : float or str
            [m], or texts with their unit.
        name : str, optional
            By default its length and height in mm, e.g. ``"200x40"``.
        holes, points, loads
            As of `Shape`.

        Returns
        -------
        Shape

        Examples
        --------
        >>> import springtune as st
        >>> st.Shape.rectangle("200 mm", "40 mm").outline[2]
        Segment(start=(0.2, 0.04), centre=None, group='upper')
        """
        x, y = positive(length, "length", "length"), positive(height, "length", "height")
        corners = {"lower": (0.0, 0.0), "right": (x, 0.0), "upper": (x, y), "left": (0.0, y)}
        outline = tuple(Segment(corner, group=group) for group, corner in corners.items())
        name = name or f"{1e3 * x:g}x{1e3 * y:g}"
        return cls(name, thickness, outline, tuple(holes), dict(points or {}), dict(loads or {}))
