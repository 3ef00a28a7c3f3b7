"""The page of the experiments on stability: tables and rules of thumb, every number from the dataset."""

from pathlib import Path

import numpy as np
import xarray as xr

from springtune.safe_io.atomic import write_text
from springtune.safe_io.escapes import markdown

from ...output.dataset import STATUS
from ...output.text import markdown_table
from .outputs import PAGE


def write(tree, folder):
    """Write the page in Markdown."""
    write_text(Path(folder) / PAGE, page(tree))
    return [PAGE]


def page(tree: xr.DataTree) -> str:
    """Markdown of the experiments that a dataset has."""
    data = tree["stability"].to_dataset()
    sections = {
        "limits": _limits,
        "drift": _drift,
        "rest": _rest,
        "contrast": _contrast,
        "poisson": _poisson,
        "sizes": _sizes,
        "strains": _strains,
        "perturbation": _perturbation,
        "slivers": _slivers,
        "buckling": _buckling,
    }
    done = [name for name in sections if name in data.experiment.values]
    parts = [line for name in done for line in (*sections[name](data), "")]
    return "\n".join(parts + _scenes(tree.to_dataset()))


def _definitions(data, name):
    there = data[name].notnull().any([dimension for dimension in data[name].dims if dimension != "definition"])
    return [str(label) for label in data.definition.values[there.values]]


def _number(value, digits=3):
    return "" if np.isnan(float(value)) else f"{float(value):.{digits}g}".replace("-", "−")


def _limits(data):
    ratio = (data.dt_limit_measured / data.dt_limit_predicted).values
    worst = 100 * np.nanmax(np.abs(ratio - 1))
    lines = [
        "### Largest step", "",
        f"Over {int(np.isfinite(ratio).sum())} cases (explicit schemes, dampings, definitions, sizes) the measured "
        f"limit is within {worst:.2f} % of the predicted one.", "",
    ]  # fmt: skip
    rows = []
    for name in _definitions(data, "omega_max"):
        for size in data.mesh_size.values[np.isfinite(data.omega_max.sel(definition=name).values)]:
            cell = data.sel(definition=name, mesh_size=size)
            undamped = cell.sel(integrator="central-difference", damper="mass", damping_ratio=0.0).dt_limit_predicted
            lagged = [
                cell.sel(integrator="central-difference-lagged", damper="mass", damping_ratio=ratio).dt_limit_predicted
                for ratio in data.damping_ratio.values[1:]
            ]
            rows.append(
                [f"`{name}`", f"{1e3 * size:g}", _number(1e9 * undamped), _number(1e9 * cell.dt_particle_bound)]
                + [_number(one / undamped) for one in lagged]
            )
    heads = ["definition", "mesh [mm]", "2/ω_max [ns]", "bound from particles [ns]"]
    heads += [f"damping {ratio:g} that lags: times" for ratio in data.damping_ratio.values[1:]]
    return lines + markdown_table(heads, rows)


def _drift(data):
    rows = [
        [f"`{name}`", *(_number(data[kind].sel(integrator=name), 2)
                        for kind in ("energy_drift", "energy_swing", "momentum_drift"))]
        for name in data.integrator.values
    ]  # fmt: skip
    return ["### Energy and momentum, no damping, half of the limit", ""] + markdown_table(
        ["integrator", "drift of energy", "swing of energy", "drift of momentum"], rows
    )


def _rest(data):
    best = float(data.critical_ratio.values[int(np.nanargmin(data.steps_to_rest.values))])
    slowest = [float(data.steps_to_rest.values[i]) for i in (0, -1)]
    lines = [
        "### To rest", "",
        f"Quickest at {best:g} of the critical damping, {np.nanmin(data.steps_to_rest.values):.0f} steps; "
        f"{slowest[0]:.0f} at {data.critical_ratio.values[0]:g}, {slowest[1]:.0f} at "
        f"{data.critical_ratio.values[-1]:g}.",
        "", "Distance of backward Euler from the static solution, by iterations of its linear solver:", "",
    ]  # fmt: skip
    rows = []
    for size in data.mesh_size.values[data.truncated_error.notnull().any(["cg_iterations", "implicit_steps"]).values]:
        for count in data.cg_iterations.values:
            cells = data.truncated_error.sel(mesh_size=size, cg_iterations=count)
            rows.append(
                [f"{1e3 * size:g} mm", str(count) if count else "direct", *(_number(x, 2) for x in cells.values)]
            )
    return lines + markdown_table(["mesh", "iterations", *(f"{n} steps" for n in data.implicit_steps.values)], rows)


def _contrast(data):
    rows = [
        [f"{contrast:.0e}", STATUS[int(data.contrast_status.sel(stiffness_contrast=contrast))],
         _number(data.contrast_error.sel(stiffness_contrast=contrast), 2),
         _number(data.contrast_estimate.sel(stiffness_contrast=contrast), 2)]
        for contrast in data.stiffness_contrast.values
    ]  # fmt: skip
    return ["### Stiff parts beside soft ones", ""] + markdown_table(["contrast", "status", "error", "estimated"], rows)


def _poisson(data):
    ratios = data.stressed_poisson_ratio.values
    rows = [
        [f"`{name}`", *(_number(1e9 * data.poisson_step_limit.sel(definition=name, stressed_poisson_ratio=nu))
                        for nu in ratios)]
        for name in _definitions(data, "poisson_step_limit")
    ]  # fmt: skip
    return ["### Largest step [ns] over Poisson's ratio", ""] + markdown_table(
        ["definition", *(f"{nu:g}" for nu in ratios)], rows
    )


def _sizes(data):
    rows = [
        [f"{1e3 * scale:g}", _number(data.scaled_step_limit.sel(scale=scale)),
         *(_number(data.precision_error.sel(scale=scale, precision=kind), 2) for kind in data.precision.values)]
        for scale in data["scale"].values
    ]  # fmt: skip
    heads = ["mesh [mm]", "step over mesh size [s/m]", *(f"error, {kind}" for kind in data.precision.values)]
    return ["### Scale and precision", ""] + markdown_table(heads, rows)


def _strains(data):
    lines = [
        "### Large loads",
        "",
        "Status, in brackets the negative pivots, or flutter, or the share of the load that is reached: beyond it the "
        "path turns back at a limit point where it is unstable, else Newton's method found nothing.",
        "",
    ]
    for load in data.strain_load.values:
        rows = []
        for name in _definitions(data, "strain_load_share"):
            cells = data.sel(definition=name, strain_load=load)
            texts = []
            for flag, pivots, share, message in zip(cells.strain_status.values, cells.negative_pivots.values,
                                                    cells.strain_load_share.values,
                                                    cells.strain_message.values):  # fmt: skip
                note = " (flutter)" if "flutter" in message.lower() else ""
                note = f" ({pivots:.0f})" if pivots > 0 else f" ({share:.2f})" if share < 1 else note
                texts.append(STATUS[int(flag)].replace("_", " ") + note)
            rows.append([f"`{name}`", *texts])
        heads = [f"{100 * strain:g} %".replace("-", "−") for strain in data.strain.values]
        lines += [f"{load}:", "", *markdown_table(["definition", *heads], rows), ""]
    return lines[:-1]


def _perturbation(data):
    shares = data.perturbation.values
    rows = [
        [f"`{name}`", *(f"{100 * float(value):+.2f} %".replace("-", "−") if np.isfinite(value) else "hole"
                        for value in data.perturbed_error.sel(definition=name).values),
         f"{100 * float(data.inverted_starts_right.sel(definition=name)):.0f} %",
         f"{100 * float(data.inverted_starts_wrong.sel(definition=name)):.0f} %"]
        for name in _definitions(data, "inverted_starts_right")
    ]  # fmt: skip
    heads = ["definition", *(f"{share:g} a" for share in shares), "inverted starts: right", "wrong"]
    return [
        "### Displacement with particles moved at random, and Newton's method from inverted starts",
        "",
    ] + markdown_table(heads, rows)


def _slivers(data):
    angles = data.sliver_angle.values
    rows = []
    for name in _definitions(data, "sliver_step_limit"):
        cells = data.sel(definition=name)
        limits = cells.sliver_step_limit.values
        rows.append([f"`{name}`", *(_number(limit / limits[0]) for limit in limits)])
    return ["### Largest step with a sliver, over that at 30 degrees", ""] + markdown_table(
        ["definition", *(f"{angle:g}°" for angle in angles)], rows
    )


def _buckling(data):
    ratio = 100 * (data.buckling_load / data.euler_load - 1)
    restricted = (data.buckling_message != "") & ratio.notnull()
    rows = [
        [f"`{name}`", *(f"{value:+.1f} %{'*' if mark else ''}".replace("-", "−") for value, mark in zip(*own))]
        for name in _definitions(data, "buckling_load")
        for own in [(ratio.sel(definition=name).values, restricted.sel(definition=name).values)]
    ]
    heads = ["definition", *(f"{count} rows" for count in data.rows.values)]
    why = dict.fromkeys(str(one) for one in data.buckling_message.values[restricted.values])
    notes = ["", *(f"\\* {markdown(one)}" for one in why)] if why else []
    return ["### Buckling load of a slender column over Euler's", "", *markdown_table(heads, rows), *notes]


def _scenes(root):
    """Static scenes of the study that are not solved, and why; and how many are."""
    flags = root.status.values
    rows = []
    for place in np.argwhere(flags > 1):
        labels = {name: root[name].values[i] for name, i in zip(root.status.dims, place)}
        cell = root.sel(labels)
        labels["mesh_size"] = f"{1e3 * labels['mesh_size']:g} mm"
        rows.append([", ".join(map(str, labels.values())), STATUS[int(cell.status)], markdown(cell.message.item())])
    solved = f"{int((flags == 1).sum())} of {int((flags != 0).sum())} scenes are solved; the others:"
    return (
        ["### Scenes of the study", "", solved, "", *markdown_table(["scene", "status", "message"], rows), ""]
        if rows
        else []
    )
