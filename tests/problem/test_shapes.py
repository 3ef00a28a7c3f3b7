"""Shapes: geometry of their sides in closed form, and what is refused."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as some

import springtune as st
from springtune.mesh.sides import OutlineSide

ORIGIN = (0.0, 0.0)


def outline(*corners, centres=(), group=""):
    """Segments of corners, some of them arcs about centres."""
    centres = dict(enumerate(centres))
    return [st.Segment(corner, centres.get(i), group) for i, corner in enumerate(corners)]


SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


@pytest.mark.parametrize("axes", [(1.0, 1.0), (2.0, 1.0), (0.3, 1.0)])
def test_arcs_are_on_their_ellipse_and_evenly_divided(axes):
    a, b = axes
    begin, turn = 0.3, 1.4
    start, end = ((a * math.cos(angle) + 5, b * math.sin(angle) - 3) for angle in (begin, begin + turn))
    side = OutlineSide(start, end, centre=(5.0, -3.0))
    assert side.arc == pytest.approx((a, b, begin, turn), rel=1e-9)
    points = [side.at(one) for one in side.divided(7)]
    assert points[0] == start and points[-1] == end
    assert [((x - 5) / a) ** 2 + ((y + 3) / b) ** 2 for x, y in points] == pytest.approx([1] * 8, rel=1e-9)
    lengths = [side.length_to(one) for one in side.divided(7)]
    assert lengths == pytest.approx([lengths[-1] * i / 7 for i in range(8)], abs=1e-9 * lengths[-1])
    # The length by many chords, whose error falls with their number's square.
    chords = [sum(math.dist(side.at(i / n), side.at((i + 1) / n)) for i in range(n)) for n in (500, 1000)]
    assert lengths[-1] == pytest.approx(chords[1] + (chords[1] - chords[0]) / 3, rel=1e-9)


def test_slopes_of_an_arc_are_its_own():
    side = OutlineSide((2.0, 0.0), (0.0, 1.0), centre=ORIGIN)
    assert side.slope(0.0) == pytest.approx((0, math.pi / 2), abs=1e-9)
    small = 1e-6
    for where in (0.2, 0.7):
        (x, y), (u, v) = side.at(where - small), side.at(where + small)
        assert side.slope(where) == pytest.approx(((u - x) / 2 / small, (v - y) / 2 / small), rel=1e-8)


def test_the_nearest_point_of_a_circle_is_on_its_radius():
    side = OutlineSide((1.0, 0.0), (0.0, 1.0), centre=ORIGIN)
    parameter, distance = side.nearest((1.5 * math.cos(0.4), 1.5 * math.sin(0.4)))
    assert (parameter, distance) == pytest.approx((0.4 / (math.pi / 2), 0.5), rel=1e-9)
    assert side.nearest((2.0, -1.0)) == pytest.approx((0.0, math.sqrt(2)))


def test_areas_are_those_of_closed_forms():
    le1 = outline((2, 0), (3.25, 0), (0, 2.75), (0, 1), centres=[None, ORIGIN, None, ORIGIN])
    assert st.Shape("le1", 0.1, le1).area == pytest.approx(math.pi / 4 * (3.25 * 2.75 - 2), rel=1e-9)
    # A half disc far away, of two arcs; and what is left where another is taken out.
    far = 1e3
    half = outline((far + 1, 0), (far, 1), (far - 1, 0), centres=[(far, 0), (far, 0)])
    assert st.Shape("half", 1e-3, half).area == pytest.approx(math.pi / 2, rel=1e-9)
    holes = [st.Hole.circle((0.5, 0.5), 0.1), st.Hole.ellipse((0.2, 0.2), 0.1, 0.05, part="core")]
    assert st.Shape.rectangle(1, 1, holes=holes).area == pytest.approx(1 - math.pi * 0.01, rel=1e-9)
    lens = outline((0, 0), (1, 0), centres=[(0.5, 1.0), (0.5, -1.0)])
    r2, half_angle = 1.25, math.atan2(0.5, 1.0)
    assert st.Shape("lens", 1e-3, lens).area == pytest.approx(
        r2 * (2 * half_angle - math.sin(2 * half_angle)), rel=1e-9
    )


@given(some.integers(3, 9), some.integers(0, 5), some.floats(0.3, 0.95))
def test_a_clockwise_outline_is_turned(count, first, inner):
    """Sides keep their groups."""
    corners = [
        (radius * math.cos(angle), radius * math.sin(angle))
        for i in range(count)
        for radius, angle in [(1 if i % 2 else inner, 2 * math.pi * (i + first / 7) / count)]
    ]
    names = [f"side{i}" for i in range(count)]
    forth = st.Shape("a", 1e-3, [st.Segment(corner, group=name) for corner, name in zip(corners, names)])
    # The round from its first corner the other way: a side there ends where it began.
    corners = [corners[0], *corners[:0:-1]]
    back = st.Shape("b", 1e-3, [st.Segment(corner, group=name) for corner, name in zip(corners, names[::-1])])
    assert back.area == pytest.approx(forth.area, rel=1e-9) and forth.area > 0
    ends = [{side.group: (side.start, side.end) for side in shape.rounds[0].sides} for shape in (forth, back)]
    assert ends[0] == ends[1]


def test_what_is_around_a_round_is_the_smallest_part():
    rings = [st.Hole.circle((0.5, 0.5), radius, part=f"r{radius}") for radius in (0.2, 0.4, 0.3)]
    nested = st.Shape.rectangle(1, 1, holes=[*rings, st.Hole.circle((0.5, 0.5), 0.1)])
    found = [(one.inner, one.outer, one.around) for one in nested.rounds]
    around = ("r0.2", "r0.3", 3), ("r0.4", "", 0), ("r0.3", "r0.4", 2), (None, "r0.2", 1)
    assert found == [("", None, None), *around]
    assert [nested.part_at((x, 0.5)) for x in (0.05, 0.15, 0.25, 0.35, 0.5, 2.0)] == [
        "", "r0.4", "r0.3", "r0.2", None, None
    ]  # fmt: skip


def test_points_by_a_side_are_put_on_it():
    """Coordinates of a point on an arc have few digits."""
    quarter = outline(ORIGIN, (0.1, 0), (0, 0.1), centres=[None, ORIGIN])
    shape = st.Shape(
        "quarter", 1e-3, quarter, points={"on": ("70.7107 mm", "70.7107 mm"), "in": (0.05, 0.02), "o": (1e-9, 0)}
    )
    assert math.hypot(*shape.points["on"]) == pytest.approx(0.1, rel=1e-9)
    assert shape.points["in"] == (0.05, 0.02) and shape.points["o"] == ORIGIN


def test_what_a_shape_measures_is_its_label():
    le1 = outline((2, 0), (3.25, 0), (0, 2.75), (0, 1), centres=[None, ORIGIN, None, ORIGIN])
    assert st.Shape("le1", 0.1, le1).label == "le1 (3250 x 2750 mm)"
    bulge = st.Shape("bulge", 1e-3, outline(*SQUARE, centres=[None, (0.5, 0.5)]))
    assert bulge.extent == ((0, 0), pytest.approx((0.5 + math.sqrt(0.5), 1)))
    own = st.Shape("own", "1 mm", file="own.msh", unit="1 mm")
    assert own.label == "own" and own.rounds == () and math.isnan(own.area) and own.unit == 1e-3
