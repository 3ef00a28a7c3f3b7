"""Samples, gathered in the groups ``/samples`` and ``/sobol``."""

from dataclasses import replace
from itertools import chain, product
from types import SimpleNamespace

import numpy as np
import pandas as pd

from springtune.problem.compare import deformation_error
from springtune.problem.loads import LOADS
from springtune.problem.quantities import Status
from springtune.reference.answers import unit_scales
from springtune.springs.lattice import COEFFICIENT

from ...config.model import declared
from ...output.dataset import Group
from ...runs import store
from ..bodies import any_reference
from . import PARAMETERS, SOBOL_INDICES, blocks, problem_key, roles
from .kind import MOST_SOLVED_ROWS, UNIFORM_DEFINITION, block_key, reference_key, result_key
from .solve import DRAWN_KEY

SAMPLES = Group("/samples", **declared(__file__, "/samples"), flags={"reference_applies": ("no", "yes")})
SOBOL = Group("/sobol", **declared(__file__, "/sobol"))

QUANTITIES = "displacement", "deformation_error", "best_stiffness"  # quantities with Sobol indices

ORDERS, ENDS = ("first", "total"), ("", "_low", "_high")
"""Orders of Sobol indices, and the ends of their bootstrap bands."""


def groups(study, folder):
    """Build the groups of a dataset."""
    sample = study.parts["samples"]
    drawn, results = _read_results(sample, folder / "samples")
    axes = study.axes | {"sample": tuple(range(sample.rows)), "parameter": sample.varied, "quantity": QUANTITIES}
    # Without a mesh, as beyond limits, a network has no particles; other definitions may have a mesh.
    particles = np.max([results[key]["particles"] for key in results if key != DRAWN_KEY], axis=0)
    group, places = _coordinates(sample, drawn, study.axes)
    frames = [pd.DataFrame(places | {"sample": axes["sample"], "particles": particles})]
    frames += chain.from_iterable(_load_rows(load, sample, drawn, results, folder / "samples") for load in sample.load)
    data = group.of_rows(axes, pd.concat(frames)).set_coords([*places])
    data.attrs = {name: getattr(sample, name) for name in ("design", "size", "seed", "mesh_type")}
    data.attrs |= {"kinematics": "linear", "varied": " ".join(sample.varied)}
    found = {SAMPLES.name: data}
    if sample.design == SOBOL_INDICES:
        found[SOBOL.name] = SOBOL.of_rows(axes, pd.concat(_indices(sample, data))).assign_attrs(SOBOL_ATTRIBUTES)
    return found


def _read_results(sample, folder):
    """Read the parameters of all rows, and displacement, status, particles and message of each row by result key."""
    keys = sorted({result_key(sample, load, name) for load in sample.load for name in sample.solved})
    names = [*dict.fromkeys([*sample.drawn, "mesh_size"])]
    paths = [folder / f"{block_key(sample, *ends)}.h5" for ends in blocks(sample.design, sample.size)]
    read = [store.read(path, [DRAWN_KEY, *keys], [*names, "displacement", "status", "particles"]) for path in paths]
    found = {key: pd.concat([_frame(one[key]) for one in read], ignore_index=True) for key in (DRAWN_KEY, *keys)}
    return {name: found[DRAWN_KEY][name].values for name in names}, found


def _frame(found):
    frame = pd.DataFrame({name: values for name, values in found.items() if name != "messages"})
    return frame.assign(message=[found.get("messages", {}).get(str(row), "") for row in frame.index])


def _load_rows(load, sample, drawn, results, folder):
    """Yield references, networks, errors and the best uniform stiffness of a load."""
    kind, sign = LOADS[load].kind, LOADS[load].sign
    body, softness = SimpleNamespace(**drawn), COEFFICIENT * (drawn["young_modulus"] * drawn["thickness"])
    body.in_plane = body  # sheets of samples are in plane stress
    answers, why = _unit_references(sample, drawn, folder, kind, drawn["length"] / drawn["height"])
    _, scale = unit_scales(body, body, kind)
    reference = sign * drawn["force"] * scale * answers.displacement
    uniform = results[result_key(sample, load, UNIFORM_DEFINITION)]
    solved = np.where(uniform["status"] == Status.SOLVED, sign * uniform["displacement"], np.nan)
    values = {
        "reference_displacement": reference,
        "reference_error_estimate": answers.error_estimate,
        "reference_applies": np.isfinite(answers.displacement),
        "reference_message": why,
        "best_stiffness": softness * (solved / reference),
    }
    rows = {"sample": range(sample.rows), "load": load}
    yield pd.DataFrame(rows | values)
    for name in sample.definition:
        found = results[result_key(sample, load, name)]
        there = np.isin(found["status"], (Status.SOLVED, Status.LINEAR_ONLY, Status.UNSTABLE))
        displacement = np.where(there, sign * found["displacement"], np.nan)
        values = {"displacement": displacement, "deformation_error": deformation_error(displacement, reference)}
        values |= {"status": found["status"], "stiffness": softness if name == UNIFORM_DEFINITION else np.nan}
        yield pd.DataFrame(rows | {"definition": name, "message": found["message"]} | values)


def _unit_references(sample, drawn, folder, kind, aspects):
    """Return the unit reference of each row, and why some are missing."""
    key, ratios = reference_key(sample, kind), drawn["poisson_ratio"]
    interpolant, alone, _, why = any_reference.read_interpolant(folder, key)
    if interpolant:
        return interpolant.evaluate(aspects, ratios), ""
    if sample.rows > MOST_SOLVED_ROWS:
        why += f"; up to {MOST_SOLVED_ROWS} points they would be solved one by one"
    rows = [alone.get(problem_key(key, *pair), {"message": why}) for pair in zip(aspects, ratios)]
    names = any_reference.ANSWERS
    answers = SimpleNamespace(**{name: np.array([row.get(name, np.nan) for row in rows]) for name in names})
    reasons = [row["message"] for row in rows if row["message"]]
    return answers, f"{len(reasons)} of {len(rows)} points: {reasons[0]}" if reasons else ""


def _coordinates(sample, drawn, dimensions):
    """Return the group with coordinates of each row, and their values: parameters, base sample and role."""
    parts, further, places = roles(sample.design, sample.varied), {}, {}
    for name, values in drawn.items():
        # A coordinate must not have the name of a dimension that it does not run along, here or in the root.
        own = f"sample_{name}" if name in dimensions else name
        further[own], places[own] = (("sample",), PARAMETERS[name][2], PARAMETERS[name][1], np.nan), values
    further["base"] = ("sample",), "1", "base sample that the row belongs to", np.int32(0)
    places["base"] = np.repeat(range(sample.size), sample.each)
    if len(parts) > 1:
        further["role"] = ("sample",), "1", "part of the base sample: A, B, or A with one parameter of B", 0
        places["role"] = np.tile(range(len(parts)), sample.size)
    return replace(SAMPLES, variables=SAMPLES.variables | further, flags=SAMPLES.flags | {"role": tuple(parts)}), places


def _indices(sample, data):
    for quantity, load, name in product(QUANTITIES, sample.load, sample.definition):
        labels = {"quantity": quantity, "load": load, "definition": name}
        one = data[[quantity, "status"]].sel(load=load, definition=name)
        if quantity != "best_stiffness":
            one = one.where(one.status == Status.SOLVED)
        rows = one[quantity].values.reshape(sample.size, -1).T
        there = np.isfinite(rows).all(axis=0)
        kept = rows[:, there]
        # A variation below the reference's own error is no variation of the networks' errors.
        known = data.reference_error_estimate.sel(load=load).values
        least = float(np.nanmax(known, initial=0.0)) if quantity == "deformation_error" else 0.0
        yield pd.DataFrame([labels | {"base_samples": there.sum(), "base_samples_without": (~there).sum()}])
        yield pd.DataFrame(labels | {"parameter": sample.varied} | sobol_indices(kept[0], kept[1], kept[2:], least))


BOOTSTRAP_SAMPLES = 1000

BAND_LEVEL = 0.95  # share of bootstrap samples within a band

NEGLIGIBLE_DEVIATION = 1e-12  # smallest standard deviation over the largest value that is more than rounding


SOBOL_ATTRIBUTES = {
    "estimators": "first order: Saltelli et al. 2010; total order: Jansen 1999",
    "bands": f"between percentiles of {BOOTSTRAP_SAMPLES} bootstrap samples, {100 * BAND_LEVEL:g} %",
    "failures": "where a scene has no value the whole base sample is left out; base_samples_without counts them",
}
"""Attributes of the group."""


def sobol_indices(at_a: np.ndarray, at_b: np.ndarray, at_ab: np.ndarray, least: float = 0.0) -> dict[str, np.ndarray]:
    r"""Return Sobol indices and their bands, from values at the rows of Saltelli's design; NaN without variation.

    `at_a` and `at_b` are (n,), `at_ab` (n_parameters, n). With the variance V of A and B together, first-order indices
    are :math:`\overline{f_B (f_{AB} - f_A)} / V`, total ones :math:`\tfrac12 \overline{(f_A - f_{AB})^2} / V`: table 2,
    (b) and (f), of Saltelli et al., Comput. Phys. Commun. 181:259 (2010). Bands are percentiles of bootstrap samples of
    base samples. A standard deviation up to `least` is no variation. scipy's ``sobol_indices`` takes only powers of
    two, and its bootstrap has no seed.
    """
    count, rows = at_ab.shape
    both = np.concatenate([at_a, at_b])
    largest = np.abs(both).max(initial=0.0)
    if rows < 2 or not largest > 0 or not np.std(both / largest) > max(NEGLIGIBLE_DEVIATION, least / largest):
        return {f"{order}_order{end}": np.full(count, np.nan) for order in ORDERS for end in ENDS}
    # Standardized: else sums would lose digits, and squares might overflow.
    mean, size = (both / largest).mean(), (both / largest).std()
    at_a, at_b, at_ab = ((values / largest - mean) / size for values in (at_a, at_b, at_ab))
    # Terms of each base sample whose means are taken: 2 n_parameters for the indices, two for the variance.
    terms = np.concatenate([at_b * (at_ab - at_a), 0.5 * (at_a - at_ab) ** 2, [(at_a + at_b) / 2],
                            [(at_a**2 + at_b**2) / 2]])  # fmt: skip
    random = np.random.default_rng(0)
    counts = (np.bincount(random.integers(rows, size=rows), minlength=rows) for _ in range(BOOTSTRAP_SAMPLES))
    means = np.array([terms.mean(axis=1), *(terms @ count / rows for count in counts)])
    found = means[:, : 2 * count] / (means[:, -1] - means[:, -2] ** 2)[:, None]
    values = found[0], *np.quantile(found[1:], [(1 - BAND_LEVEL) / 2, (1 + BAND_LEVEL) / 2], axis=0)
    halves = zip(ORDERS, (slice(count), slice(count, None)))
    return {f"{order}_order{end}": one[half] for order, half in halves for end, one in zip(ENDS, values)}
