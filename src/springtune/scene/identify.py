"""Constants of a sheet from measured tests, with their uncertainty, and the constants that the tests do not determine.

Least squares of residuals over their noise, with exact derivatives J, both without shifts: the covariance of the
unknowns is :math:`(J^T J)^{-1}`. Tests do not determine constants along directions in which J vanishes.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import qr
from scipy.optimize import least_squares
from scipy.spatial import KDTree
from scipy.stats import f, t

from ..mesh.sheets import parts_of
from ..problem.materials import AnisotropicMaterial, AnyMaterial, Material, TestDataError, rotated
from ..problem.quantities import Number, choose, positive
from ..reference.answers import beyond_linear
from ..reference.by_constants import ENTRIES, Family
from ..registry import hook
from ..safe_io import Tabled, number_of
from .measured import Block, MeasuredTest, blocks, body_of_test
from .mesh_cache import check_type

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHEET_LAWS = {"isotropic": ("E", "nu"), "orthotropic": ("E1", "E2", "nu12", "G12"), "regions": ("nu",)}
"""Laws, and the names of their constants; regions have a modulus each, too, such as ``E core``."""

USUAL_POISSON_RATIOS = {"nu": 0.3, "nu12": 0.3}
"""Poisson's ratios where a search begins, and which are assumed if tests do not determine them."""

REMEDIES = {"G12": "add a test in shear, or of a coupon cut at 45 degrees", "E2": "add a coupon cut across"}
REMEDIES |= dict.fromkeys(USUAL_POISSON_RATIOS, "add a transverse displacement or a field, or give it as known")
"""Test to add where a constant is not determined; for others a force."""

LEAST_DERIVATIVE = 1e-7
"""Derivative by a constant besides those by others, over the largest, below which a constant is undetermined."""

POISSON_STEP = 0.1  # change of a Poisson's ratio that is as likely as one of a modulus by a factor e

POOR_HALF_INTERVAL = 0.5  # half of an interval above which a constant is poorly determined: of a ratio, or relative

MISFIT_PROBABILITY = 0.01  # probability of residuals by chance below which a law misfits

EXPLAINED_SHARE = 0.5
"""Least share of a field's squares that the load must explain, if residuals are not random."""

REFERENCE_ERROR = 3e-4  # error of the reference over the values' root mean square, below which residuals tell nothing

LEAST_NOISE = 1e-9  # noise over the values' root mean square that is rounding


OUTLIER_DEVIATIONS = 5.0  # deviations above which a value is an outlier; more if there are few values

FEWEST_POINTS = 10  # fewest places whose residuals are checked

DEVIATION_OVER_MEDIAN = 1.4826  # standard deviation over the median of magnitudes

CORRELATION_DEVIATIONS = 2.75  # deviations above which a correlation of neighbours is not by chance


def vary(constants: dict[str, Any], names: Iterable[str], steps: Iterable[complex]) -> dict[str, Any]:
    """Change constants by steps: ratios by addition, moduli by factors exp(step)."""
    return constants | {
        name: constants[name] + step if name in USUAL_POISSON_RATIOS else constants[name] * np.exp(step)
        for name, step in zip(names, steps)
    }


def assume_usual(constants: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Replace named constants by usual values beside the others."""
    found = constants | {name: ratio for name, ratio in USUAL_POISSON_RATIOS.items() if name in names}
    if "G12" in found:
        if ("E1" in names) != ("E2" in names):
            found["E1"] = found["E2"] = found["E2" if "E1" in names else "E1"]
        if "nu12" in names and found["E2"] > 1.5 * found["E1"]:  # the ratio of the stiffer direction
            found["nu12"] *= found["E1"] / found["E2"]
        if "G12" in names:
            found["G12"] = np.sqrt(found["E1"] * found["E2"]) / (2 + 2 * USUAL_POISSON_RATIOS["nu12"])
    return found


def limit_anisotropy(constants: dict[str, Any]) -> dict[str, Any]:
    """Limit the ratios of orthotropic constants to those that finite elements can follow."""
    if "G12" not in constants:
        return constants
    middle = sorted([constants["E1"], constants["E2"], 2.6 * constants["G12"]])[1]
    found = {name: min(max(constants[name], middle / 100), 100 * middle) for name in ("E1", "E2", "G12")}
    most = 0.9 * np.sqrt(found["E1"] / found["E2"])
    return {name: found.get(name, min(max(value, -most), most)) for name, value in constants.items()}


def entries(constants: dict[str, Any], angle: float) -> np.ndarray:
    """`ENTRIES` of each part, turned by an angle [rad], shape (n_parts, 6)."""
    *moduli, nu = constants.values()
    each = [(one, one, nu, one / (2 * (1 + nu))) for one in moduli]
    found = []
    for along, across, ratio, shear in [constants.values()] if "G12" in constants else each:
        mixed = -ratio / along
        compliance = np.array([[1 / along, mixed, 0], [mixed, 1 / across, 0], [0, 0, 1 / shear]])
        stiffness = rotated(np.linalg.inv(compliance), angle)
        found.append([stiffness[place] for place in ENTRIES])
    return np.array(found)


class Model:
    """Tests as functions of constants: for each a family of solutions, its numbers, and the material's angle."""

    def __init__(self, tests: Sequence[tuple[Family, list[Block], float]]) -> None:
        self.tests, self.blocks = tests, [block for _, own, _ in tests for block in own]
        self.counts = np.array([len(block.values) - block.shifts.shape[1] for block in self.blocks])
        self.sizes = np.array([np.sqrt(np.mean(block.values**2)) or 1.0 for block in self.blocks])

    def residuals(self, constants: dict[str, Any], names: Sequence[str], noise: np.ndarray) -> list[np.ndarray]:
        """Residuals of each block over its noise, without shifts; beside them their derivatives by named constants."""
        found, scales, steps = [], iter(noise), 1e-30j * np.eye(len(names))  # complex steps are exact
        for family, own, angle in self.tests:
            slopes = [entries(vary(constants, names, step), angle).imag / 1e-30 for step in steps]
            columns = np.stack([entries(constants, angle), *slopes], axis=-1)
            moved = family.solve(columns.reshape(-1, columns.shape[-1]))
            for block in own:
                table = block.unshifted(block.factors[:, None] * (block.rows @ moved))
                table[:, 0] -= block.unshifted(block.values)
                found.append(table / next(scales))
        return found

    def general(self, constants: dict[str, Any]) -> list[np.ndarray]:
        """Values of each block and their derivatives by all constants of elasticity."""
        found = []
        for family, own, angle in self.tests:
            stiffness = entries(constants, angle)
            steps = np.zeros((len(ENTRIES), 3, 3))  # along the material's axes
            for step, (row, column) in zip(steps, ENTRIES):
                step[row, column] = step[column, row] = 1
            turned = [[rotated(step, angle)[place] for step in steps] for place in ENTRIES]
            every = np.kron(np.diag(np.abs(stiffness).max(axis=1)), turned)
            moved = family.solve(np.column_stack([stiffness.ravel(), every]))
            found += [block.factors[:, None] * (block.rows @ moved) for block in own]
        return found

    def without_outliers(self, constants: dict[str, Any]) -> tuple["Model", list[str]]:
        """Return the model without outliers, and notes on them."""
        notes, kept = [], []
        for block, table in zip(self.blocks, self.general(constants)):
            floor = 10 * REFERENCE_ERROR * np.sqrt(np.mean(table[:, 0] ** 2))
            columns = block.by_place(np.hstack([table, block.shifts]))
            stay = find_measurements(block.by_place(block.values), columns, block.places, floor)
            kept.append(block.select(stay))
            if not stay.all():
                where = ", ".join(f"{1e3 * one:.4g} mm" for one in np.atleast_2d(block.places[~stay])[0])
                where = f"x, y = {where}" if block.places.ndim > 1 else f"a load of {block.places[~stay][0]:g} N"
                out = f"{(~stay).sum()} of {len(stay)} points are left out, the first at {where}"
                why = "they repeat one value that does not fit, such as 0, or are far from all others"
                notes.append(f"{block.label}: {out}: {why}")
        each = iter(kept)
        return Model([(family, [next(each) for _ in own], angle) for family, own, angle in self.tests]), notes

    def undetermined(self, constants: dict[str, Any], names: Sequence[str]) -> list[str]:
        """Named constants whose derivatives are combinations of those by the others."""
        slopes = np.concatenate(self.residuals(constants, names, self.sizes))[:, 1:]
        slopes *= [POISSON_STEP if name in USUAL_POISSON_RATIOS else 1 for name in names]
        triangle, order = qr(slopes, mode="r", pivoting=True)
        own = np.abs(np.diag(triangle))
        rank = int(np.count_nonzero(own > LEAST_DERIVATIVE * own[0]))
        labels, unknowns = ", ".join(block.label for block in self.blocks), ", ".join(names)
        if self.counts.sum() <= max(rank, 1) or self.counts.min() < 1:
            count = f"{max(self.counts.sum(), 0)} numbers besides the shift"
            raise TestDataError(f"{labels}: {count}, for the unknowns {unknowns} and the noise; give more rows")
        if not rank:
            raise TestDataError(f"{unknowns}: not determined by these data, which have no force; add one")
        return [names[place] for place in np.sort(order[rank:])]

    def fit(
        self, constants: dict[str, Any], names: Sequence[str]
    ) -> tuple[dict[str, Any], list[np.ndarray], np.ndarray, np.ndarray]:
        """Fit named constants; return all, `residuals`, noise by block, and halves of 95 % intervals (Student's t)."""
        noise = self.sizes
        freedom = self.counts * max(1 - len(names) / self.counts.sum(), LEAST_NOISE)
        # Moduli stay within factors of exp(30), even where forces and displacements contradict each other.
        bounds = np.array([(-1.0, 0.5) if name == "nu" else (-30.0, 30.0) for name in names])
        bounds -= [[constants[name] if name == "nu" else 0.0] for name in names]

        @lru_cache(maxsize=1)  # values and slopes are asked for in turn
        def tables(steps: bytes, noise: bytes) -> list[np.ndarray]:
            tried = vary(constants, names, np.frombuffer(steps))
            if "G12" in tried and tried["nu12"] ** 2 > tried["E1"] / tried["E2"]:  # not positive definite
                return [np.full((len(block.values), 1), np.inf) for block in self.blocks]  # a shorter step follows
            return self.residuals(tried, names, np.frombuffer(noise))

        def table(steps: np.ndarray) -> np.ndarray:
            return np.concatenate(tables(steps.tobytes(), noise.tobytes()))

        steps, close = np.zeros(len(names)), {"xtol": 1e-10, "ftol": 1e-10}
        for _ in range(20):  # until the noise that is estimated settles
            steps = least_squares(lambda s: table(s)[:, 0], steps, lambda s: table(s)[:, 1:], bounds.T, **close).x
            sizes = np.array([np.linalg.norm(one[:, 0]) for one in tables(steps.tobytes(), noise.tobytes())])
            before, noise = noise, np.maximum(noise * sizes / np.sqrt(freedom), LEAST_NOISE * self.sizes)
            if np.allclose(noise, before, rtol=1e-3, atol=0):
                break
        _, sizes, right = np.linalg.svd(table(steps)[:, 1:], full_matrices=False)
        half = t.ppf(0.975, freedom.sum()) * np.linalg.norm(right.T / sizes.clip(1e-100), axis=1)
        found = list(tables(steps.tobytes(), noise.tobytes()))
        return vary(constants, names, steps), found, noise, half.clip(max=600)  # exp(700) is infinite


@dataclass(frozen=True, eq=False, repr=False)
class Identified(Tabled):
    r"""Constants of a material found from tests, see `springtune.identify`.

    Attributes
    ----------
    law : str
    values, intervals : dict of str to float, dict of str to (float, float)
        Moduli in Pa, assumed if undetermined, and 95 % intervals; these are NaN if known or undetermined.
    undetermined, notes : tuple of str
        Constants that the tests do not determine, with the remedy, and signs that the model does not fit.
    noise : dict of str to float
        Noise of each column or field, estimated [m].
    residuals : dict of str to ndarray of float
        Predicted less measured values over the noise [1], without shifts.
    materials : dict of str to Material or AnisotropicMaterial
        The material by part of the body; ``""`` is the main one.
    places : dict of str to ndarray of float
        Loads of a curve, shape (n,), or points of a field [m], shape (n, 2).

    Examples
    --------
    >>> from pathlib import Path
    >>> import springtune as st
    >>> _ = Path("pull.csv").write_text("force [N],displacement [um]\n0,0.1\n200,13.6\n400,26.9")
    >>> found = st.identify(st.MeasuredTest(st.Beam("100 mm", "20 mm"), "traction", "pull.csv"))
    >>> found.plot().get_ylabel()
    'Residual over noise [1]'
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
            size, unit = (1.0, "") if name.startswith("nu") else (1e9, " GPa") if value >= 1e9 else (1e6, " MPa")
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

        Returns
        -------
        matplotlib.axes.Axes
        """
        return hook("drawing").draw_residuals(ax, self.residuals, self.places)


def identify(
    tests: MeasuredTest | Sequence[MeasuredTest], law: str = "isotropic", *, known: Mapping[str, Number] | None = None
) -> Identified:
    r"""Find the constants of a material from measured tests, with intervals of 95 %.

    Parameters
    ----------
    tests : MeasuredTest or sequence of MeasuredTest
        Tests of sheets at small strain; for rubber see `springtune.fit_rubber`.
    law : str, optional
        ``"isotropic"``: E, nu. ``"orthotropic"``: E1, E2, nu12, G12 along the material's axes. ``"regions"``: E of
        each part of a shape, and one nu.
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
    constants_of_law = choose(SHEET_LAWS, law, "law")
    tests = list(tests) if isinstance(tests, Sequence) else [tests]
    for test in tests:
        check_type(test, MeasuredTest, "tests")
    bodies = [*map(body_of_test, tests)]
    parts = sorted({part for shape, _, mesh in bodies for part in (parts_of(mesh) if mesh else ("", *shape.parts))})
    regions = [f"E {part or 'main'}" for part in parts] if law == "regions" else []
    if len(parts) > 1 and not regions:
        raise ValueError(f"law: {law!r} is of one material, and the body has the parts {parts}; take 'regions'")
    constants, free = _start([*regions, *constants_of_law], known or {})
    moduli = [name for name in free if name not in USUAL_POISSON_RATIOS]
    for turn in range(5):  # elements for a usual material, then for the found one, until assumed constants settle
        solved = []
        for test, body in zip(tests, bodies):
            own = dict(zip(parts, entries(limit_anisotropy(constants), test.angle).tolist()))
            family = Family(*body, {part: AnisotropicMaterial(*one) for part, one in own.items()})
            solved.append((family, blocks(test, family, body[1]), test.angle))
        model = Model(solved)
        model, notes = model.without_outliers(constants)
        constants = vary(constants, moduli, [_scale(model, constants)] * len(moduli))
        lacking, found, *_ = _fitted(model, constants, free)
        settled = all(np.isclose(constants[name], found[name], rtol=0.01) for name in lacking)
        constants = found
        if turn and settled:
            break
    for test, (family, own_blocks, _) in zip(tests, model.tests):
        if test._missing:
            notes.append(f"'{test.file}': {test._missing} points have no numbers and are left out")
        most = max(np.abs(block.factors).max() for block in own_blocks)
        if why := beyond_linear(most * family.reference.rotation, most * family.reference.strain):
            notes.append(f"'{test.file}': {why}; leave out large loads")
    result = _identified(law, model, constants, free, notes)
    constants = result.values
    if law == "orthotropic":
        along, across, nu, shear = constants.values()
        ply = AnisotropicMaterial.orthotropic(along, across, nu, shear, name="measured")
        return replace(result, materials={"": ply})
    names = [f"measured-{part}".rstrip("-") for part in parts]
    each = [Material(modulus, constants["nu"], name=name) for modulus, name in zip(constants.values(), names)]
    return replace(result, materials=dict(zip(parts, each)))


def _start(names: Sequence[str], known: Mapping[str, Number]) -> tuple[dict[str, Any], list[str]]:
    """Constants of a usual material, with those that are known, and the names of the others."""
    constants = {name: USUAL_POISSON_RATIOS.get(name, 1e9) for name in names}
    for name, value in known.items():
        choose(constants, name, "known")
        is_ratio = name in USUAL_POISSON_RATIOS
        if is_ratio and not -1 < number_of(value) <= 0.5:
            raise ValueError(f"known: {name} is {value!r}; give a number above -1, at most 0.5")
        constants[name] = number_of(value) if is_ratio else positive(value, "stress", f"known: {name}")
    constants = assume_usual(constants, {"nu12", "G12"} & {*names} - {*known})
    if len(known) == len(names):
        raise ValueError(f"known: {', '.join(known)} are all constants of this law; leave out what is to be found")
    return constants, [name for name in names if name not in known]


def _scale(model: Model, constants: dict[str, Any]) -> float:
    """Logarithm of the factor on all moduli with which they fit the tests on average."""
    found = [0.0]
    for block, table in zip(model.blocks, model.residuals(constants, (), np.ones(len(model.blocks)))):
        own = block.unshifted(block.values)
        predicted = table[:, 0] + own
        share = predicted @ own / (np.linalg.norm(predicted) * np.linalg.norm(own) or 1)
        if block.places.ndim > 1 and share * np.sqrt(len(own)) < -4:
            raise TestDataError(f"{block.label}: is opposite to the load; change the sign of its displacements")
        if predicted @ own > 0:
            found.append(np.log(predicted @ predicted / (predicted @ own)))
    return float(np.sum(found) / max(len(found) - 1, 1))


def _fitted(
    model: Model, constants: dict[str, Any], free: Sequence[str]
) -> tuple[list[str], dict[str, Any], list[np.ndarray], np.ndarray, np.ndarray]:
    """Undetermined constants, and `Model.fit` of the others; refuse fields of other loads."""
    lacking = model.undetermined(constants, free)
    names = [name for name in free if name not in lacking]
    constants, tables, noise, half = model.fit(assume_usual(constants, lacking), names)
    for block, table, one in zip(model.blocks, tables, noise):
        own, left = block.unshifted(block.values), one * table[:, 0]
        share = left @ left / (own @ own or 1)
        unexplained = block.places.ndim > 1 and share > 1 - EXPLAINED_SHARE
        if unexplained and correlation_excess(block.by_place(left), block.places) > 0:
            explained = f"the load explains {100 * max(1 - share, 0):.0f} % of it"
            raise TestDataError(f"{block.label}: {explained}; check load, columns and signs")
    return lacking, constants, tables, noise, half


def _identified(law: str, model: Model, constants: dict[str, Any], free: Sequence[str], notes: list[str]) -> Identified:
    """Result of a fit without materials, with notes on undetermined constants and on misfits of the model."""
    lacking, constants, tables, noise, half = _fitted(model, constants, free)
    names = [name for name in free if name not in lacking]
    odd = _checked(model, constants, tables, noise)
    notes = [f"{name}: not determined by these data; {REMEDIES.get(name, 'add a force')}" for name in lacking] + notes
    for name in np.array(names)[half > POOR_HALF_INTERVAL]:
        notes.append(f"{name}: poorly determined by these data; {REMEDIES.get(name, 'add a test')}")
    residuals = {block.label: table[:, 0] for block, table in zip(model.blocks, tables)}
    fitted = {name: value if name in names else np.nan for name, value in constants.items()}
    low, high = (vary(fitted, names, one) for one in (-half, half))
    for name in [name for name in USUAL_POISSON_RATIOS if high.get(name, 0) < 0]:
        remedy = "if this is none of them, change the sign of v or of the transverse displacement, or let y run upwards"
        odd.append(f"{name}: is below zero, as of few materials; {remedy}")
    values = {name: float(value) for name, value in constants.items()}
    intervals = {name: (float(low[name]), float(high[name])) for name in constants}
    noises, places = dict(zip(residuals, noise.tolist())), {block.label: block.places for block in model.blocks}
    return Identified(law, values, intervals, tuple(lacking), (*notes, *odd), noises, residuals, {}, places)


def _checked(model: Model, constants: dict[str, Any], tables: list[np.ndarray], noise: np.ndarray) -> list[str]:
    """Notes on residuals that are not random, or that follow a more general law."""
    residual, slopes = np.concatenate(tables)[:, 0], np.concatenate(tables)[:, 1:]
    left, sizes, _ = np.linalg.svd(slopes, full_matrices=False)
    tested = zip(model.blocks, model.general(constants), noise)
    beyond = np.concatenate([block.unshifted(table[:, 1:]) / one for block, table, one in tested])
    others, strong, _ = np.linalg.svd(beyond - left @ (left.T @ beyond), full_matrices=False)
    others = others[:, strong > 1e-6 * sizes[0]]
    extra = others.shape[1]
    freedom = float(model.counts.sum() - left.shape[1] - extra)
    if freedom < FEWEST_POINTS:
        return []
    along = others.T @ residual
    law = others @ along
    rest = residual - left @ (left.T @ residual) - law
    ends = np.cumsum([len(table) for table in tables])[:-1]
    notes, misfit = [], False
    for block, one, own, follows in zip(model.blocks, noise, np.split(rest, ends), np.split(law, ends)):
        error = REFERENCE_ERROR * np.sqrt(np.mean(block.values**2)) / one
        misfit |= bool(np.sqrt(np.mean(follows**2)) > error)
        if correlation_excess(block.by_place(own), block.places) > error**2:
            why = "so the intervals are too narrow; leave out where the law does not hold"
            if block.places.ndim > 1:
                why += ", check load and supports, and give fewer points of overlapping subsets"
            notes.append(f"{block.label}: residuals are not random, {why}")
    if misfit and f.sf((along @ along / extra) / (rest @ rest / freedom), extra, freedom) < MISFIT_PROBABILITY:
        why = "the law does not fit: residuals follow other constants of elasticity, so the intervals do not hold"
        notes.append(f"{why}; check the law, the angle, known constants, and the signs of columns")
    return notes


# -- which values are outliers, and whether the residuals of the others are random ------------------------------------
# Arrays: values (n_places, n_components), columns (n_places, n_components, n), places (n_places,) or (n_places, 2).


def find_measurements(values: np.ndarray, columns: np.ndarray, places: np.ndarray, floor: float) -> np.ndarray:
    """Return which places to keep: outliers repeat a value that does not fit, or are far from their neighbours."""
    count = len(places)
    if count < FEWEST_POINTS:
        return np.ones(count, bool)
    spread = np.abs(values - np.median(values, axis=0))
    begin = (spread <= 100 * np.median(spread, axis=0)).all(axis=1) & ((values != 0).any(axis=1) | (places.ndim == 1))
    begin = begin if begin.sum() >= FEWEST_POINTS else np.ones(count, bool)
    table = columns[begin].reshape(-1, columns.shape[-1])
    sizes, target, weights = np.linalg.norm(table, axis=0) + 1e-300, values[begin].ravel(), np.ones(table.shape[:1])
    for _ in range(30):
        found = np.linalg.lstsq(table / sizes * weights[:, None], target * weights, rcond=1e-9)[0] / sizes
        apart = np.abs(target - table @ found)
        weights = np.maximum(apart, 1e-3 * np.median(apart) + 1e-300) ** -0.5
    apart, limit = values - columns @ found, OUTLIER_DEVIATIONS * (1 + FEWEST_POINTS / count)
    far = np.abs(apart) > limit * np.maximum(DEVIATION_OVER_MEDIAN * np.median(np.abs(apart[begin]), axis=0), floor)
    outliers = np.zeros(count, bool)
    for number in range(values.shape[1] * (places.ndim - 1)):  # of fields
        _, group, sizes = np.unique(values[:, number], return_inverse=True, return_counts=True)
        outliers |= ((sizes > 2) & (np.bincount(group, far[:, number]) >= sizes / 2))[group]
    rest = np.flatnonzero(~outliers)
    if len(rest) >= FEWEST_POINTS:
        near = _nearest(places[rest])[:, 1:]
        apart_from_near = np.abs(apart[rest] - np.median(apart[rest][near], axis=1))
        own = np.maximum(DEVIATION_OVER_MEDIAN * np.median(apart_from_near, axis=0), floor)
        outliers[rest[(far[rest] & (apart_from_near > limit * own)).any(axis=1)]] = True
    return ~outliers


def _nearest(places: np.ndarray) -> np.ndarray:
    """Numbers of the nearest places of each, itself first; loads of curves are counted."""
    one = places.ndim == 1
    at = np.argsort(np.argsort(places, kind="stable"))[:, None] if one else places
    return KDTree(at).query(at, k=min(len(at), 5 if one else 9))[1]


def correlation_excess(residual: np.ndarray, places: np.ndarray) -> float:
    """Return the correlation of neighbours less its limit by chance; above 0 residuals are not random."""
    if len(places) < FEWEST_POINTS or not residual.any():
        return -1.0
    if places.ndim == 1:
        order = np.argsort(places, kind="stable")
        pairs = np.stack([order[:-1], order[1:]])
    else:
        near = _nearest(places)[:, :5]
        pairs = np.unique(np.sort([np.repeat(near[:, 0], 4), near[:, 1:].ravel()], axis=0), axis=1)
    found = (residual[pairs[0]] * residual[pairs[1]]).mean() / (residual**2).mean()
    return float(found - CORRELATION_DEVIATIONS / np.sqrt(pairs.shape[1] * residual.shape[1]))
