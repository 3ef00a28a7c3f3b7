"""Samples, gathered in the groups ``/samples``, ``/effects`` and ``/sobol``."""

from types import SimpleNamespace

import numpy as np

from springtune.problem.compare import deformation_error
from springtune.problem.loads import LOADS
from springtune.problem.status import Status
from springtune.reference.limits import beyond_linear
from springtune.reference.similarity import unit_scales
from springtune.springs import DEFINITIONS
from springtune.springs.lattice import COEFFICIENT

from ...output.dataset import Group
from ...runs import store
from ..scenes import stored_interpolant
from . import plan
from .designs import roles
from .indices import LEVEL, RESAMPLES, main_effect, sobol_indices
from .interpolate import problem_key
from .names import DROP, MOST_SOLVED, PARAMETERS, QUANTITIES, SOBOL_INDICES, blocks
from .solve import DRAWN

BODY = ("sample",)
SAMPLED_REFERENCE = ("sample", "load")
SAMPLED = ("sample", "load", "definition")

SAMPLES = Group(
    "/samples",
    {
        "displacement": (SAMPLED, "m", "displacement of the loaded side, network", np.nan),
        "deformation_error": (SAMPLED, "1", "(network - reference) / |reference|, signed", np.nan),
        "stiffness": (SAMPLED, "N/m", "stiffness of all springs, where they have one", np.nan),
        "status": (SAMPLED, "1", "what became of the scene", 0),
        "message": (SAMPLED, "1", "why the scene is not solved", ""),
        "reference_displacement": (SAMPLED_REFERENCE, "m", "displacement of the loaded side, finite elements", np.nan),
        "reference_error_estimate": (
            SAMPLED_REFERENCE,
            "1",
            "bound on the relative error of the reference, that of its interpolation included",
            np.nan,
        ),
        "reference_applies": (
            SAMPLED_REFERENCE,
            "1",
            "whether a reference of small strain applies to the network: not where it turns or strains too far for it",
            np.int8(0),
        ),
        "reference_message": (("load",), "1", "why there is no reference", ""),
        "best_stiffness": (SAMPLED_REFERENCE, "N/m", "uniform stiffness without a deformation error", np.nan),
        "particles": (BODY, "1", "number of particles", 0),
    },
    dimensions={"sample": "row of the design"},
    further={"reference_applies": {"flag_values": np.array([0, 1], "int8"), "flag_meanings": "no yes"}},
)

EFFECT = ("quantity", "parameter", "bin", "load", "definition")

EFFECTS = Group(
    "/effects",
    {
        "parameter_value": (("parameter", "bin"), "1", "mean of the parameter in the bin, in its SI unit", np.nan),
        "main_effect": (EFFECT, "1", "mean of the quantity in the bin, in its SI unit", np.nan),
        "main_effect_error": (EFFECT, "1", "standard error of the mean, in its SI unit", np.nan),
    },
    dimensions={
        "quantity": "what is looked at",
        "parameter": "parameter that varies",
        "bin": "part of the parameter's distribution, each of the same probability",
    },
)

INDEX = ("quantity", "parameter", "load", "definition")

SOBOL = Group(
    "/sobol",
    {
        "first_order": (INDEX, "1", "first-order Sobol index: share of the variance by the parameter alone", np.nan),
        "first_order_low": (INDEX, "1", "lower end of its bootstrap band", np.nan),
        "first_order_high": (INDEX, "1", "upper end of its bootstrap band", np.nan),
        "total_order": (INDEX, "1", "total-order Sobol index: share that the parameter takes part in", np.nan),
        "total_order_low": (INDEX, "1", "lower end of its bootstrap band", np.nan),
        "total_order_high": (INDEX, "1", "upper end of its bootstrap band", np.nan),
        "base_samples": (("quantity", "load", "definition"), "1", "base samples that the indices are of", 0),
        "base_samples_without": (
            ("quantity", "load", "definition"),
            "1",
            "base samples with a scene that has no value",
            0,
        ),
    },
    dimensions={"quantity": "what is looked at", "parameter": "parameter that varies"},
)

MOST_BINS, BIN_POINTS = 16, 16
"""Most parts of a parameter's distribution whose means are its main effect, and fewest points of each."""


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    sample = study.parts["samples"]
    if sample.blocks:  # indices and effects are of all rows
        return {}
    drawn, results = _stored(sample, folder / "samples")
    axes = study.axes | {"sample": tuple(range(sample.rows))}
    data = SAMPLES.empty(axes)
    # A network without a mesh has none; that of another definition, solved within other limits, may have one.
    data["particles"].values[:] = np.max([found["particles"] for found in results.values()], axis=0)
    scenes = _Scenes(sample, study.axes, drawn, data)
    scenes.solved(results)
    scenes.referred(folder / "samples")
    if sample.best_stiffness:
        scenes.fitted(results)
    data = _with_coordinates(data, sample, drawn, study.axes)
    found = {SAMPLES.name: data}
    axes |= {"parameter": sample.varied, "quantity": _quantities(sample), "bin": _bins(sample)}
    found[EFFECTS.name] = _effects(sample, data, drawn, axes)
    if sample.design == SOBOL_INDICES:
        found[SOBOL.name] = _indices(sample, data, axes)
    return found


def _stored(sample, folder):
    """Parameters of all rows, and results by key: displacement, status, particles and messages by row."""
    keys = {plan.result_key(sample, load, name) for load in sample.loads for name in plan.definitions(sample)}
    fields = [*PARAMETERS, "particles", "displacement", "status"]
    parts, messages, before = {DRAWN: []} | {key: [] for key in keys}, {key: {} for key in keys}, 0
    for ends in blocks(sample.design, sample.size):
        block = plan.block_key(sample, *ends)
        read = store.read(folder / f"{block}.h5", [DRAWN, *sorted(keys)], fields)
        for key, part in parts.items():
            part.append(read[key])
            if key != DRAWN:
                messages[key] |= {before + int(row): text for row, text in read[key]["messages"].items()}
        before += len(read[DRAWN]["length"])

    def joined(key, names):
        return {name: np.concatenate([part[name] for part in parts[key]]) for name in names}

    drawn = joined(DRAWN, dict.fromkeys([*sample.parameters, "mesh_size"]))
    arrays = ("displacement", "status", "particles")
    return drawn, {key: joined(key, arrays) | {"messages": messages[key]} for key in keys}


class _Scenes:
    """Fills the group ``/samples``."""

    def __init__(self, sample, axes, drawn, data):
        self.sample, self.drawn = sample, drawn
        self.of = {name: array.values for name, array in data.items()}
        self.loads = {load: axes["load"].index(load) for load in sample.loads}
        self.definitions = {name: axes["definition"].index(name) for name in sample.definitions}
        self.forces = {load: LOADS[load].sign * drawn["force"] for load in sample.loads}

    def solved(self, results):
        """Put what networks answered."""
        membrane = self.drawn["young_modulus"] * self.drawn["thickness"]
        for load, i in self.loads.items():
            # With linear kinematics results are for a force of one sign.
            sign = LOADS[load].sign if self.sample.kinematics == "linear" else 1.0
            for name, j in self.definitions.items():
                found = results[plan.result_key(self.sample, load, name)]
                there = np.isin(found["status"], (Status.SOLVED, Status.LINEAR_ONLY, Status.UNSTABLE))
                self.of["displacement"][:, i, j] = np.where(there, sign * found["displacement"], np.nan)
                self.of["status"][:, i, j] = found["status"]
                for row, text in found["messages"].items():
                    self.of["message"][row, i, j] = text
                if DEFINITIONS[name].uniform:
                    self.of["stiffness"][:, i, j] = _uniform_ratio(name) * membrane

    def referred(self, folder):
        """Put references, and errors."""
        body = SimpleNamespace(**self.drawn)
        aspects = self.drawn["length"] / self.drawn["height"]
        for load, i in self.loads.items():
            kind = LOADS[load].kind
            answers, self.of["reference_message"][i] = self._answers(folder, kind, aspects)
            length, scale = unit_scales(body, body, kind)
            self.of["reference_displacement"][:, i] = self.forces[load] * scale * answers.displacement
            self.of["reference_error_estimate"][:, i] = answers.error_estimate
            if self.sample.kinematics == "linear":
                self.of["reference_applies"][:, i] = np.isfinite(answers.displacement)
                continue
            per_force = np.abs(self.forces[load]) * scale / length
            pairs = zip((per_force * answers.rotation).tolist(), (per_force * answers.strain).tolist())
            self.of["reference_applies"][:, i] = [
                np.isfinite(pair).all() and not beyond_linear(*pair) for pair in pairs
            ]
        wanted = self.of["reference_displacement"][:, :, None]
        self.of["deformation_error"][:] = deformation_error(self.of["displacement"], wanted)

    def _answers(self, folder, kind, aspects):
        """Answers of the unit problem of each row, and why there are none of some."""
        key, ratios = plan.reference_key(self.sample, kind), self.drawn["poisson_ratio"]
        interpolant, alone, _, why = stored_interpolant.read(folder, key)
        if interpolant:
            return interpolant.evaluate(aspects, ratios), ""
        if self.sample.rows > MOST_SOLVED:
            why += f"; up to {MOST_SOLVED} points they would be solved one by one"
        rows = [alone.get(problem_key(key, *pair), {"message": why}) for pair in zip(aspects, ratios)]
        names = stored_interpolant.ANSWERS
        answers = SimpleNamespace(**{name: np.array([row.get(name, np.nan) for row in rows]) for name in names})
        reasons = [row["message"] for row in rows if row["message"]]
        return answers, f"{len(reasons)} of {len(rows)} points: {reasons[0]}" if reasons else ""

    def fitted(self, results):
        """Put the uniform stiffness without an error: that of the uniform network times how much it is too soft."""
        for load, i in self.loads.items():
            found = results[plan.result_key(self.sample, load, plan.UNIFORM)]
            membrane = self.drawn["young_modulus"] * self.drawn["thickness"]
            solved = np.where(found["status"] == Status.SOLVED, LOADS[load].sign * found["displacement"], np.nan)
            softer = solved / self.of["reference_displacement"][:, i]
            self.of["best_stiffness"][:, i] = COEFFICIENT * membrane * softer


def _uniform_ratio(name):
    """Stiffness of all springs of a uniform definition over E t."""
    return COEFFICIENT if name == plan.UNIFORM else np.nan


def _with_coordinates(data, sample, drawn, dimensions):
    """The group with the parameters of each row as coordinates."""
    attributes = {"units": "1"}
    coordinates = {
        # A coordinate must not have the name of a dimension that it does not run along, here or in the root.
        f"sample_{name}" if name in dimensions else name: (
            "sample",
            drawn[name],
            {"long_name": PARAMETERS[name][1], "units": PARAMETERS[name][2]},
        )
        for name in dict.fromkeys([*sample.parameters, "mesh_size"])
    }
    told = roles(sample.design, list(sample.varied))
    each = len(told)
    base = np.repeat(np.arange(sample.size, dtype=np.int32), each)
    coordinates["base"] = ("sample", base, attributes | {"long_name": "base sample that the row belongs to"})
    if each > 1:
        flags = np.arange(each, dtype="int8")
        meaning = {"flag_values": flags, "flag_meanings": " ".join(told)}
        meaning["long_name"] = "part of the base sample: A, B, or A with one parameter of B"
        coordinates["role"] = ("sample", np.tile(flags, sample.size), attributes | meaning)
    data = data.assign_coords(coordinates)
    data.attrs = {
        "design": sample.design,
        "size": sample.size,
        "seed": sample.seed,
        "mesh_type": sample.mesh_type,
        "kinematics": sample.kinematics,
        "failures": _policy(sample),
        "varied": " ".join(sample.varied),
    }
    return data


def _policy(sample):
    if sample.design != SOBOL_INDICES:
        return "scenes without a value are left out of main effects"
    what = "the whole base sample is left out" if sample.failures == DROP else "there are no indices"
    return f"where a scene has no value {what}; base_samples_without counts them"


def _quantities(sample):
    return tuple(name for name in QUANTITIES if name != "best_stiffness" or sample.best_stiffness)


def _values(sample, data, quantity, load, definition):
    """Values of a quantity by row, for a load and a definition; what is not solved stably has none."""
    values = data[quantity].sel(load=load)
    if quantity == "best_stiffness":
        return values.values
    here = data.status.sel(load=load, definition=definition).values
    return np.where(here == Status.SOLVED, values.sel(definition=definition).values, np.nan)


def _bins(sample):
    points = sample.size * min(2, sample.rows // sample.size)
    return tuple(range(min(MOST_BINS, max(4, points // BIN_POINTS))))


def _effects(sample, data, drawn, axes):
    """Means over each parameter alone, of rows that are independent of each other."""
    effects = EFFECTS.empty(axes)
    each = sample.rows // sample.size
    alone = np.flatnonzero(np.arange(sample.rows) % each < 2)  # A and B
    for p, parameter in enumerate(sample.varied):
        at = drawn[parameter][alone]
        effects["parameter_value"].values[p] = main_effect(at, at, len(axes["bin"]))[0]
        for q, quantity in enumerate(axes["quantity"]):
            for load, i in ((load, axes["load"].index(load)) for load in sample.loads):
                for name, j in ((name, axes["definition"].index(name)) for name in sample.definitions):
                    values = _values(sample, data, quantity, load, name)[alone]
                    _, mean, error = main_effect(at, values, len(axes["bin"]))
                    effects["main_effect"].values[q, p, :, i, j] = mean
                    effects["main_effect_error"].values[q, p, :, i, j] = error
    return effects


def _indices(sample, data, axes):
    """Sobol indices of each quantity, load and definition."""
    found = SOBOL.empty(axes)
    found.attrs = {
        "estimators": "first order: Saltelli et al. 2010; total order: Jansen 1999",
        "bands": f"between percentiles of {RESAMPLES} bootstrap samples, {100 * LEVEL:g} %",
        "failures": _policy(sample),
    }
    for q, quantity in enumerate(axes["quantity"]):
        for load, i in ((load, axes["load"].index(load)) for load in sample.loads):
            for name, j in ((name, axes["definition"].index(name)) for name in sample.definitions):
                rows = _values(sample, data, quantity, load, name).reshape(sample.size, -1).T
                there = np.isfinite(rows).all(axis=0)
                lacking = int((~there).sum())
                found["base_samples_without"].values[q, i, j] = lacking
                if lacking and sample.failures != DROP:
                    continue
                kept = rows[:, there]
                # What varies by less than references are known to is no error of the networks.
                known = data.reference_error_estimate.values[:, i]
                least = float(np.nanmax(known, initial=0.0)) if quantity == "deformation_error" else 0.0
                indices = sobol_indices(kept[0], kept[1], kept[2:], least)
                found["base_samples"].values[q, i, j] = indices.rows
                for order in ("first", "total"):
                    band = getattr(indices, f"{order}_band")
                    for name_, values in (("", getattr(indices, order)), ("_low", band[0]), ("_high", band[1])):
                        found[f"{order}_order{name_}"].values[q, :, i, j] = values
    return found
