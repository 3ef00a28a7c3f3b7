"""Measured tests of sheets: forces with displacements, or displacements of points, from CSV files."""

import math
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from ..mesh.formats import read_shape
from ..mesh.sheets import GroupedMesh
from ..problem.loads import LOADS, MIDDLE, Side
from ..problem.materials import TestDataError
from ..problem.quantities import Number, choose, nearest, positive, put, quantity
from ..problem.shapes import Beam, LoadCase, Segment, Shape
from ..reference.by_constants import Family
from ..safe_io import csv_rows, number_of, numbers
from .mesh_cache import check_type

FIELD_COLUMNS, CURVE_COLUMNS = ("x", "y", "u", "v"), ("force", "displacement")
"""Columns of a field, and those that a curve has at least."""

HEADS = "give columns such as 'force [N],displacement [mm]' or 'x [mm],y [mm],u [um],v [um]'"

GAUGES = ("gauge-1", "gauge-2")
"""Points of a beam between which ``transverse`` is measured: the middles of the sides beside the load."""

LARGEST_MEASUREMENT = 1e30  # number beyond which a cell has no measurement, but the largest number of a program

MOST_DISTANCE_FROM_BODY = 1e-3  # distance from the body, over its extent, up to which a point counts as on its outline


@dataclass(frozen=True, eq=False)
class Block:
    """Numbers of a file: `values` (n,) are `factors` times what `rows` read; their part along `shifts` is not used."""

    label: str
    values: np.ndarray
    factors: np.ndarray
    rows: csr_array | np.ndarray
    shifts: np.ndarray
    places: np.ndarray

    def unshifted(self, columns: np.ndarray) -> np.ndarray:
        """Columns (n, ...) without the part that shifts explain."""
        return np.asarray(columns - self.shifts @ (self.shifts.T @ columns))

    def by_place(self, columns: np.ndarray) -> np.ndarray:
        """Columns (n, ...) as (n_places, n_components, ...)."""
        return columns.reshape(len(self.places), -1, *columns.shape[1:])

    def select(self, stay: np.ndarray) -> "Block":
        """The block of some places, marked (n_places,)."""
        own = np.repeat(stay, len(self.values) // len(stay))
        rows = self.rows[own] if self.rows.shape[0] == len(own) else self.rows
        shifts, _ = np.linalg.qr(self.shifts[own])
        kept = {"values": self.values[own], "factors": self.factors[own], "places": self.places[stay]}
        return replace(self, rows=rows, shifts=shifts, **kept)


@dataclass(frozen=True, eq=False)
class MeasuredTest:
    r"""A test of a sheet in plane stress, and the file of what was measured.

    Parameters
    ----------
    body : Beam or Shape
    load : str
        Load of a beam, or load case of a shape: what is held and which side is loaded.
    file : str or Path
        CSV file with units in the heads of its columns; lines with # are comments. A field has ``x``, ``y``, ``u`` and
        ``v``. A curve has ``force`` and ``displacement``, along the load; ``transverse`` of a beam that is stretched
        or pressed, the growth of its width at the middle; and mean displacements of sides or points such as
        ``x right``.
    force : float or str, optional
        Force on a beam [N] at which a field was measured; the load case of a shape has its own.
    angle : float or str, optional
        Angle of the material's first axis from x [rad], of a coupon that was cut out at an angle.
    shift : bool, optional
        Whether a rigid motion of a field, or the zero of a curve, is estimated and removed.

    Raises
    ------
    TestDataError
        If the file cannot be read, with its line, column and value. It is a ValueError.
    ValueError
        If another argument is out of range or missing.

    Examples
    --------
    >>> from pathlib import Path
    >>> import springtune as st
    >>> lines = ["force [N],displacement [um]", "0,0", "200,13", "400,27"]
    >>> _ = Path("pull.csv").write_text("\n".join(lines))
    >>> test = st.MeasuredTest(st.Beam("100 mm", "20 mm"), "traction", "pull.csv")
    >>> test.columns["displacement"].round(9).tolist()
    [0.0, 1.3e-05, 2.7e-05]
    """

    body: Beam | Shape
    load: str
    file: str | Path
    force: Number | None = None
    angle: Number = 0.0
    shift: bool = True
    columns: dict[str, np.ndarray] = field(init=False, repr=False)
    _lines: list[int] = field(init=False, repr=False)
    _missing: int = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_type(self.body, Beam | Shape, "body")
        choose(self.body.loads if isinstance(self.body, Shape) else LOADS, self.load, "load")
        columns, lines, missing = _read(self.file)
        put(self, angle=quantity(self.angle, "angle", "angle"), columns=columns, _lines=lines, _missing=missing)
        if (self.force is None) == (isinstance(self.body, Beam) and "u" in columns):
            given = f"force: {self.force!r}; give that of the field of a beam in '{self.file}'"
            raise ValueError(f"{given}, such as '400 N', else none")
        put(self, force=None if self.force is None else positive(self.force, "force", "force"))


def body_of_test(test: MeasuredTest) -> tuple[Shape, LoadCase, GroupedMesh | None]:
    """Body of a test as a shape, its load case, and the mesh of a file; a beam is loaded by 1 N."""
    body = test.body
    if isinstance(body, Shape):
        return body, body.loads[test.load], read_shape(body.file, body.unit) if body.file else None
    load, size = LOADS[test.load], (body.length, body.height)
    kind = load.kind
    (pull,) = kind.case.tractions
    case = replace(kind.case, tractions=(replace(pull, force=tuple(load.sign * np.array(pull.force))),))
    corners = {"bottom": (0.0, 0.0), "right": (size[0], 0.0), "top": size, "left": (0.0, size[1])}
    sides = dict(zip((MIDDLE, *GAUGES), (kind.loaded, Side(kind.along, False), Side(kind.along, True))))
    points = {name: (0.5 * size[0], side.place(*size)) for name, side in sides.items() if side.axis}
    points |= {name: (side.place(*size), 0.5 * size[1]) for name, side in sides.items() if not side.axis}
    outline = [Segment(corner, group=group) for group, corner in corners.items()]
    return Shape("beam", body.thickness, outline, points=points), case, None


def blocks(test: MeasuredTest, family: Family, load: LoadCase) -> list[Block]:
    """Return the numbers of a test's file, and how a family predicts them."""
    return _field(test, family) if "u" in test.columns else _curve(test, family, load)


def _field(test: MeasuredTest, family: Family) -> list[Block]:
    points, values = (np.column_stack([test.columns[name] for name in pair]) for pair in ("xy", "uv"))
    rows, apart = family.at(points)
    worst = int(np.argmax(apart))
    if apart[worst] > MOST_DISTANCE_FROM_BODY:
        x, y = 1e3 * points[worst]
        where = f"'{test.file}', line {test._lines[worst]}: the point x = {x:.6g} mm, y = {y:.6g} mm"
        raise TestDataError(f"{where} is outside of the body; correct it")
    if len(points) > 1 and not np.ptp(values, axis=0).any():
        same = f"all {len(points)} points have the same displacement"
        raise TestDataError(f"'{test.file}': {same}; give the field under the load")
    turned = (points - points.mean(axis=0))[:, ::-1] * [-1, 1] / (np.ptp(points) or 1.0)
    rigid, _ = np.linalg.qr(np.column_stack([np.tile(np.eye(2), (len(points), 1)), turned.ravel()]))
    factors, label = np.full(values.size, test.force or 1.0), f"field of '{test.file}'"
    return [Block(label, values.ravel(), factors, rows, rigid[:, : 3 * test.shift], points)]


def _curve(test: MeasuredTest, family: Family, load: LoadCase) -> list[Block]:
    where, loads = f"'{test.file}'", test.columns["force"]
    moved = any(one.x or one.y for one in load.supports)
    if len(load.tractions) != 1 or load.pressures or any(load.gravity) or moved:
        raise TestDataError(f"{where}: load {test.load!r} is not one force; give a field of points")
    if not np.ptp(loads) > 1e-9 * np.abs(loads).max() and (test.shift or not loads.any()):
        same = f"all {len(loads)} values are {loads[0]:g} in SI units"
        raise TestDataError(f"{where}, column 'force': {same}; give others, or no shift")
    if (loads - loads.mean()) @ test.columns["displacement"] < 0:
        raise TestDataError(f"displacement of {where}: is opposite to the load; change a column's sign")
    factors = loads / np.hypot(*load.tractions[0].force)
    shifts = np.full((len(loads), int(test.shift)), len(loads) ** -0.5)
    return [
        Block(f"{name} of {where}", values, factors, _row(test, name, family, load)[None], shifts, loads)
        for name, values in test.columns.items()
        if name != "force"
    ]


def _row(test: MeasuredTest, name: str, family: Family, load: LoadCase) -> np.ndarray:
    """Row (unknowns,) that reads the displacement of a curve's column."""
    kind = LOADS[test.load].kind if isinstance(test.body, Beam) else None
    known = {f"{axis} {group}": (group, number) for group in family.groups for number, axis in enumerate("xy")}
    if name in known:
        return family.mean(*known[name])
    if name == "transverse" and kind and kind.direct:
        return family.mean(GAUGES[1], kind.along) - family.mean(GAUGES[0], kind.along)
    if name != "displacement":
        names = [*CURVE_COLUMNS, *known, *(["transverse"] if kind and kind.direct else [])]
        raise TestDataError(f"'{test.file}', column {name!r}: {nearest(name, names)}; or leave it out")
    (pull,) = load.tractions
    if kind and kind.pressed:
        return pull.force[kind.axis] * family.mean(MIDDLE, kind.axis)
    return family.forces / np.hypot(*pull.force)  # the mean along the force


def _read(path: str | Path) -> tuple[dict[str, np.ndarray], list[int], int]:
    """Columns of a file by name, in SI units, the number of each line, and how many points have no numbers."""
    (line, heads), *rows = csv_rows(path, TestDataError, HEADS)
    parts = [head.rstrip("] ").partition("[") for head in heads]
    names = [name.strip() for name, _, _ in parts]
    of_field = bool(set("uv") & set(names))
    for name in FIELD_COLUMNS if of_field else CURVE_COLUMNS:
        if names.count(name) != 1:
            why = "is missing" if name not in names else "is there twice"
            raise TestDataError(f"'{path}', line {line}: column {name!r} {why} in {names}; {HEADS}")
    used = [name if name in FIELD_COLUMNS or not of_field else "" for name in names]
    every = len(rows)
    if of_field:
        rows = [row for row in rows if len(row[1]) != len(used) or not any(map(_is_missing, used, row[1]))]
    table = np.array(numbers(path, rows, used, TestDataError)).reshape(-1, len(used))
    columns = {}
    for name, (_, _, unit), values in zip(used, parts, table.T):
        if not name:
            continue
        try:
            scale = positive(f"1 {unit}", "force" if name == "force" else "length", f"column {name!r}")
        except ValueError as error:
            raise TestDataError(f"'{path}', line {line}: {error} in '[ ]'") from None
        if (far := np.abs(values) > LARGEST_MEASUREMENT / scale).any():
            worst = int(np.argmax(far))
            where = f"'{path}', line {rows[worst][0]}, column {name!r}"
            raise TestDataError(f"{where}: {values[worst]:g} {unit} is far out of range; correct it")
        columns[name] = scale * values
    if not rows:
        raise TestDataError(f"'{path}': has no rows of numbers below its head; {HEADS}")
    return columns, [number for number, _ in rows], every - len(rows)


def _is_missing(name: str, text: str) -> bool:
    """Whether a cell of a field says that nothing was measured: empty, NaN, a word, or the largest number."""
    if not name or not re.search("[0-9]", text) or "#" in text:
        return bool(name) and not math.isfinite(number_of(text))
    return LARGEST_MEASUREMENT < abs(number_of(text)) < math.inf
