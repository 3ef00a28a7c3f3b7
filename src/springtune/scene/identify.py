r"""Constants of a sheet from measured tests, with their uncertainty, and what the tests do not tell.

Least squares of residuals over their noise, with exact derivatives (`springtune.reference.by_constants`). With
residuals r and derivatives J, both over the noise and without shifts, the covariance of the unknowns is
:math:`(J^T J)^{-1}`. Along a direction in which J vanishes the tests tell nothing.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..problem.materials import AnisotropicMaterial, AnyMaterial, Material, rotated
from ..problem.quantities import Number, nearest, positive
from ..problem.rubber import TestDataError, fit_rubber, relative_weights, stress_columns, told
from ..reference.answers import beyond_linear
from ..reference.by_constants import ENTRIES, Family
from ..registry import hook
from ..safe_io.tables import Tabled
from .measured import Block, MeasuredTest, blocks, stated

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET_LAWS = {
    "isotropic": ("E", "nu"),
    "orthotropic": ("E1", "E2", "nu12", "G12"),
    "regions": ("nu",),
    "yeoh": (),
    "neo-hooke": (),
}
"""Laws, and the names of their constants; regions have a modulus each, too, such as ``E core``."""

POISSON_RATIOS = ("nu", "nu12")
"""Constants that are no moduli."""

ASSUMED_RATIO = 0.3
"""Poisson's ratio at which a search begins, and which is assumed where tests do not tell."""

REMEDIES = {"G12": "add a test in shear, or of a coupon cut at 45 degrees", "E2": "add a coupon cut across"}
REMEDIES |= dict.fromkeys(POISSON_RATIOS, "add a transverse displacement or a field, or give it as known")
"""What to add where a constant is not determined; for others a force."""

NULL = 1e-7
"""Singular value of the scaled derivatives, over the largest, below which tests tell nothing along its direction."""

POOR = 0.5
"""Half of an interval from which on a constant is poorly determined: of a ratio, or relative."""

MISFIT = 1.5
"""Residuals over the noise that is given, and correlation of neighbours times three, from which on a model misfits."""

LEAST_NOISE = 1e-9
"""Noise over the values' root mean square that is rounding."""

WEIGHTINGS = 20
"""Most fits until the noise of each block, estimated from the fit before, settles."""


@dataclass(frozen=True, eq=False)
class Model:
    """Tests as functions of the unknowns: ratios, and logarithms of moduli."""

    names: tuple[str, ...]
    tests: list[tuple[Family, list[Block], float]]

    @property
    def blocks(self) -> list[Block]:
        """Blocks of all tests."""
        return [block for _, found, _ in self.tests for block in found]

    def values(self, unknowns: np.ndarray) -> np.ndarray:
        """Constants in SI units."""
        ratio = np.isin(self.names, POISSON_RATIOS)
        return np.where(ratio, unknowns, np.exp(np.where(ratio, 0.0, unknowns)))

    def entries(self, unknowns: np.ndarray, angle: float) -> np.ndarray:
        """Constants of a family: `ENTRIES` of each part, turned by an angle [rad]."""
        *moduli, nu = self.values(unknowns)
        parts = [(one, one, nu, one / (2 * (1 + nu))) for one in moduli]
        if "nu12" in self.names:
            parts = [tuple(self.values(unknowns))]
        found = []
        for along, across, nu, shear in parts:
            scale = 1 - nu**2 * across / along
            mixed = nu * across / scale
            stiffness = rotated(np.array([[along / scale, mixed, 0], [mixed, across / scale, 0], [0, 0, shear]]), angle)
            found += [stiffness[place] for place in ENTRIES]
        return np.array(found)

    def predict(self, unknowns: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield the predicted values of each block and their derivatives by the unknowns, without shifts."""
        for family, found, angle in self.tests:
            constants = self.entries(unknowns, angle)
            steps = unknowns + 1e-30j * np.eye(len(unknowns))  # complex steps are exact
            slopes = np.stack([self.entries(step, angle).imag / 1e-30 for step in steps], axis=1)
            moved, derivatives, pulls = family.solve(constants, slopes)
            for block in found:
                if block.rows is None:  # the energy is stationary, and the force is twice it over the motion
                    value, slope = moved @ pulls @ constants / block.moved, (moved @ pulls @ slopes / block.moved)[None]
                else:
                    value, slope = block.rows @ moved, block.rows @ derivatives
                yield block.unshifted(block.factors * value), block.unshifted(block.factors[:, None] * slope)

    def residuals(self, unknowns: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals over the noise of each block, and their derivatives by the unknowns."""
        if "nu12" in self.names and unknowns[2] ** 2 > np.exp(unknowns[0] - unknowns[1]):  # not positive definite
            size = sum(len(block.values) for block in self.blocks)
            return np.full(size, np.inf), np.zeros((size, len(unknowns)))  # the search shortens its step
        rows = [
            ((value - block.unshifted(block.values)) / one, slope / one)
            for block, one, (value, slope) in zip(self.blocks, noise, self.predict(unknowns))
        ]
        residuals, slopes = zip(*rows)
        return np.concatenate(residuals), np.concatenate(slopes)


@dataclass(frozen=True, eq=False, repr=False)
class Identified(Tabled):
    """Constants of a material found from tests, see `springtune.identify`.

    Attributes
    ----------
    law : str
    values : dict of str to float
        Constants, moduli in Pa; assumed where the tests do not tell.
    intervals : dict of str to (float, float)
        Intervals of 95 %; NaN for known or undetermined constants.
    undetermined : tuple of str
        Constants that the tests do not tell.
    notes : tuple of str
        What the tests do not tell, with the remedy, and signs that the model does not fit.
    noise : dict of str to float
        Noise of each column or field, given or estimated, in SI units; of rubber relative.
    residuals : dict of str to ndarray of float
        Predicted less measured values over the noise [1], without shifts.
    materials : dict of str to Material, AnisotropicMaterial or Rubber
        The material by part of the body; ``""`` is the main one.
    places : dict of str to ndarray of float
        Loads of a curve, shape (n,), or points of a field [m], shape (n, 2).

    Examples
    --------
    Points of a field with noise, made from the reference of a known material:

    >>> import numpy as np
    >>> import springtune as st
    >>> from springtune.reference.small_strain import solve_small_strain
    >>> beam, random = st.Beam("100 mm", "20 mm"), np.random.default_rng(1)
    >>> points = random.uniform([0.0, 0.0], [0.1, 0.02], (200, 2))
    >>> moved = solve_small_strain(beam, st.Material("70 GPa", 0.33), 400.0).at(points)
    >>> table = np.hstack([points, moved + random.normal(0.0, 1e-8, moved.shape)])
    >>> np.savetxt("field.csv", table, delimiter=",", header="x [m],y [m],u [m],v [m]", comments="")
    >>> found = st.identify(st.MeasuredTest(beam, "traction", "field.csv", force="400 N"))
    >>> print(f"{found.values['E'] / 1e9:.1f} GPa, {found.values['nu']:.2f}")
    70.0 GPa, 0.33
    """

    law: str
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    undetermined: tuple[str, ...]
    notes: tuple[str, ...]
    noise: dict[str, float]
    residuals: dict[str, np.ndarray]
    materials: dict[str, AnyMaterial]
    places: dict[str, np.ndarray]

    def _rows(self) -> Iterator[tuple[str, str]]:
        for name, value in self.values.items():
            size, unit = (1.0, "") if name in POISSON_RATIOS else (1e9, " GPa") if value >= 1e9 else (1e6, " MPa")
            low, high = (f"{one / size:.5g}" for one in self.intervals[name])
            text = f"{value / size:.5g}{unit}"
            if name in self.undetermined:
                yield name, f"not determined; {text} is assumed, also for the other intervals"
            else:
                yield name, f"{text}, given" if low == "nan" else f"{text}, 95 %: {low} to {high}{unit}"
        yield from ((f"noise of {name}", f"{noise:.3g} in SI units") for name, noise in self.noise.items())
        yield from (("note", note) for note in self.notes)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw residuals over their noise: of curves over the load, of fields over x.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Where to draw; on new axes without.

        Returns
        -------
        matplotlib.axes.Axes

        Examples
        --------
        >>> import springtune as st
        >>> st.identify("config/treloar/uniaxial.csv", "neo-hooke").plot().get_ylabel()
        'Residual over noise [1]'
        """
        axes: Axes = hook("drawing").draw_residuals(ax, self.residuals, self.places)
        return axes


def identify(
    tests: MeasuredTest | Sequence[MeasuredTest] | str | Path,
    law: str = "isotropic",
    *,
    known: Mapping[str, Number] | None = None,
) -> Identified:
    r"""Find the constants of a material from measured tests, with intervals of 95 %.

    Parameters
    ----------
    tests : MeasuredTest or sequence of MeasuredTest, or str or Path
        Tests of sheets at small strain; of rubber the file of a tensile test, see `springtune.fit_rubber`.
    law : str, optional
        ``"isotropic"``: E, nu. ``"orthotropic"``: E1, E2, nu12, G12 along the material's axes. ``"regions"``: E of
        each part of a shape, and one nu. ``"neo-hooke"`` and ``"yeoh"``: c1, and c1 to c3 of rubber.
    known : mapping of str to float or str, optional
        Constants that are known, such as ``{"nu": 0.3}``.

    Returns
    -------
    Identified

    Raises
    ------
    TestDataError
        If there are fewer numbers than unknowns, or a file does not fit its body. It is a ValueError.
    ValueError
        If an argument is unknown or out of range.

    Examples
    --------
    A curve tells one number:

    >>> from pathlib import Path
    >>> import springtune as st
    >>> lines = ["force [N],displacement [um]", "0,0.1", "200,13.6", "400,26.9", "600,40.6"]
    >>> _ = Path("pull.csv").write_text("\n".join(lines))
    >>> found = st.identify(st.MeasuredTest(st.Beam("100 mm", "20 mm"), "traction", "pull.csv"))
    >>> f"{found.values['E'] / 1e9:.0f} GPa", found.undetermined
    ('74 GPa', ('nu',))
    """
    if law not in SHEET_LAWS:
        raise ValueError(f"law: {law!r} is unknown; {nearest(str(law), SHEET_LAWS)}")
    if isinstance(tests, str | Path) != (not SHEET_LAWS[law]):
        raise ValueError(f"tests: {tests!r}; give the file of one test for rubber, else springtune.MeasuredTest")
    if isinstance(tests, str | Path):
        return _rubber(tests, law)
    given = [tests] if isinstance(tests, MeasuredTest) else list(tests)
    bodies = [stated(one) for one in given]
    parts = list(
        dict.fromkeys(part for shape, _, mesh in bodies for part in ("", *(mesh.parts if mesh else shape.parts)))
    )
    regions = tuple(f"E {part or 'main'}" for part in parts) if law == "regions" else ()
    names = regions + SHEET_LAWS[law]
    if len(parts) > 1 and not regions:
        raise ValueError(f"law: {law!r} is of one material, and the body has the parts {parts}; take 'regions'")
    unknowns, free = _start(names, known or {})
    for settled in (False, True):  # elements for a usual material, then for what was found
        materials = [_materials(Model(names, []), unknowns, parts, one.angle) for one in given]
        families = [Family(*body[:2], own, body[2]) for body, own in zip(bodies, materials)]
        model = Model(
            names,
            [
                (family, list(blocks(one, family, body[1])), one.angle)
                for one, family, body in zip(given, families, bodies)
            ],
        )
        if not settled:
            unknowns = np.where(free & ~np.isin(names, POISSON_RATIOS), unknowns + _scale(model, unknowns), unknowns)
        lacking = undetermined(model, unknowns, free)
        unknowns, residuals, slopes, noise, freedom = fit(model, unknowns, free & ~np.isin(names, lacking))
    found = zip(np.flatnonzero(free & ~np.isin(names, lacking)), half_intervals(slopes, freedom))
    values = model.values(unknowns).tolist()
    ends = {name: (value, np.nan, np.nan) for name, value in zip(names, values)}
    notes = [f"{name}: not determined by these data; {REMEDIES.get(name, 'add a force')}" for name in lacking]
    for place, half in found:
        low, high = (model.values(unknowns + step)[place] for step in half * np.eye(len(names))[place] * [[-1], [1]])
        ends[names[place]] = (values[place], float(low), float(high))
        if half > POOR:
            notes.append(f"{names[place]}: poorly determined by these data; {REMEDIES.get(names[place], 'add a test')}")
    for family, own, _ in model.tests:
        factor = max(np.abs(block.factors).max() for block in own)
        if why := beyond_linear(factor * family.reference.rotation, factor * family.reference.strain):
            notes.append(f"{own[0].label}: {why}; leave out large loads")
    main = _materials(model, unknowns, parts, 0.0)
    return _result(law, ends, lacking, notes, model.blocks, noise, residuals, main)


def _start(names: tuple[str, ...], known: Mapping[str, Number]) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns of a usual material, with those that are known, and which are to be found."""
    unknowns = np.array([ASSUMED_RATIO if name in POISSON_RATIOS else np.log(1e9) for name in names])
    for name, value in known.items():
        if name not in names:
            raise ValueError(f"known: {name!r} is no constant of this law; {nearest(str(name), names)}")
        if len(known) == len(names):
            raise ValueError(f"known: {', '.join(known)} are all constants of this law; leave out what is to be found")
        if name in POISSON_RATIOS and not (isinstance(value, int | float) and -1 < value <= 0.5):
            raise ValueError(f"known: {name} is {value!r}; give a number above -1, at most 0.5")
        number = value if name in POISSON_RATIOS else np.log(positive(value, "stress", f"known: {name}"))
        unknowns[names.index(name)] = number
    return unknowns, ~np.isin(names, list(known))


def _materials(model: Model, unknowns: np.ndarray, parts: list[str], angle: float) -> dict[str, AnyMaterial]:
    """Material of each part, turned by an angle [rad]."""
    values = model.values(unknowns).tolist()
    if "nu12" in model.names:
        along, across, nu, shear = values
        return {"": AnisotropicMaterial.orthotropic(along, across, nu, shear, angle, name="measured")}
    *moduli, nu = values
    own = moduli if len(moduli) == len(parts) else moduli * len(parts)
    return {part: Material(one, min(nu, 0.5), name=f"measured-{part}".rstrip("-")) for part, one in zip(parts, own)}


def _scale(model: Model, unknowns: np.ndarray) -> float:
    """Logarithm of the factor by which all moduli are larger than those of the unknowns."""
    found = []
    for block, (predicted, _) in zip(model.blocks, model.predict(unknowns)):
        ratio = float(predicted @ block.unshifted(block.values))
        if ratio < 0 and block.label.startswith(("displacement", "force")):
            raise TestDataError(
                f"{block.label}: runs against the load; both are positive along the load, so change a column's sign"
            )
        if ratio > 0:
            found.append(np.log(ratio / (predicted @ predicted)) * (1 if block.moved else -1))
    return float(np.mean(found)) if found else 0.0


def undetermined(model: Model, unknowns: np.ndarray, free: np.ndarray) -> tuple[str, ...]:
    """Constants without which the derivatives by the others have no direction in which they vanish."""
    sizes = np.array([np.linalg.norm(block.values) or 1.0 for block in model.blocks])
    slopes, names = model.residuals(unknowns, sizes)[1], np.array(model.names)
    lacking: list[str] = []
    while (kept := free & ~np.isin(names, lacking)).any():
        _, sizes, ways = np.linalg.svd(slopes[:, kept])
        sizes = np.pad(sizes, (0, len(ways) - len(sizes)))
        told_ = sizes > NULL * sizes[0]
        if told_.all():
            return tuple(lacking)
        empty = np.abs(ways[~told_]).max(axis=0)
        lacking.append(str(names[kept][np.argmax(empty + np.isin(names[kept], POISSON_RATIOS) * NULL)]))
    _numbers(model, 1)
    raise TestDataError(
        f"{', '.join(lacking)}: not determined by these data, which have no force; add one, as of a curve or the load"
    )


def _numbers(model: Model, count: int) -> np.ndarray:
    """Numbers of each block besides the shift; refused if they are too few for a count of unknowns."""
    numbers = np.array([len(block.values) - block.shifts.shape[1] for block in model.blocks])
    if numbers.sum() < count + any(block.noise is None for block in model.blocks) or numbers.min() < 1:
        raise TestDataError(
            f"{', '.join(block.label for block in model.blocks)}: {max(numbers.sum(), 0)} numbers besides the shift, "
            f"for the unknowns {', '.join(model.names)} and the noise; give more rows, or known constants and noise"
        )
    return numbers


def fit(
    model: Model, unknowns: np.ndarray, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """Fit free unknowns; return all, residuals and derivatives over the noise, the noise, and degrees of freedom.

    Noise that is not given is estimated from the residuals of each block.
    """
    from scipy.optimize import least_squares

    found, names = model.blocks, np.array(model.names)[free]
    numbers, estimated = _numbers(model, len(names)), np.array([block.noise is None for block in found])
    sizes = np.array([np.linalg.norm(block.values) / len(block.values) ** 0.5 or 1.0 for block in found])
    noise = np.array([block.noise or size for block, size in zip(found, sizes)])
    freedom = np.maximum(numbers * (1 - len(names) / numbers.sum()), LEAST_NOISE)
    ends = np.cumsum([len(block.values) for block in found])[:-1]
    most = np.where(names == "nu", 0.5, np.inf)
    least = np.where(names == "nu", -1 + LEAST_NOISE, -np.inf)

    def evaluated(part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        whole = unknowns.copy()
        whole[free] = part
        residuals, slopes = model.residuals(whole, noise)
        return residuals, slopes[:, free]

    part = np.clip(unknowns[free], least, most - 1e-6)
    for _ in range(WEIGHTINGS):
        part = least_squares(
            lambda one: evaluated(one)[0], part, lambda one: evaluated(one)[1], (least, most), xtol=1e-12, ftol=1e-12
        ).x
        sums = np.array([one @ one for one in np.split(evaluated(part)[0], ends)])
        before, settled = noise, np.maximum(noise * np.sqrt(sums / freedom), LEAST_NOISE * sizes)
        noise = np.where(estimated, settled, noise)
        if np.allclose(noise, before, rtol=1e-3, atol=0):
            break
    unknowns = unknowns.copy()
    residuals, slopes = evaluated(part)
    unknowns[free] = part
    return unknowns, residuals, slopes, noise, float(freedom[estimated].sum()) or np.inf


def half_intervals(slopes: np.ndarray, freedom: float) -> np.ndarray:
    """Halves of the 95 % intervals of unknowns by Student's t, from derivatives over the noise (n, n_unknowns)."""
    from scipy.stats import t

    return np.asarray(t.ppf(0.975, freedom) * np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes))))


def _result(
    law: str, ends: dict[str, tuple[float, float, float]], lacking: tuple[str, ...], notes: list[str],
    found: list[Block], noise: np.ndarray, residuals: np.ndarray, materials: dict[str, AnyMaterial],
) -> Identified:  # fmt: skip
    """Result, with notes where the model does not fit; `ends` has each value and its interval."""
    each = np.split(residuals, np.cumsum([len(block.values) for block in found])[:-1])
    for block, one in zip(found, each):
        size = np.sqrt((one @ one) / len(one))
        if block.noise is not None and size > MISFIT:
            notes.append(f"{block.label}: residuals are {size:.2g} times the given noise; the model does not fit")
        ordered = one[np.argsort(block.places, kind="stable")] if block.places.ndim == 1 else one[:1]
        if len(ordered) > 9 and ordered[1:] @ ordered[:-1] > MISFIT / 3 * (one @ one):
            notes.append(
                f"{block.label}: residuals are not random, so the intervals are too narrow; leave out where the law "
                "does not hold"
            )
    labels = [block.label for block in found]
    values, intervals = (
        {name: three[0] for name, three in ends.items()},
        {name: three[1:] for name, three in ends.items()},
    )
    data = (dict(zip(labels, one)) for one in (noise.tolist(), each, [block.places for block in found]))
    kept, own, places = data
    return Identified(law, values, intervals, lacking, tuple(notes), kept, own, materials, places)


def _rubber(file: str | Path, law: str) -> Identified:
    """Yeoh's law by `fit_rubber`, with intervals of its linear least squares of relative errors."""
    test = told(file)
    material = fit_rubber(test, terms=3 if law == "yeoh" else 1)
    found, weights = np.array(material.coefficients), relative_weights(test)
    freedom = len(weights) - len(found)
    if freedom < 1:
        raise TestDataError(
            f"'{file}': {len(weights)} points, and {len(found)} unknowns and the noise; give more points"
        )
    columns = stress_columns(test.stretch, len(found))
    residuals = (columns @ found - test.stress) * weights
    noise = np.sqrt(residuals @ residuals / freedom)
    block = Block(f"stress of '{file}'", test.stress, weights, None, columns[:, :0], None, test.stretch)
    names = [f"c{number}" for number in range(1, len(found) + 1)]
    half = half_intervals(columns * weights[:, None] / noise, freedom)
    ends = dict(zip(names, zip(found.tolist(), (found - half).tolist(), (found + half).tolist())))
    return _result(law, ends, (), [], [block], np.array([noise]), residuals / noise, {"": material})
