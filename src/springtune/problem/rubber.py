"""Rubber tests in CSV files, and Yeoh's law fitted to one: see `fit_rubber`."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..safe_io import csv_rows, numbers
from .materials import MOST_TERMS, RUBBER_TESTS, Rubber
from .quantities import Number, positive, put

LEAST_STRESS_SHARE = 0.05
"""Share of the largest stress below which errors are relative to it: small stresses are read off coarsely."""

CHECKED_STRETCHES = 400
"""Stretches of each test over the range of the data at which a fitted law has to be stable."""

FIT_DIGITS = 10
"""Digits of what is fitted."""

COLUMNS_REMEDY = (
    "give two columns, stretch or engineering strain and nominal stress, with a head such as 'stretch,nominal stress "
    "[MPa]' or 'strain [%],nominal stress [MPa]'"
)

STRETCH_RANGE, STRESS_RANGE = (0.01, 50.0), (0.1, 1e12)
"""Stretches [1] and largest stresses [Pa] that are read."""

_HEAD = re.compile(r"(?:(?:engineering|nominal)[ _])?(stretch|strain|stress) *(?:[\[(](.{0,20})[\])])?", re.IGNORECASE)
"""Head of a column: its kind, and its unit in brackets."""

_RATIOS = dict.fromkeys(("-", "1", "m/m", "mm/mm"), 1.0) | {"%": 1e-2}
"""Size of units of stretch and strain."""


class TestDataError(ValueError):
    """A test to which no law can be fitted; the message gives the reason and the remedy."""

    __test__ = False  # to pytest


@dataclass(frozen=True, eq=False)
class TensileTest:
    """Tensile test of rubber: ascending stretch [1], and force over the cross-section at rest [Pa], each (n,)."""

    stretch: np.ndarray
    stress: np.ndarray
    name: str = "test"

    def __post_init__(self) -> None:
        order = np.argsort(self.stretch, kind="stable")
        stretch, stress = self.stretch[order], self.stress[order]
        loaded = stretch != 1
        wrong = loaded & ((stress > 0) != (stretch > 1))
        if wrong.any():
            place = int(np.argmax(wrong))
            found = f"a stretch of {stretch[place]:g} with a stress of {stress[place]:g} Pa: tension is positive"
            remedy = "give nominal stress over stretch (1 plus strain), or name the column 'strain'"
            raise TestDataError(f"{self.name}: {found}; {remedy}")
        if len(np.unique(stretch[loaded])) < 3:
            raise TestDataError(f"{self.name}: has fewer than three stretches besides 1; give more points")
        put(self, stretch=stretch[loaded], stress=stress[loaded])

    @classmethod
    def read(cls, path: str | Path) -> "TensileTest":
        """Read a CSV file of stretch or engineering strain and of nominal stress, with units in the columns' heads."""
        (line, heads), *rows = csv_rows(path, TestDataError, COLUMNS_REMEDY)
        where = [f"'{path}', line {line}, column {head!r}: " for head in heads]
        if len(heads) != 2:
            raise TestDataError(f"{where[0]}the file has {len(heads)} columns; {COLUMNS_REMEDY}")
        read = list(map(_column, heads, where))
        order = [0, 1] if read[1][0] == "stress" else [1, 0]
        (kind, scale), (other, factor) = (read[n] for n in order)
        if kind == "stress" or other != "stress":
            raise TestDataError(f"{where[0]}the other column is {heads[1]!r}; {COLUMNS_REMEDY}")
        x, y = np.array(numbers(path, rows, heads, TestDataError)).reshape(-1, 2).T[order]
        with np.errstate(over="ignore"):
            stretch, stress = scale * x + (kind == "strain"), factor * y
        for n, what, sizes, (least, most) in (
            (0, "a stretch of {:g}", stretch, STRETCH_RANGE),
            (1, "a largest stress of {:g} Pa", np.abs(stress).max(keepdims=True, initial=0), STRESS_RANGE),
        ):
            wrong = sizes[(sizes < least) | (sizes > most)]
            if len(wrong) and rows:
                found = f"{where[order[n]]}{what.format(wrong[0])}"
                raise TestDataError(f"{found} is out of range; correct the head, its unit or the value")
        return cls(stretch, stress, str(path))


def _column(head: str, where: str) -> tuple[str, float]:
    """Return whether a head is of stretch, strain or stress, and the size of its unit."""
    found = _HEAD.fullmatch(head.strip())
    if not found:
        raise TestDataError(f"{where}is neither stretch, engineering strain nor nominal stress; {COLUMNS_REMEDY}")
    kind, unit = found[1].lower(), found[2] or ""
    if kind == "strain" and not unit:
        raise TestDataError(f"{where}may be fractions or percent; name it 'strain [-]', 'strain [%]' or 'stretch'")
    try:
        size = positive(f"1 {unit}", "stress", "unit") if kind == "stress" else _RATIOS[unit or "-"]
    except (KeyError, ValueError):
        size = 0.0
    if not size or (kind == "stretch" and size != 1):
        raise TestDataError(f"{where}{unit!r} is no unit of {kind}; {COLUMNS_REMEDY}")
    return kind, size


def read_test(test: TensileTest | str | Path) -> TensileTest:
    """Return a test; read it if its file is given."""
    return test if isinstance(test, TensileTest) else TensileTest.read(test)


def fit(columns: np.ndarray, test: TensileTest) -> tuple[float, ...]:
    """Return coefficients of stress `columns` (n, n_terms) by least squares of relative errors."""
    size = np.abs(test.stress)
    weights = 1 / np.maximum(size, LEAST_STRESS_SHARE * size.max())
    scaled = columns * weights[:, None]
    sizes = np.linalg.norm(scaled, axis=0)
    found = np.linalg.lstsq(scaled / sizes, test.stress * weights, rcond=None)[0] / sizes
    return tuple(float(f"{one:.{FIT_DIGITS}g}") for one in found)


def check_terms(terms: object, most: int) -> None:
    """Refuse a number of terms that is out of range."""
    if isinstance(terms, bool) or not isinstance(terms, int) or not 1 <= terms <= most:
        raise ValueError(f"terms: {terms!r} is not a number of terms; give 1 to {most}")


def fit_rubber(
    uniaxial: TensileTest | str | Path,
    *,
    equibiaxial: TensileTest | str | Path | None = None,
    pure_shear: TensileTest | str | Path | None = None,
    terms: int = MOST_TERMS,
    density: Number | None = None,
    name: str = "rubber",
) -> Rubber:
    """Fit Yeoh's law to a uniaxial test, and compare it with other tests.

    Parameters
    ----------
    uniaxial : str or Path
        CSV file of two columns, stretch or engineering strain and nominal stress with its unit in the head, such as
        ``stretch,nominal stress [MPa]`` or ``strain [%],nominal stress [MPa]``; lines with # are comments. Or a
        `springtune.problem.rubber.TensileTest`.
    equibiaxial, pure_shear : str or Path, optional
        Files of other tests, only compared.
    terms : int, optional
        1 to 3; 1 is neo-Hooke's law.
    density, name
        As of `Material`.

    Returns
    -------
    Rubber

    Raises
    ------
    TestDataError
        If a file cannot be read, with its line, or the fitted law is unstable within the data's range: the true
        stress must rise with the stretch in all three tests. It is a ValueError.
    ValueError
        If the number of terms or the density is out of range.

    Examples
    --------
    Treloar's rubber, its tests as a testing machine writes them, and a sheet of it, pulled to some twice its length:

    >>> import springtune as st
    >>> folder = "config/treloar"
    >>> rubber = st.fit_rubber(f"{folder}/uniaxial.csv", equibiaxial=f"{folder}/equibiaxial.csv",
    ...                        pure_shear=f"{folder}/pure-shear.csv")
    >>> print([f"{c / 1e6:.3g} MPa" for c in rubber.coefficients], f"E = {rubber.young_modulus / 1e6:.2f} MPa")
    ['0.167 MPa', '-0.00141 MPa', '4.13e-05 MPa'] E = 1.00 MPa
    >>> print({test: f"{100 * error:.0f} %" for test, error in rubber.errors.items()})
    {'uniaxial': '7 %', 'equibiaxial': '23 %', 'pure shear': '7 %'}
    >>> beam = st.Beam("100 mm", "20 mm")
    >>> mesh = st.make_mesh(beam, "structured", "5 mm")
    >>> result = st.Scene(beam, mesh, rubber, "traction", "12 N", definition="yeoh").solve()
    >>> print(f"{result.status}: {1e3 * result.displacement:.0f} mm")
    solved: 108 mm
    """
    test = read_test(uniaxial)
    check_terms(terms, MOST_TERMS)
    stretch, excess = test.stretch, Rubber.excess("uniaxial", test.stretch)
    slopes = [n * excess ** (n - 1) for n in range(1, terms + 1)]  # of a coefficient of 1 Pa
    found = fit(np.stack([2 * (stretch - stretch**-2) * slope for slope in slopes], axis=1), test)
    if not found[0] > 0:
        raise TestDataError(f"{test.name}: fits a modulus that is not above zero; give points of small stretches, too")
    law = Rubber(found, float(f"{excess.max():.{FIT_DIGITS}g}"), (), density, name)
    _check(law, test.name)
    others = {"equibiaxial": equibiaxial, "pure shear": pure_shear}
    data = {"uniaxial": test} | {kind: read_test(other) for kind, other in others.items() if other is not None}
    errors = {kind: law.stress(kind, one.stretch) / one.stress - 1 for kind, one in data.items()}
    squares = {kind: np.sqrt((error**2).mean()) for kind, error in errors.items()}
    return replace(law, test_errors=tuple((kind, float(f"{one:.6g}")) for kind, one in squares.items()))


def _check(law: Rubber, name: str) -> None:
    """Refuse a law whose true stress falls somewhere in the range of I_1 of the data, in one of the tests."""
    for test in RUBBER_TESTS:
        q = np.linspace(1, np.sqrt(law.largest + 3), CHECKED_STRETCHES)  # I_1 is above the square of the stretch
        q = q[law.excess(test, q) <= law.largest]
        falls = np.flatnonzero(np.diff(q * law.stress(test, q)) <= 0)
        if len(falls):
            fit = f"the fit of {len(law.coefficients)} terms is unstable in {test} at a stretch of {q[falls[0]]:.3g}"
            raise TestDataError(f"{name}: {fit}; give fewer terms, or more data")
