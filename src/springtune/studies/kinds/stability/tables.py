"""The page of the experiments on stability: tables and rules of thumb, every number from the dataset."""

from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

from springtune.safe_io.atomic import write_text
from springtune.safe_io.escapes import markdown

from ...output.dataset import STATUS
from ...output.selection import cells, labels_of
from ...output.text import cell_number, markdown_section, markdown_table
from .outputs import PAGE


def write(tree, folder):
    """Write the page in Markdown."""
    write_text(Path(folder) / PAGE, page(tree))
    return [PAGE]


def page(tree: xr.DataTree) -> str:
    """Markdown of the experiments that a dataset has."""
    data = tree["stability"].to_dataset()
    sections = (_limits, _drift, _rest, _contrast, _poisson, _sizes, _strains, _perturbation, _slivers, _buckling)
    done = [section for section in sections if section.__name__[1:] in data.experiment.values]
    return "\n".join(line for section in done for line in (*section(data), ""))


def _by_definition(data, variable, heads, texts):
    """Table of a row a definition that has values of a variable; `texts` are those of its part of the dataset."""
    names = labels_of(data[variable].notnull(), "definition")
    rows = [[f"`{name}`", *texts(data.sel(definition=name))] for name in names]
    return markdown_table(["definition", *heads], rows)


def _limits(data):
    ratio = (data.dt_limit_measured / data.dt_limit_predicted).values
    worst, damped, rows = 100 * np.nanmax(np.abs(ratio - 1)), data.damping_ratio.values[1:], []
    for place in cells(np.isfinite(data.omega_max), ("definition", "mesh_size")):
        cell = data.sel(place).sel(damper="mass")
        undamped = cell.sel(integrator="central-difference", damping_ratio=0.0).dt_limit_predicted
        lagged = cell.sel(integrator="central-difference-lagged", damping_ratio=damped).dt_limit_predicted
        rows.append(
            [
                f"`{place['definition']}`",
                f"{1e3 * place['mesh_size']:g}",
                cell_number(undamped, scale=1e9),
                cell_number(cell.dt_particle_bound, scale=1e9),
                *map(cell_number, lagged.values / float(undamped)),
            ]
        )
    heads = ["definition", "mesh [mm]", "2/ω_max [ns]", "bound from particles [ns]"]
    heads += [f"damping {ratio:g} that lags: times" for ratio in damped]
    said = (
        f"Over {int(np.isfinite(ratio).sum())} cases (explicit schemes, dampings, definitions, sizes) the measured "
        f"limit is within {worst:.2f} % of the predicted one."
    )
    return markdown_section("Largest step", said) + markdown_table(heads, rows)


def _drift(data):
    kinds = ("energy_drift", "energy_swing", "momentum_drift")
    rows = [
        [f"`{name}`", *(cell_number(data[kind].sel(integrator=name), ".2g") for kind in kinds)]
        for name in data.integrator.values
    ]
    heads = ["integrator", "drift of energy", "swing of energy", "drift of momentum"]
    return markdown_section("Energy and momentum, no damping, half of the limit") + markdown_table(heads, rows)


def _rest(data):
    ratios, steps = data.critical_ratio.values, data.steps_to_rest.values
    said = (
        f"Quickest at {ratios[int(np.nanargmin(steps))]:g} of the critical damping, {np.nanmin(steps):.0f} steps; "
        f"{steps[0]:.0f} at {ratios[0]:g}, {steps[-1]:.0f} at {ratios[-1]:g}."
    )
    rows = []
    for size in labels_of(data.truncated_error.notnull(), "mesh_size"):
        for count in data.cg_iterations.values:
            errors = data.truncated_error.sel(mesh_size=size, cg_iterations=count).values
            solver = str(count) if count else "direct"
            rows.append([f"{1e3 * size:g} mm", solver, *(cell_number(error, ".2g") for error in errors)])
    heads = ["mesh", "iterations", *(f"{n} steps" for n in data.implicit_steps.values)]
    distances = "Distance of backward Euler from the static solution, by iterations of its linear solver:"
    return markdown_section("To rest", said, distances) + markdown_table(heads, rows)


def _contrast(data):
    rows = []
    for contrast in data.stiffness_contrast.values:
        cell = data.sel(stiffness_contrast=contrast)
        errors = (cell_number(one, ".2g") for one in (cell.contrast_error, cell.contrast_estimate))
        rows.append([f"{contrast:.0e}", STATUS[int(cell.contrast_status)], *errors])
    return markdown_section("Stiff parts beside soft ones") + markdown_table(
        ["contrast", "status", "error", "estimated"], rows
    )


def _poisson(data):
    def texts(cell):
        return (cell_number(limit, scale=1e9) for limit in cell.poisson_step_limit.values)

    heads = [f"{nu:g}" for nu in data.stressed_poisson_ratio.values]
    title = "Largest step [ns] over Poisson's ratio"
    return markdown_section(title) + _by_definition(data, "poisson_step_limit", heads, texts)


def _sizes(data):
    rows = []
    for scale in data["scale"].values:
        cell = data.sel(scale=scale)
        errors = (cell_number(error, ".2g") for error in cell.precision_error.values)
        rows.append([f"{1e3 * scale:g}", cell_number(cell.scaled_step_limit), *errors])
    heads = ["mesh [mm]", "step over mesh size [s/m]", *(f"error, {kind}" for kind in data.precision.values)]
    return markdown_section("Scale and precision") + markdown_table(heads, rows)


def _strains(data):
    lines = markdown_section(
        "Large loads",
        "Status, in brackets the negative pivots, or flutter, or the share of the load that is reached: beyond it the "
        "path turns back at a limit point where it is unstable, else Newton's method found nothing.",
    )
    heads = [cell_number(strain, "g", 100) + " %" for strain in data.strain.values]

    def texts(cell, load):
        cell = cell.sel(strain_load=load)
        found = (cell.strain_status, cell.negative_pivots, cell.strain_load_share, cell.strain_message)
        for flag, pivots, share, message in zip(*(one.values for one in found)):
            note = " (flutter)" if "flutter" in message.lower() else ""
            note = f" ({pivots:.0f})" if pivots > 0 else f" ({100 * share:.0f} %)" if share < 1 else note
            yield STATUS[int(flag)].replace("_", " ") + note

    for load in data.strain_load.values:
        of_load = partial(texts, load=load)
        lines += [f"{load}:", "", *_by_definition(data, "strain_load_share", heads, of_load), ""]
    return lines[:-1]


def _perturbation(data):
    heads = [*(f"{share:g} a" for share in data.perturbation.values), "inverted starts: right", "wrong"]

    def texts(cell):
        yield from (cell_number(error, "+.2f", 100) + " %" if np.isfinite(error) else "hole" for error in
                    cell.perturbed_error.values)  # fmt: skip
        yield from (f"{100 * float(cell[f'inverted_starts_{end}']):.0f} %" for end in ("right", "wrong"))

    title = "Displacement with particles moved at random, and Newton's method from inverted starts"
    return markdown_section(title) + _by_definition(data, "inverted_starts_right", heads, texts)


def _slivers(data):
    def texts(cell):
        return map(cell_number, cell.sliver_step_limit.values / cell.sliver_step_limit.values[0])

    heads = [f"{angle:g}°" for angle in data.sliver_angle.values]
    title = "Largest step with a sliver, over that at 30 degrees"
    return markdown_section(title) + _by_definition(data, "sliver_step_limit", heads, texts)


def _buckling(data):
    data = data.assign(ratio=data.buckling_load / data.euler_load - 1)
    data = data.assign(restricted=(data.buckling_message != "") & data.ratio.notnull())

    def texts(cell):
        marks = np.where(cell.restricted.values, "*", "")
        return [cell_number(ratio, "+.1f", 100) + f" %{mark}" for ratio, mark in zip(cell.ratio.values, marks)]

    heads = [f"{count} rows" for count in data.rows.values]
    why = dict.fromkeys(str(one) for one in data.buckling_message.values[data.restricted.values])
    notes = ["", *(f"\\* {markdown(one)}" for one in why)] if why else []
    title = "Buckling load of a slender column over Euler's"
    return markdown_section(title) + _by_definition(data, "buckling_load", heads, texts) + notes
