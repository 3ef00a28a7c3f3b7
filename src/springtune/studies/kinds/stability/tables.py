"""The page of the experiments on stability: tables and rules of thumb, every number from the dataset."""

import numpy as np
import xarray as xr

from springtune.safe_io.escapes import markdown

from ...output import tables
from ...output.dataset import STATUS
from ...output.tables import numbers
from ...output.text import markdown_section

STABILITY_HEADS = tables.LABEL_HEADS | {
    "scale": tables.LABEL_HEADS["mesh_size"],
    "cg_iterations": ("iterations", lambda count: str(count or "direct")),
    "stiffness_contrast": ("contrast", "{:.0e}".format),
}


def page(tree: xr.DataTree) -> str:
    """Markdown of the experiments that a dataset has."""
    data = tree["stability"].to_dataset()
    sections = (_limits, _drift, _rest, _contrast, _poisson, _sizes, _strains, _perturbation, _slivers, _buckling)
    done = [section for section in sections if section.__name__[1:] in data.experiment.values]
    return "\n".join(line for section in done for line in (*section(data), ""))


def _table(rows, columns, title, *said):
    return markdown_section(title, *said) + tables.markdown(rows, columns, STABILITY_HEADS)


def _limits(data):
    ratio, limit = data.dt_limit_measured / data.dt_limit_predicted, data.dt_limit_predicted.sel(damper="mass")
    undamped = limit.sel(integrator="central-difference", damping_ratio=0.0, drop=True)
    lagged = limit.sel(integrator="central-difference-lagged").isel(damping_ratio=slice(1, None)) / undamped
    columns = {
        "2/ω_max [ns]": numbers(1e9 * undamped),
        "bound from particles [ns]": numbers(1e9 * data.dt_particle_bound),
        "damping {:g} that lags: times": numbers(lagged),
    }
    said = (
        f"Over {int(ratio.count())} cases (explicit schemes, dampings, definitions, sizes) the measured limit is "
        f"within {100 * float(abs(ratio - 1).max()):.2f} % of the predicted one."
    )
    return _table(["definition", "mesh_size"], columns, "Largest step", said)


def _drift(data):
    names = {
        "drift of energy": "energy_drift",
        "swing of energy": "energy_swing",
        "drift of momentum": "momentum_drift",
    }
    columns = {head: numbers(data[name], ".2g") for head, name in names.items()}
    return _table(["integrator"], columns, "Energy and momentum, no damping, half of the limit")


def _rest(data):
    ratios, steps = data.critical_ratio.values, data.steps_to_rest.values
    said = (
        f"Quickest at {ratios[int(np.nanargmin(steps))]:g} of the critical damping, {np.nanmin(steps):.0f} steps; "
        f"{steps[0]:.0f} at {ratios[0]:g}, {steps[-1]:.0f} at {ratios[-1]:g}."
    )
    columns = {"{} steps": numbers(data.truncated_error, ".2g")}
    distances = "Distance of backward Euler from the static solution, by iterations of its linear solver:"
    return _table(["mesh_size", "cg_iterations"], columns, "To rest", said, distances)


def _contrast(data):
    columns = {"status": xr.apply_ufunc(lambda flag: STATUS[flag], data.contrast_status, vectorize=True)}
    columns |= {"error": numbers(data.contrast_error, ".2g"), "estimated": numbers(data.contrast_estimate, ".2g")}
    return _table(["stiffness_contrast"], columns, "Stiff parts beside soft ones")


def _poisson(data):
    columns = {"{:g}": numbers(1e9 * data.poisson_step_limit)}
    return _table(["definition"], columns, "Largest step [ns] over Poisson's ratio")


def _sizes(data):
    columns = {"step over mesh size [s/m]": numbers(data.scaled_step_limit)}
    columns |= {"error, {}": numbers(data.precision_error, ".2g")}
    return _table(["scale"], columns, "Scale and precision")


def _strains(data):
    def text(flag, pivots, share, message):
        note = " (flutter)" if "flutter" in message.lower() else ""
        note = f" ({pivots:.0f})" if pivots > 0 else f" ({100 * share:.0f} %)" if share < 1 else note
        return "" if np.isnan(share) else STATUS[flag].replace("_", " ") + note

    found = (data[f"{name}"] for name in ("strain_status", "negative_pivots", "strain_load_share", "strain_message"))
    texts = xr.apply_ufunc(text, *found, vectorize=True, output_dtypes=[object])
    texts = texts.assign_coords(strain=numbers(data.strain, "g", 100, " %"))
    lines = markdown_section(
        "Large loads",
        "Status, in brackets the negative pivots, or flutter, or the share of the load that is reached: beyond it the "
        "path turns back at a limit point where it is unstable, else Newton's method found nothing.",
    )
    for load in data.strain_load.values:
        lines += [f"{load}:", "", *tables.markdown(["definition"], {"{}": texts.sel(strain_load=load)}), ""]
    return lines[:-1]


def _perturbation(data):
    ends = {end: data[f"inverted_starts_{end}"] for end in ("right", "wrong")}
    errors = numbers(data.perturbed_error, "+.2f", 100, " %")
    columns = {"{:g} a": errors.where((errors != "") | ends["right"].isnull(), "hole")}
    columns |= {"inverted starts: right": numbers(ends["right"], ".0f", 100, " %")}
    columns |= {"wrong": numbers(ends["wrong"], ".0f", 100, " %")}
    title = "Displacement with particles moved at random, and Newton's method from inverted starts"
    return _table(["definition"], columns, title)


def _slivers(data):
    columns = {"{:g}°": numbers(data.sliver_step_limit / data.sliver_step_limit.isel(sliver_angle=0, drop=True))}
    return _table(["definition"], columns, "Largest step with a sliver, over that at 30 degrees")


def _buckling(data):
    errors, messages = data.buckling_load / data.euler_load - 1, data.buckling_message
    restricted = messages.where(errors.notnull(), "")
    columns = {"{} rows": numbers(errors, "+.1f", 100, " %") + xr.where(restricted != "", "*", "").astype(object)}
    why = [one for one in dict.fromkeys(restricted.values.ravel()) if one]
    notes = ["", *(f"\\* {markdown(one)}" for one in why)] if why else []
    return _table(["definition"], columns, "Buckling load of a slender column over Euler's") + notes
