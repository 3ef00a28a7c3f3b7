r"""Materials: linear elastic, isotropic or anisotropic, and rubber fitted to a test.

Sheets are in plane stress, or in plane strain, see `Material.in_plane`. With stresses and strains in Voigt's order, xx,
yy and xy, and the shear angle as strain,

.. math:: \begin{pmatrix} \sigma_{xx} \\ \sigma_{yy} \\ \sigma_{xy} \end{pmatrix} =
          \begin{pmatrix} C_{11} & C_{12} & C_{16} \\ C_{12} & C_{22} & C_{26} \\ C_{16} & C_{26} & C_{66}
          \end{pmatrix}
          \begin{pmatrix} \varepsilon_{xx} \\ \varepsilon_{yy} \\ \gamma_{xy} \end{pmatrix}.

An orthotropic material has, along its own axes, C16 = C26 = 0 and

.. math:: C_{11} = \frac{E_x}{1 - \nu_{xy} \nu_{yx}}, \quad C_{22} = \frac{E_y}{1 - \nu_{xy} \nu_{yx}}, \quad
          C_{12} = \nu_{xy} C_{22}, \quad C_{66} = G_{xy}, \quad \nu_{yx} = \nu_{xy} E_y / E_x.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..safe_io import csv_rows, numbers
from .quantities import PLANES, Number, choose, positive, put, quantity, whole_number

INCOMPRESSIBLE_REASON = (
    "0.5: in plane strain an incompressible material has no finite stiffness; give a ratio below 0.5 such as 0.49, or "
    "plane 'stress'"
)
"""Why a Poisson's ratio is refused in plane strain, and the remedy."""


@dataclass(frozen=True)
class Material:
    """An isotropic linear elastic material.

    Parameters
    ----------
    young_modulus : float or str
        Young's modulus E [Pa], or a text with its unit.
    poisson_ratio : float
        Poisson's ratio nu [1], above -1 and at most 0.5; below 0.5 in plane strain.
    density : float, str or None
        Density rho [kg/m3], or a text with its unit; not needed in statics.
    name : str
        Label of the material, e.g. ``"steel"``.
    plane : str
        ``"stress"`` of a thin sheet whose faces are free, or ``"strain"`` of a slice of a long body, which cannot
        expand across the plane. E and nu are those of the material in three dimensions in both.

    Attributes
    ----------
    isotropic : bool
        True.

    Raises
    ------
    ValueError
        If a quantity is not above zero or has the wrong unit, the plane is unknown, or Poisson's ratio is out of range.

    Examples
    --------
    >>> import springtune as st
    >>> steel = st.Material("210 GPa", 0.3, density="7850 kg/m^3", name="steel")
    >>> steel
    Material(young_modulus=210000000000.0, poisson_ratio=0.3, density=7850.0, name='steel', plane='stress')
    >>> (steel.plane_stress / 1e9).round(2).tolist()
    [[230.77, 69.23, 0.0], [69.23, 230.77, 0.0], [0.0, 0.0, 80.77]]
    >>> sheet = st.Material("210 GPa", 0.25, plane="strain").in_plane
    >>> f"{sheet.young_modulus / 1e9:.0f} GPa, {sheet.poisson_ratio:.4f}"
    '224 GPa, 0.3333'
    """

    young_modulus: Number
    poisson_ratio: float
    density: Number | None = None
    name: str = "material"
    plane: str = "stress"
    isotropic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _read_density(self)
        choose(dict.fromkeys(PLANES), self.plane, "plane")
        put(self, young_modulus=positive(self.young_modulus, "stress", "Young's modulus"))
        if not (isinstance(self.poisson_ratio, Real) and -1 < self.poisson_ratio <= 0.5):
            is_text = ", a text" if isinstance(self.poisson_ratio, str) else ""
            given = f"Poisson's ratio of {self.name!r} is {self.poisson_ratio!r}{is_text}"
            raise ValueError(f"{given}: isotropic materials have -1 < nu <= 0.5; give a number in that range")
        if self.plane == "strain" and self.poisson_ratio == 0.5:
            raise ValueError(f"Poisson's ratio of {self.name!r} is {INCOMPRESSIBLE_REASON}")

    @property
    def in_plane(self) -> Material:
        r"""The material whose plane stress is this sheet's behaviour in its plane; all formulas take their E and nu.

        In plane stress the material itself; in plane strain :math:`E' = E / (1 - \nu^2)` and :math:`\nu' = \nu / (1 -
        \nu)`. Central springs have nu' = 1/3, and so nu = 1/4 in plane strain.
        """
        if self.plane == "stress":
            return self
        nu = self.poisson_ratio
        return InPlane(self.young_modulus / (1 - nu**2), nu / (1 - nu), self.density, self.name)

    @property
    def plane_stress(self) -> np.ndarray:
        """Stiffness in plane stress [Pa], shape (3, 3): stresses of strains xx, yy and the shear angle xy."""
        modulus, nu = self.young_modulus, self.poisson_ratio
        diagonal, coupling, shear = modulus / (1 - nu**2), modulus * nu / (1 - nu**2), modulus / (2 * (1 + nu))
        return np.array([[diagonal, coupling, 0.0], [coupling, diagonal, 0.0], [0.0, 0.0, shear]])


class InPlane(Material):
    """Constants of a sheet in plane strain, as if of one in plane stress; its Poisson's ratio is below 1."""

    def __post_init__(self) -> None:
        put(self, plane="strain")

    @property
    def in_plane(self) -> Material:
        """The object itself: its constants are those in its plane."""
        return self


RUBBER_TESTS = {"uniaxial": 2, "equibiaxial": 5, "pure shear": 3}
"""Tests, and the power p of the nominal stress 2 (q - q^-p) W'(I_1) of an incompressible sheet.

Stretched by q, it is q^((p - 3) / 2) times as wide in its plane.
"""

MOST_TERMS = 3  # terms of Yeoh's law


@dataclass(frozen=True, init=False)
class Rubber(Material):
    r"""Incompressible rubber of Yeoh's law; at small strain a `Material` of E = 6 c_1 and nu = 0.5.

    Parameters
    ----------
    coefficients : sequence of float
        One to three coefficients c_n [Pa].
    largest : float
        Largest I_1 - 3 of the fitted data [1], or infinite. Networks strained beyond it report that the law is
        extrapolated.
    test_errors : sequence of (str, float)
        Root mean square of the relative errors [1] by compared test.
    density, name
        As of `Material`.

    Raises
    ------
    ValueError
        If there are no or too many coefficients, one is not a number, or the first is not above zero.

    Notes
    -----
    The energy per volume is (O. H. Yeoh, Rubber Chem. Technol. 63:792, 1990)

    .. math:: W = \sum_{n=1}^{3} c_n (I_1 - 3)^n;

    one term alone is neo-Hooke's law. A stretch q has the nominal stress ``2 (q - b) W'(I_1)``, where b is ``q^-2``,
    ``q^-5`` or ``q^-3`` in uniaxial tension, equibiaxial tension and pure shear.

    Examples
    --------
    >>> import springtune as st
    >>> rubber = st.Rubber([0.2e6, -1e3, 50.0], name="soft")
    >>> rubber.young_modulus, rubber.poisson_ratio
    (1200000.0, 0.5)
    >>> print(f"{float(rubber.stress('uniaxial', 5.0)) / 1e6:.2f} MPa")
    2.29 MPa
    >>> [round(float(rubber.excess(test, 2.0)), 3) for test in ("uniaxial", "equibiaxial", "pure shear")]
    [2.0, 5.062, 2.25]
    >>> st.fit_rubber("config/treloar/uniaxial.csv", terms=1).errors["uniaxial"].__round__(2)
    0.28
    """

    young_modulus: float = field(init=False)
    poisson_ratio: float = field(init=False)
    plane: str = field(init=False, default="stress")
    coefficients: tuple[float, ...] = ()
    largest: float = math.inf
    test_errors: tuple[tuple[str, float], ...] = ()

    def __init__(
        self,
        coefficients: Sequence[float],
        largest: float = math.inf,
        test_errors: Sequence[tuple[str, float]] = (),
        density: Number | None = None,
        name: str = "rubber",
    ) -> None:
        given = list(coefficients)
        if not (1 <= len(given) <= MOST_TERMS and all(isinstance(c, Real) and math.isfinite(c) for c in given)):
            raise ValueError(f"coefficients: {coefficients!r} is no law; give 1 to {MOST_TERMS} numbers in Pa")
        for test, _ in test_errors:
            choose(RUBBER_TESTS, test, "test")
        errors = tuple((test, float(error)) for test, error in test_errors)
        put(self, coefficients=tuple(map(float, given)), largest=float(largest), test_errors=errors)
        put(self, young_modulus=6 * self.coefficients[0], poisson_ratio=0.5, density=density, name=name)
        self.__post_init__()

    @property
    def errors(self) -> dict[str, float]:
        """Root mean square of the relative errors of its stress, by compared test [1]."""
        return dict(self.test_errors)

    @staticmethod
    def excess(test: str, stretch: np.ndarray | float) -> np.ndarray:
        """Return I_1 - 3 at stretches in a test.

        Parameters
        ----------
        test : str
            ``"uniaxial"``, ``"equibiaxial"`` or ``"pure shear"``.
        stretch : float or ndarray of float
            Length over rest length [1].

        Returns
        -------
        ndarray of float
            [1], in the shape of the stretches.

        Raises
        ------
        ValueError
            If the test is unknown.
        """
        q = np.asarray(stretch, float)
        other = q ** (0.5 * (choose(RUBBER_TESTS, test, "test") - 3))
        return np.asarray(q**2 + other**2 + (q * other) ** -2 - 3)

    def stress(self, test: str, stretch: np.ndarray | float) -> np.ndarray:
        """Return the nominal stress at stretches in a test: at small strain E, 2 E or 4/3 E times the strain.

        Parameters
        ----------
        test, stretch
            As of `excess`.

        Returns
        -------
        ndarray of float
            Force over the cross-section at rest [Pa].
        """
        q, excess = np.asarray(stretch, float), self.excess(test, stretch)
        slope = sum((n * c * excess ** (n - 1) for n, c in enumerate(self.coefficients, 1)), np.zeros(q.shape))
        return np.asarray(2 * (q - q ** -float(RUBBER_TESTS[test])) * slope)


@dataclass(frozen=True)
class AnisotropicMaterial:
    """A linear elastic sheet of any anisotropy, by its six constants in plane stress.

    See `orthotropic` for engineering constants and a fibre angle, `laminate` for plies.

    Parameters
    ----------
    C11, C22 : float or str
        Stiffness along x and along y without strain across [Pa], or a text with its unit.
    C12 : float or str
        Stress along x for a strain along y [Pa].
    C66 : float or str
        Shear stress for a shear angle [Pa].
    C16, C26 : float or str
        Shear stress for strains along x and y [Pa]; 0 if x and y are axes of the material.
    density, name
        As of `Material`.

    Attributes
    ----------
    isotropic : bool
        False, whatever its constants: definitions that need one E and one nu refuse it.

    Raises
    ------
    ValueError
        If a quantity has the wrong unit, or the stiffness is not positive definite.

    Examples
    --------
    >>> import springtune as st
    >>> board = st.AnisotropicMaterial("9 GPa", "4 GPa", "1.5 GPa", "2 GPa", name="board")
    >>> (board.plane_stress / 1e9).tolist()
    [[9.0, 1.5, 0.0], [1.5, 4.0, 0.0], [0.0, 0.0, 2.0]]
    >>> turned = board.rotated("90 deg")
    >>> round(turned.C11 / 1e9, 9), round(turned.C22 / 1e9, 9), turned.in_plane is turned
    (4.0, 9.0, True)
    >>> st.AnisotropicMaterial.of(st.Material("1 MPa", 0.0).plane_stress).C66
    500000.0
    """

    C11: Number
    C22: Number
    C12: Number
    C66: Number
    C16: Number = 0.0
    C26: Number = 0.0
    density: Number | None = None
    name: str = "material"
    isotropic: ClassVar[bool] = False

    def __post_init__(self) -> None:
        _read_density(self)
        for constant in CONSTANTS:
            read = positive if constant in ("C11", "C22", "C66") else quantity
            put(self, **{constant: read(getattr(self, constant), "stress", constant)})
        if fault := indefinite_reason(*(getattr(self, constant) for constant in CONSTANTS)):
            raise ValueError(f"material {self.name!r}: {fault}")

    @classmethod
    def orthotropic(
        cls,
        young_modulus_x: Number,
        young_modulus_y: Number,
        poisson_ratio_xy: float,
        shear_modulus: Number,
        angle: Number = 0.0,
        density: Number | None = None,
        name: str = "material",
    ) -> AnisotropicMaterial:
        """Make a material with two axes, such as a ply of fibres, from engineering constants.

        Parameters
        ----------
        young_modulus_x, young_modulus_y : float or str
            Young's modulus along and across the fibres [Pa], or a text with its unit.
        poisson_ratio_xy : float
            Contraction across over extension along the fibres, pulled along them [1].
        shear_modulus : float or str
            [Pa]
        angle : float or str
            Angle of the fibres from the sheet's x axis, counter-clockwise [rad], or a text with its unit.
        density, name
            As of `Material`.

        Returns
        -------
        AnisotropicMaterial

        Raises
        ------
        ValueError
            If a quantity is not above zero or has the wrong unit, or Poisson's ratio exceeds sqrt(E_x / E_y) in size.

        Examples
        --------
        Carbon fibres in epoxy, turned by 30 degrees:

        >>> import springtune as st
        >>> ply = st.AnisotropicMaterial.orthotropic("140 GPa", "10 GPa", 0.3, "5 GPa", "30 deg", name="ply")
        >>> (ply.plane_stress / 1e9).round(1).tolist()
        [[84.8, 26.4, 41.9], [26.4, 19.4, 14.8], [41.9, 14.8, 28.4]]
        """
        along = positive(young_modulus_x, "stress", "young_modulus_x")
        across = positive(young_modulus_y, "stress", "young_modulus_y")
        shear = positive(shear_modulus, "stress", "shear_modulus")
        turn = quantity(angle, "angle", "angle")
        bound = math.sqrt(along / across)
        is_number = isinstance(poisson_ratio_xy, Real) and not isinstance(poisson_ratio_xy, bool)
        if not (is_number and abs(poisson_ratio_xy) < bound):
            given = f"material {name!r}: poisson_ratio_xy is {poisson_ratio_xy!r}, and its size must be below"
            root = f"sqrt(young_modulus_x / young_modulus_y) = {bound:.6g}"
            raise ValueError(f"{given} {root}; give the ratio for a pull along the fibres")
        nu = float(poisson_ratio_xy)
        scale = 1 - nu * nu * across / along
        made = cls(along / scale, across / scale, nu * across / scale, shear, density=density, name=name)
        return made.rotated(turn) if turn else made

    @classmethod
    def laminate(
        cls, plies: Sequence[tuple[AnyMaterial, Number, Number]], density: Number | None = None, name: str = "laminate"
    ) -> AnisotropicMaterial:
        """Make one sheet of bonded plies: the mean of their stiffnesses by thickness.

        The in-plane part A / t of classical lamination theory, for symmetric stackings: others bend out of their
        plane when stretched.

        Parameters
        ----------
        plies : sequence of (material, angle, thickness)
            Material of each ply, its angle [rad] and its thickness, which counts relative to the total; angle and
            thickness may be texts with units.
        density : float, str or None
            [kg/m3]; by default the plies' mean, if each has one.
        name : str

        Returns
        -------
        AnisotropicMaterial

        Raises
        ------
        ValueError
            If there are no plies, or one has the wrong form.

        Examples
        --------
        Equal shares at 0, 60 and -60 degrees are isotropic in the plane:

        >>> import springtune as st
        >>> ply = st.AnisotropicMaterial.orthotropic("140 GPa", "10 GPa", 0.3, "5 GPa")
        >>> laminate = st.AnisotropicMaterial.laminate([(ply, f"{angle} deg", 1) for angle in (0, 60, -60)])
        >>> constants = [laminate.constants_at(f"{angle} deg") for angle in (0, 17, 45)]
        >>> [f"{one.young_modulus_x / 1e9:.1f} GPa, {one.poisson_ratio_xy:.3f}" for one in constants]
        ['54.1 GPa, 0.311', '54.1 GPa, 0.311', '54.1 GPa, 0.311']
        """
        parts: list[tuple[AnyMaterial, np.ndarray, float]] = []
        for number, ply in enumerate(plies):
            if not (isinstance(ply, tuple | list) and len(ply) == 3 and isinstance(ply[0], AnyMaterial)):
                raise ValueError(f"ply {number}: {ply!r} is not a ply; give a material, an angle and a thickness")
            material, angle, thickness = ply
            turned = rotated(material.plane_stress, quantity(angle, "angle", f"angle of ply {number}"))
            parts.append((material, turned, positive(thickness, "length", f"thickness of ply {number}")))
        if not parts:
            raise ValueError("plies: empty; give at least one material, angle and thickness")
        total = math.fsum(part for _, _, part in parts)
        densities = [material.density for material, _, _ in parts]
        if density is None and None not in densities:
            density = sum(part * (one or 0.0) for one, (_, _, part) in zip(densities, parts)) / total
        return cls.of(np.sum([part / total * turned for _, turned, part in parts], axis=0), density, name)

    @classmethod
    def of(cls, stiffness: np.ndarray, density: Number | None = None, name: str = "material") -> AnisotropicMaterial:
        """Make a material from a stiffness in plane stress.

        Parameters
        ----------
        stiffness : ndarray of float, shape (3, 3)
            As `plane_stress` [Pa].
        density, name
            As of `Material`.

        Returns
        -------
        AnisotropicMaterial

        Raises
        ------
        ValueError
            If it is not a symmetric positive definite matrix of that shape.
        """
        given = np.asarray(stiffness, dtype=float)
        if given.shape != (3, 3) or not np.allclose(given, given.T, rtol=1e-9, atol=1e-12 * np.abs(given).max()):
            raise ValueError(f"stiffness: {stiffness!r} is no symmetric array of shape (3, 3); give one in Pa")
        (c11, c12, c16), (_, c22, c26), (_, _, c66) = given.tolist()
        return cls(c11, c22, c12, c66, c16, c26, density, name)

    @property
    def in_plane(self) -> AnisotropicMaterial:
        """The material itself: its constants are those in its plane."""
        return self

    @property
    def plane_stress(self) -> np.ndarray:
        """Stiffness in plane stress [Pa], shape (3, 3): stresses of strains xx, yy and the shear angle xy."""
        upper = [self.C11, self.C12, self.C16, self.C22, self.C26, self.C66]
        return np.array(upper)[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]]

    def rotated(self, angle: Number) -> AnisotropicMaterial:
        """Return the material, turned counter-clockwise in the sheet.

        Parameters
        ----------
        angle : float or str
            [rad], or a text with its unit; another one raises ValueError.

        Returns
        -------
        AnisotropicMaterial
        """
        turned = rotated(self.plane_stress, quantity(angle, "angle", "angle"))
        return AnisotropicMaterial.of(turned, self.density, self.name)

    def constants_at(self, angle: Number = 0.0) -> EngineeringConstants:
        """Return the engineering constants along turned axes, as of a coupon cut out at that angle.

        Parameters
        ----------
        angle : float or str
            Of the coupon's length from the x axis, counter-clockwise [rad], or a text with its unit; another one raises
            ValueError.

        Returns
        -------
        EngineeringConstants

        Examples
        --------
        >>> import springtune as st
        >>> ply = st.AnisotropicMaterial.orthotropic("140 GPa", "10 GPa", 0.3, "5 GPa")
        >>> for angle in (0, 10, 45):
        ...     found = ply.constants_at(f"{angle} deg")
        ...     print(f"{angle:2} deg: E = {found.young_modulus_x / 1e9:.1f} GPa, nu = {found.poisson_ratio_xy:.3f}")
         0 deg: E = 140.0 GPa, nu = 0.300
        10 deg: E = 79.8 GPa, nu = 0.378
        45 deg: E = 13.2 GPa, nu = 0.321
        """
        turn = quantity(angle, "angle", "angle")
        compliance = np.linalg.inv(rotated(self.plane_stress, -turn) if turn else self.plane_stress)
        (along, coupled, sheared), across, shear = compliance[0].tolist(), compliance[1, 1], compliance[2, 2]
        return EngineeringConstants(1 / along, float(1 / across), -coupled / along, float(1 / shear), sheared / along)


CONSTANTS = ("C11", "C22", "C12", "C66", "C16", "C26")  # constants of a sheet in plane stress

AnyMaterial = Material | AnisotropicMaterial  # materials of a sheet

Materials = AnyMaterial | Mapping[str, AnyMaterial]  # one, or those of the parts of a body by name


class EngineeringConstants(NamedTuple):
    """Engineering constants of a sheet along two axes, as coupons show them: moduli [Pa] and Poisson's ratio [1].

    `shear_by_x` is the shear angle over the extension when pulled along the first axis; 0 along a material's axes.
    """

    young_modulus_x: float
    young_modulus_y: float
    poisson_ratio_xy: float
    shear_modulus: float
    shear_by_x: float


def rotated(stiffness: np.ndarray, angle: float) -> np.ndarray:
    """Return a stiffness in plane stress (3, 3) turned counter-clockwise by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    # Strains along the turned axes of strains along x and y; the energy is the same.
    strains = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
    turned = strains.T @ stiffness @ strains
    return 0.5 * (turned + turned.T)


def indefinite_reason(c11: float, c22: float, c12: float, c66: float, c16: float = 0.0, c26: float = 0.0) -> str:
    """Return why constants in plane stress [Pa] are not positive definite, with the bound, or an empty string."""
    bound = math.sqrt(c11) * math.sqrt(c22)
    why = "or some strain takes no work; correct"
    if not abs(c12) < bound:
        return f"C12 is {c12:.6g} Pa, and its size must be below sqrt(C11 C22) = {bound:.6g} Pa, {why} it"
    a, b = c16 / math.sqrt(c11), c26 / math.sqrt(c22)  # no product of two stiffnesses: they may be large
    ratio = c12 / bound
    least = (a * a - 2 * ratio * a * b + b * b) / ((1 - ratio) * (1 + ratio))
    if not c66 > least:
        others = f"with these C16 and C26 it must be above {least:.6g} Pa"
        return f"C66 is {c66:.6g} Pa, and {others}, {why} it, or the other two"
    return ""


def material_of(fields: Mapping[str, Any]) -> AnyMaterial:
    """Return the material of its fields, as `dataclasses.asdict` gives them."""
    if "coefficients" in fields:
        of_law = ("young_modulus", "poisson_ratio", "plane")
        return Rubber(**{key: value for key, value in fields.items() if key not in of_law})
    return Material(**fields) if "young_modulus" in fields else AnisotropicMaterial(**fields)


def materials_by_part(given: Mapping[str, AnyMaterial], parts: Sequence[str]) -> dict[str, AnyMaterial]:
    """Return the material of each part of a body; parts without one of their own have that of the main part, ``""``.

    >>> steel, foam = Material("210 GPa", 0.3, name="steel"), Material("1 MPa", 0.3, name="foam")
    >>> {part: one.name for part, one in materials_by_part({"": steel, "core": foam}, ["core", "rim"]).items()}
    {'core': 'foam', 'rim': 'steel'}
    """
    if len(parts) > 1 and not any(given):
        example = next(filter(None, parts))
        remedy = f"name those of others, such as {{'': ..., {example!r}: ...}}, as `study.materials_of` does"
        raise ValueError(f"material: one is given, and the body has the parts {', '.join(map(repr, parts))}; {remedy}")
    for part in parts:
        if part not in given and "" not in given:
            which = f"part {part!r}" if part else "the main part, ''"
            raise ValueError(f"material: {which} has none; given: {', '.join(map(repr, given)) or 'none'}")
    return {part: given[part if part in given else ""] for part in parts}


def check_isotropic(material: AnyMaterial, remedy: str) -> Material:
    """Return an isotropic material; raise ValueError with the remedy for any other."""
    if not isinstance(material, Material):
        raise ValueError(f"material: {material.name!r} is anisotropic, and beams are of isotropic ones; {remedy}")
    return material


def _read_density(material: AnyMaterial) -> None:
    """Read the density of a material in SI units."""
    if material.density is not None:
        put(material, density=positive(material.density, "density", "density"))


LEAST_STRESS_SHARE = 0.05
"""Share of the largest stress below which errors are relative to it: small stresses are read off coarsely."""

CHECKED_STRETCHES = 400  # stretches of each test over the range of the data at which a fitted law has to be stable

FIT_DIGITS = 10  # digits of what is fitted

COLUMNS_REMEDY = (
    "give two columns, stretch or engineering strain and nominal stress, with a head such as 'stretch,nominal stress "
    "[MPa]' or 'strain [%],nominal stress [MPa]'"
)

STRETCH_RANGE, STRESS_RANGE = (0.01, 50.0), (0.1, 1e12)  # stretches [1] and largest stresses [Pa] that are read

_HEAD = re.compile(r"(?:(?:engineering|nominal)[ _])?(stretch|strain|stress) *(?:[\[(](.{0,20})[\])])?", re.IGNORECASE)
"""Head of a column: its kind, and its unit in brackets."""

_RATIOS = dict.fromkeys(("-", "1", "m/m", "mm/mm"), 1.0) | {"%": 1e-2}  # size of units of stretch and strain


class TestDataError(ValueError):
    """No law can be fitted to a test; the message gives the reason and the remedy."""

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
    def read(cls, path: str | Path) -> TensileTest:
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
        `springtune.problem.materials.TensileTest`.
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
    whole_number(terms, "terms", MOST_TERMS)
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
