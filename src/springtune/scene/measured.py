"""Measured tests of sheets: forces with displacements, or displacements of points, from CSV files.

A field has the columns x, y, u and v: where points are at rest, and their displacements, as digital image correlation
gives them; its other columns are ignored. A curve has the columns ``force`` and ``displacement``, and may have others.
Units stand in the heads, as in ``force [N],displacement [mm]``.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from ..mesh.formats import read_shape
from ..mesh.groups import GroupedMesh
from ..problem.geometry import Beam
from ..problem.loads import LOADS, MIDDLE
from ..problem.quantities import Number, nearest, positive, put, quantity
from ..problem.rubber import TestDataError
from ..problem.shapes import LoadCase, Segment, Shape
from ..reference.by_constants import Family
from ..safe_io.inputs import csv_rows
from .meshes import A_BEAM, is_a
from .sheet import chosen

FIELD_COLUMNS, CURVE_COLUMNS = ("x", "y", "u", "v"), ("force", "displacement")
"""Columns of a field, and those that a curve has at least."""

HEADS = "give columns such as 'force [N],displacement [mm]' or 'x [mm],y [mm],u [um],v [um]'"

GAUGES = ("gauge-1", "gauge-2")
"""Points of a beam between which ``transverse`` is measured: the middles of the sides beside the load."""

OFF_BODY = 1e-3
"""Distance from the body, over its extent, up to which a point counts as on its outline."""


@dataclass(frozen=True, eq=False)
class Block:
    """Numbers of one kind from one file.

    `values` (n,) are `factors` (n,) times the displacements that `rows` read, one for all or one each; without rows
    times the force that moves a support by `moved` [m]. What the columns of `shifts` (n, n_shifts) explain tells
    nothing of the material. `places` are loads, or points (n / 2, 2).
    """

    label: str
    values: np.ndarray
    factors: np.ndarray
    rows: csr_array | np.ndarray | None
    shifts: np.ndarray
    noise: float | None
    places: np.ndarray
    moved: float = 0.0
    unit: str = "m"

    @cached_property
    def _basis(self) -> np.ndarray:
        return np.linalg.qr(self.shifts)[0]

    def unshifted(self, columns: np.ndarray) -> np.ndarray:
        """Columns (n, ...) without what shifts explain."""
        return np.asarray(columns - self._basis @ (self._basis.T @ columns))


@dataclass(frozen=True, eq=False)
class MeasuredTest:
    r"""A test of a sheet and the file of what was measured.

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
        Force on a beam [N] at which a field was measured.
    scale : float, optional
        Factor on the load case of a shape [1] at which a field was measured.
    angle : float or str, optional
        Angle of the material's first axis from x [rad], of a coupon that was cut out at an angle.
    noise : float or str, optional
        Standard deviation of displacements [m], or of the forces [N] of a curve whose support is moved. By default
        estimated from the residuals.
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
    scale: float = 1.0
    angle: Number = 0.0
    noise: Number | None = None
    shift: bool = True
    columns: dict[str, np.ndarray] = field(init=False, repr=False)
    _lines: list[int] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        is_a(self.body, (Beam, Shape), "body", A_BEAM)
        is_beam = isinstance(self.body, Beam)
        chosen(self.body.loads if isinstance(self.body, Shape) else LOADS, self.load, "load")
        put(self, angle=quantity(self.angle, "angle", "angle"))
        columns, lines = _read(self.file)
        put(self, columns=columns, _lines=lines)
        if is_beam and "u" in columns:
            if self.force is None:
                raise ValueError(f"force: missing; give the force at which '{self.file}' was measured, as '400 N'")
            put(self, scale=LOADS[self.load].sign * positive(self.force, "force", "force"))
        elif self.force is not None:
            raise ValueError(f"force: {self.force!r} is for the field of a beam; leave it out, or give a scale")


def stated(test: MeasuredTest) -> tuple[Shape, LoadCase, GroupedMesh | None]:
    """Body of a test as a shape, its load case, and the mesh of a file."""
    body = test.body
    if isinstance(body, Shape):
        return body, body.loads[test.load], read_shape(body.file, body.unit) if body.file else None
    kind, size = LOADS[test.load].kind, np.array([body.length, body.height])
    corners = {"bottom": (0.0, 0.0), "right": (size[0], 0.0), "top": tuple(size), "left": (0.0, size[1])}
    middle, gauges = 0.5 * size, np.outer([0.0, 1.0], size)
    middle[kind.normal] = kind.loaded.place(*size)
    gauges[:, kind.normal] = 0.5 * size[kind.normal]
    points = {MIDDLE: tuple(middle)} | dict(zip(GAUGES, map(tuple, gauges)))
    outline = [Segment(corner, group=group) for group, corner in corners.items()]
    return Shape("beam", body.thickness, outline, points=points), kind.case, None


def blocks(test: MeasuredTest, family: Family, load: LoadCase) -> Iterator[Block]:
    """Yield the numbers of a test's file, and how a family predicts them."""
    columns, where = test.columns, f"'{test.file}'"
    if "u" in columns:
        points = np.stack([columns["x"], columns["y"]], axis=1)
        rows, apart = family.at(points)
        if apart.max() > OFF_BODY:
            worst = int(np.argmax(apart))
            x, y = 1e3 * points[worst]
            raise TestDataError(
                f"{where}, line {test._lines[worst]}: the point x = {x:.6g} mm, y = {y:.6g} mm is outside of the body; "
                "remove it, or correct the unit or the origin"
            )
        rigid = np.zeros((len(points), 2, 3 * test.shift))
        if test.shift:
            rigid[:, :, :2] = np.eye(2)
            rigid[:, :, 2] = (points - points.mean(axis=0))[:, ::-1] * [-1, 1] / (np.ptp(points) or 1.0)
        values = np.stack([columns["u"], columns["v"]], axis=1).ravel()
        noise, factors = _noise(test, "length"), np.full(len(values), test.scale)
        yield Block(f"field of {where}", values, factors, rows, rigid.reshape(len(values), -1), noise, points)
        return
    pushed = [np.hypot(*one.force) for one in load.tractions]
    moved = [np.hypot(one.x or 0.0, one.y or 0.0) for one in load.supports if one.x or one.y]
    if len(pushed) + len(moved) != 1 or load.pressures or any(load.gravity):
        raise TestDataError(
            f"{where}: load {test.load!r} is not one force or one moved support; give a field of points"
        )
    driving, measured = CURVE_COLUMNS[:: -1 if moved else 1]
    loads = columns[driving]
    if not np.ptp(loads) > 1e-9 * np.abs(loads).max() and (test.shift or not loads.any()):
        raise TestDataError(
            f"{where}, column {driving!r}: all {len(loads)} values are {loads[0]:g} in SI units, so there is no slope; "
            "give other loads, or switch the shift off if the zero is known"
        )
    sign = LOADS[test.load].sign if isinstance(test.body, Beam) else 1.0
    for name in columns:
        if name == driving:
            continue
        own, reaction = name == measured, bool(moved) and name == measured
        factors = (1.0 if own else sign) * loads / (moved or pushed)[0]
        rows = None if reaction else _row(test, name, family, load)[None]
        noise = _noise(test, "force" if moved else "length") if own or not moved else None
        shifts, push = np.ones((len(loads), int(test.shift))), (moved[0], "N") if reaction else (0.0, "m")
        yield Block(f"{name} of {where}", columns[name], factors, rows, shifts, noise, loads, *push)


def _noise(test: MeasuredTest, kind: str) -> float | None:
    return None if test.noise is None else positive(test.noise, kind, "noise")


def _row(test: MeasuredTest, name: str, family: Family, load: LoadCase) -> np.ndarray:
    """Row that reads the displacement of a curve's column."""
    kind = LOADS[test.load].kind if isinstance(test.body, Beam) else None
    known = [f"{axis} {group}" for axis in "xy" for group in family.groups]
    if name == "displacement" and kind is not None and kind.pressed:
        return family.mean(MIDDLE, kind.axis)
    if name == "displacement":
        return family.forces / np.hypot(*load.tractions[0].force)  # the mean along the force
    if kind is not None and kind.direct:
        known.append("transverse")
        if name == "transverse":
            return family.mean(GAUGES[1], kind.along) - family.mean(GAUGES[0], kind.along)
    if name not in known:
        raise TestDataError(
            f"'{test.file}', column {name!r}: {nearest(name, [*CURVE_COLUMNS, *known])}; or leave it out"
        )
    return family.mean(name[2:], "xy".index(name[0]))


def _read(path: str | Path) -> tuple[dict[str, np.ndarray], list[int]]:
    """Columns of a file by name, in SI units, and the number of each line."""
    (line, heads), *rows = csv_rows(path, TestDataError, HEADS)
    parts = [head.rstrip("] ").partition("[") for head in heads]
    names = [name.strip() for name, _, _ in parts]
    wanted = FIELD_COLUMNS if set("uv") & set(names) else CURVE_COLUMNS
    for name in wanted:
        if names.count(name) != 1:
            why = "is missing" if name not in names else "is there twice"
            raise TestDataError(f"'{path}', line {line}: column {name!r} {why} in {names}; {HEADS}")
    found = {}
    for place, (name, (_, _, unit)) in enumerate(zip(names, parts)):
        if wanted is FIELD_COLUMNS and name not in FIELD_COLUMNS:
            continue
        try:
            scale = positive(f"1 {unit}", "force" if name == "force" else "length", f"column {name!r}")
        except ValueError as error:
            raise TestDataError(f"'{path}', line {line}: {error} in '[ ]'") from None
        values = [_number(path, number, name, row, place, len(names)) for number, row in rows]
        found[name] = scale * np.array(values)
    if not rows:
        raise TestDataError(f"'{path}': has no rows of numbers below its head; {HEADS}")
    return found, [number for number, _ in rows]


def _number(path: str | Path, line: int, name: str, row: list[str], place: int, count: int) -> float:
    """Number in a column of a row."""
    if len(row) != count:
        raise TestDataError(f"'{path}', line {line}: has {len(row)} values, and the head {count}; correct it")
    try:
        value = float(row[place])
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise TestDataError(
            f"'{path}', line {line}, column {name!r}: {row[place].strip()!r} is no finite number; correct the line, "
            "or remove it"
        )
    return value
