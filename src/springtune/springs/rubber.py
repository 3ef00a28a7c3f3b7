r"""Laws of rubber fitted to a uniaxial test: nominal stress over stretch, as a testing machine gives them.

`Yeoh` is incompressible, with the energy per volume (O. H. Yeoh, Rubber Chem. Technol. 63:792, 1990)

.. math:: W = \sum_{n=1}^{3} c_n (I_1 - 3)^n.

A stretch q has the nominal stress ``2 (q - b) W'(I_1)``, where b is ``q^-2``, ``q^-5`` or ``q^-3`` in uniaxial tension,
equibiaxial tension and pure shear: linear in c_n, which are fitted by least squares of relative errors. In a network
``I_1 = tr C + J^-2`` of a triangle follows from its edges and its area, so that springs of zero rest length, stiffer or
softer with I_1, and areas are linear triangles of this law exactly, see `springtune.mechanics.energies.YeohEnergy`.

`SpringLaw` is for springs alone, on a lattice of equilateral triangles pulled along a row: there the oblique springs
keep their length, and the springs of the row alone carry. So their law is the test's, whatever that is, up to a stretch
of 2, at which the lattice lies flat. What is then left is no matter of the law: in equibiaxial tension all three
directions carry, 1.5 times the uniaxial stress at the same stretch, where an incompressible sheet has 2 times at small
and up to 1 times at large stretches.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..mesh import Mesh
from ..problem.materials import Material
from ..problem.quantities import positive
from .base import DefinitionError, Springs, triangles_only, zero

RUBBER_TESTS = {"uniaxial": 2, "equibiaxial": 5, "pure shear": 3}
"""Tests, and the power p of the nominal stress 2 (q - q^-p) W'(I_1) of an incompressible sheet."""

LEAST_SHARE = 0.05
"""Share of the largest stress below which errors are relative to it: small stresses are read off coarsely."""

CHECKED = 400
"""Stretches of each test over the range of the data at which a fitted law has to be stable."""

TWO_COLUMNS = "give two columns with a head such as 'stretch,nominal stress [MPa]'"


class TestDataError(ValueError):
    """A test that no law can be fitted to; the message says why and what to do."""

    __test__ = False  # to pytest


@dataclass(frozen=True, eq=False)
class UniaxialTest:
    """A uniaxial test: nominal stress over stretch.

    Attributes
    ----------
    stretch : ndarray of float, shape (n,)
        Length over the one at rest [1], ascending.
    stress : ndarray of float, shape (n,)
        Force over the cross-section at rest [Pa].
    name : str
        What it is called in messages.

    Raises
    ------
    TestDataError
        If there are fewer than three points at different stretches, or one with a stress of the wrong sign.
    """

    stretch: np.ndarray
    stress: np.ndarray
    name: str = "test"

    def __post_init__(self) -> None:
        stretch, stress = np.asarray(self.stretch, float), np.asarray(self.stress, float)
        if stretch.ndim != 1 or stretch.shape != stress.shape:
            raise TestDataError(f"{self.name}: stretch and stress have other lengths; give pairs")
        if not (np.isfinite(stretch).all() and np.isfinite(stress).all() and (stretch > 0).all()):
            raise TestDataError(f"{self.name}: a stretch or stress is no number, or not above zero; correct the line")
        order = np.argsort(stretch, kind="stable")
        stretch, stress = stretch[order], stress[order]
        told = stretch != 1
        wrong = told & ((stress > 0) != (stretch > 1))
        if wrong.any():
            place = int(np.argmax(wrong))
            raise TestDataError(
                f"{self.name}: a stretch of {stretch[place]:g} with a stress of {stress[place]:g} Pa: tension is "
                "positive, above a stretch of 1; give nominal stress over stretch (1 plus strain), not over strain"
            )
        if len(np.unique(stretch[told])) < 3:
            raise TestDataError(f"{self.name}: has fewer than three stretches besides 1; give more points")
        object.__setattr__(self, "stretch", stretch[told])
        object.__setattr__(self, "stress", stress[told])

    @classmethod
    def read(cls, path: str | Path) -> "UniaxialTest":
        """Test data of a CSV file: stretch, and nominal stress with its unit in the head of its column.

        Parameters
        ----------
        path : str or Path
            Lines that begin with # are left out.

        Returns
        -------
        UniaxialTest

        Raises
        ------
        TestDataError
            If the file cannot be read, its head has no unit of stress, or a line no two numbers; the message names it.

        Examples
        --------
        >>> from springtune.springs.rubber import UniaxialTest
        >>> test = UniaxialTest.read("config/treloar/uniaxial.csv")
        >>> len(test.stretch), float(test.stretch.max())
        (24, 7.6)
        """
        try:
            lines = Path(path).read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            why = "it is not UTF-8 text" if isinstance(error, UnicodeDecodeError) else error.strerror
            raise TestDataError(f"'{path}' cannot be read: {why}; {TWO_COLUMNS}") from None
        rows = [(number, row) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")
                for row in csv.reader([line])]  # fmt: skip
        if not rows:
            raise TestDataError(f"'{path}' is empty; {TWO_COLUMNS}")
        head = rows[0][1]
        unit = head[1].partition("[")[2].partition("]")[0] if len(head) == 2 else ""
        if "stretch" not in head[0].lower() or not unit:
            raise TestDataError(f"'{path}', line {rows[0][0]}: {','.join(head)!r} is no head of a test; {TWO_COLUMNS}")
        try:
            scale = positive(f"1 {unit}", "stress", "nominal stress")
        except ValueError as error:
            raise TestDataError(f"'{path}', line {rows[0][0]}: {error}") from None
        found = []
        for number, row in rows[1:]:
            try:
                stretch, stress = map(float, row)
            except ValueError:
                raise TestDataError(
                    f"'{path}', line {number}: {','.join(row)!r} is not two numbers; correct it"
                ) from None
            found.append((stretch, scale * stress))
        stretches, stresses = np.array(found).reshape(-1, 2).T
        return cls(stretches, stresses, str(path))


def _told(test: UniaxialTest | str | Path) -> UniaxialTest:
    return test if isinstance(test, UniaxialTest) else UniaxialTest.read(test)


def _weights(test: UniaxialTest) -> np.ndarray:
    """Of relative errors."""
    size = np.abs(test.stress)
    return 1 / np.maximum(size, LEAST_SHARE * size.max())


def _fit(columns: np.ndarray, test: UniaxialTest) -> tuple[tuple[float, ...], float]:
    """Coefficients of columns that add up to a test's stress, by least squares, and their root mean square error."""
    scaled = columns * _weights(test)[:, None]
    sizes = np.linalg.norm(scaled, axis=0)
    found = np.linalg.lstsq(scaled / sizes, test.stress * _weights(test), rcond=None)[0] / sizes
    errors = scaled @ found - test.stress * _weights(test)
    return tuple(map(float, found)), float(np.sqrt((errors**2).mean()))


def _terms(terms: object, most: int) -> None:
    if isinstance(terms, bool) or not isinstance(terms, int) or not 1 <= terms <= most:
        raise ValueError(f"terms: {terms!r} is not a number of terms; give 1 to {most}")


@dataclass(frozen=True)
class Yeoh:
    """A law of incompressible rubber, a polynomial of the first invariant: with one term a neo-Hookean one.

    Attributes
    ----------
    coefficients : tuple of float
        c_1 to c_3 or fewer [Pa].
    largest : float
        Largest I_1 - 3 of the data that it was fitted to [1]; infinite without any. Beyond, what it says is
        extrapolated: answers of networks say so.
    misfit : float
        Root mean square of the relative errors at the data [1].

    Examples
    --------
    Treloar's rubber, its uniaxial test as a testing machine writes it:

    >>> import springtune as st
    >>> from springtune.springs.rubber import Yeoh
    >>> rubber = Yeoh.fitted("config/treloar/uniaxial.csv")
    >>> print([f"{c / 1e6:.3g} MPa" for c in rubber.coefficients], f"{100 * rubber.misfit:.0f} %")
    ['0.167 MPa', '-0.00141 MPa', '4.13e-05 MPa'] 5 %

    A sheet of it, pulled by the force that stretches it to some twice its length:

    >>> beam = st.Beam("100 mm", "20 mm")
    >>> mesh = st.make_mesh(beam, "structured", "5 mm")
    >>> scene = st.Scene(beam, mesh, rubber.material, "traction", "12 N", definition=rubber.springs)
    >>> result = scene.solve()
    >>> print(f"{result.status}: {1e3 * result.displacement:.0f} mm")
    solved: 108 mm
    """

    coefficients: tuple[float, ...]
    largest: float = np.inf
    misfit: float = 0.0

    @classmethod
    def fitted(cls, test: UniaxialTest | str | Path, terms: int = 3) -> "Yeoh":
        """Law fitted to a uniaxial test.

        Parameters
        ----------
        test : UniaxialTest, str or Path
            Or its CSV file, see `UniaxialTest.read`.
        terms : int, optional
            1 to 3.

        Returns
        -------
        Yeoh

        Raises
        ------
        TestDataError
            If the test cannot be read, or the fitted law is unstable within the data's range: its stress has to rise
            with the stretch in all of the three tests.
        """
        test = _told(test)
        _terms(terms, 3)
        q = test.stretch
        excess = q**2 + 2 / q - 3
        columns = np.stack([2 * (q - q**-2) * n * excess ** (n - 1) for n in range(1, terms + 1)], axis=1)
        found, misfit = _fit(columns, test)
        law = cls(found, float(excess.max()), misfit)
        law._check(test.name)
        return law

    def _check(self, name: str) -> None:
        """Refuse a law whose true stress falls somewhere in the range of I_1 of the data, in one of the tests."""
        if not self.coefficients[0] > 0:
            raise TestDataError(f"{name}: fits a modulus that is not above zero; give points of small stretches, too")
        for test in RUBBER_TESTS:
            most = 1.0
            while self.excess(test, 1.1 * most) <= self.largest:
                most *= 1.1
            q = np.linspace(1, most, CHECKED)
            falls = np.flatnonzero(np.diff(q * self.stress(test, q)) <= 0)
            if len(falls):
                raise TestDataError(
                    f"{name}: the fit of {len(self.coefficients)} terms is unstable: its stress falls in {test} at a "
                    f"stretch of {q[falls[0]]:.3g}; give fewer terms, or more data"
                )

    @staticmethod
    def excess(test: str, stretch: np.ndarray | float) -> np.ndarray:
        """I_1 - 3 of a stretch [1] in one of `RUBBER_TESTS`."""
        q = np.asarray(stretch, float)
        other = {"uniaxial": q**-0.5, "equibiaxial": q, "pure shear": np.ones_like(q)}[test]
        return np.asarray(q**2 + other**2 + (q * other) ** -2 - 3)

    def stress(self, test: str, stretch: np.ndarray | float) -> np.ndarray:
        """Nominal stress [Pa] at stretches [1] in one of `RUBBER_TESTS`."""
        q, excess = np.asarray(stretch, float), self.excess(test, stretch)
        slope = np.zeros(q.shape)
        for n, c in enumerate(self.coefficients, 1):
            slope = slope + n * c * excess ** (n - 1)
        return np.asarray(2 * (q - q ** -float(RUBBER_TESTS[test])) * slope)

    @property
    def material(self) -> Material:
        """Incompressible material of the same stiffness at small strain."""
        return Material(6 * self.coefficients[0], 0.5, name="rubber")

    def springs(self, mesh: Mesh, material: Material, thickness: float) -> Springs:
        """Springs of zero rest length and areas of a fitted law: linear triangles of it; a definition to `Scene`.

        Parameters and returns as in `springtune.springs.lattice.springs`; the material has to be `material`, or another
        of its modulus and ratio, with a density, say. Raises DefinitionError on quadrilaterals and for other materials.
        """
        from ..mechanics.energies import YeohEnergy  # here: see `springtune.springs`
        from .neo_hooke import zero_length

        triangles_only(mesh)
        modulus = 6 * self.coefficients[0]
        if material.poisson_ratio != 0.5 or abs(material.young_modulus / modulus - 1) > 1e-6:
            raise DefinitionError(
                f"is fitted to a rubber of E = {modulus:.4g} Pa and nu = 0.5, and the material is another; give the "
                "law's `material`"
            )
        over = np.array(self.coefficients) / modulus
        coefficients = np.tile(over, (len(mesh.triangles), 1))
        energy = YeohEnergy(mesh.points, mesh.triangles, coefficients, self.largest)
        return Springs(modulus * thickness, zero(mesh), (energy,), linear_springs=zero_length(mesh, 2 * over[0]))


LAW_POWERS = (2, 5, 8)
"""Powers p of the terms s - s^-p of a spring's law, s its stretch: of a row of rubber, and of what is softer sooner."""

FLAT = 2.0
"""Stretch at which a lattice of equilateral triangles, pulled along a row, lies flat."""


@dataclass(frozen=True)
class SpringLaw:
    """One law for all springs of an equilateral lattice, alone, and what the lattice then does in the three tests.

    A spring of stretch s pulls with ``sum_p a_p (s - s^-p)`` per cross-section of its rows, p of `LAW_POWERS`.

    Attributes
    ----------
    coefficients : tuple of float
        a_p [Pa], for as many of `LAW_POWERS`.
    largest : float
        Largest stretch of a spring in the data that it was fitted to [1], below `FLAT`.
    misfit : float
        Root mean square of the relative errors at these data [1].

    Examples
    --------
    >>> from springtune.springs.rubber import SpringLaw, Yeoh
    >>> springs, rubber = (law.fitted("config/treloar/uniaxial.csv") for law in (SpringLaw, Yeoh))
    >>> [f"{float(law.stress('equibiaxial', 1.1)) / 1e6:.2f} MPa" for law in (rubber, springs)]
    ['0.16 MPa', '0.17 MPa']
    """

    coefficients: tuple[float, ...]
    largest: float = np.inf
    misfit: float = 0.0

    @classmethod
    def fitted(cls, test: UniaxialTest | str | Path, terms: int = 3) -> "SpringLaw":
        """Law fitted to a uniaxial test along a row, as far as the lattice does not lie flat.

        Parameters
        ----------
        test : UniaxialTest, str or Path
            Or its CSV file, see `UniaxialTest.read`; stretches from `FLAT` on are left out.
        terms : int, optional
            1 to 3.

        Returns
        -------
        SpringLaw

        Raises
        ------
        TestDataError
            If the test cannot be read, has too few points below `FLAT`, or the fitted law is unstable along it.
        """
        test = _told(test)
        _terms(terms, len(LAW_POWERS))
        below = test.stretch < FLAT
        if below.sum() <= terms:
            raise TestDataError(
                f"{test.name}: {terms} terms need more than {below.sum()} points below a stretch of {FLAT:g}, where "
                "the lattice lies flat; give fewer terms"
            )
        test = UniaxialTest(test.stretch[below], test.stress[below], test.name)
        q = test.stretch
        columns = np.stack([q - q**-power for power in LAW_POWERS[:terms]], axis=1)
        found, misfit = _fit(columns, test)
        law = cls(found, float(q.max()), misfit)
        if not (np.diff(law.pull(np.linspace(1, q.max(), CHECKED))) > 0).all():
            raise TestDataError(f"{test.name}: the law of {terms} terms is unstable; give another number of terms")
        return law

    def pull(self, stretch: np.ndarray | float) -> np.ndarray:
        """Pull of a spring at its stretch [1], over the cross-section of its rows [Pa]."""
        s = np.asarray(stretch, float)
        return np.asarray(sum(a * (s - s ** -float(power)) for a, power in zip(self.coefficients, LAW_POWERS)))

    def stress(self, test: str, stretch: np.ndarray | float) -> np.ndarray:
        """Nominal stress [Pa] along a row, at stretches [1] of a test; NaN where the lattice lies flat."""
        q = np.asarray(stretch, float)
        row, oblique = self.pull(q), np.sqrt((q**2 + 3) / 4)
        if test == "uniaxial":  # the oblique springs carry nothing
            return np.where(q < FLAT, row, np.nan)
        return row * 1.5 if test == "equibiaxial" else row + q * self.pull(oblique) / (2 * oblique)
