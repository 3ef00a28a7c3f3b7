"""The deformed network over the deformed reference, one panel a beam, displacements magnified."""

import math

import numpy as np
from matplotlib.collections import LineCollection

from ...output import style
from ...output.names import DEFORMED, selections

DEFINITION = ("lattice", "calibrated", "paper")
"""Whose network is shown: the first of these that the study has, else its first."""


def draw(tree, folder):
    """Draw one figure for each mesh type, material and load.

    Parameters
    ----------
    tree : xarray.DataTree
    folder : str or Path

    Returns
    -------
    list of str
        Stems of the files written.
    """
    root = tree.to_dataset().sel(kinematics="nonlinear")
    others = [dimension for dimension in root.status.dims if dimension not in DEFORMED]
    present = (root.status != 0).any(others).stack(cell=DEFORMED)
    cells = [dict(zip(DEFORMED, cell)) for cell in present.cell.values[present.values]]
    chosen = selections("deformed", DEFORMED, cells)
    fields = tree["fields"].to_dataset()
    if "nonlinear" in fields.kinematics:
        fields = fields.sel(kinematics="nonlinear")
    names = fields.definition.values.tolist()
    definition = next((name for name in DEFINITION if name in names), names[0])
    for stem, selection in chosen.items():
        _draw(fields.sel(definition=definition), root, selection, definition, folder, stem)
    return list(chosen)


def _draw(fields, root, selection, definition, folder, stem):
    status = root.status.sel(selection)
    beams = [beam for beam in root.beam.values if (status.sel(beam=beam) != 0).any()]
    arguments = {"nrows": len(beams), "squeeze": False, "figsize": (6.0, 0.5 + 1.6 * len(beams))}
    with style.figure(folder, stem, **arguments) as (drawn, axes):
        for panel, beam in zip(axes[:, 0], beams):
            _panel(panel, fields.sel(beam=beam, mesh_type=selection["mesh_type"]), selection, beam)
        drawn.suptitle(
            f"{selection['mesh_type']}, {selection['material']}, {selection['load']}: network ({definition}) "
            f"over reference (grey)",
            x=0.01, y=0.99, ha="left",
        )  # fmt: skip
        height = drawn.get_size_inches()[1]
        drawn.subplots_adjust(left=0.085, right=0.99, bottom=0.42 / height, top=1 - 0.55 / height, hspace=0.75)


def _panel(panel, fields, selection, beam):
    load = {"material": selection["material"], "load": selection["load"]}
    sizes = [size for size in fields.mesh_size.values if np.isfinite(fields.x.sel(mesh_size=size)).any()]
    fields = fields.sel(mesh_size=max(sizes))
    rest = 1e3 * np.stack([fields.x.values, fields.y.values], axis=1)
    moved = 1e3 * np.stack([fields.displacement_x.sel(load).values, fields.displacement_y.sel(load).values], axis=1)
    outline = 1e3 * np.stack([fields.outline_x.values, fields.outline_y.values], axis=1)
    there = 1e3 * np.stack(
        [fields.reference_displacement_x.sel(load).values, fields.reference_displacement_y.sel(load).values], axis=1
    )
    kept = np.isfinite(outline[:, 0])
    outline, there = outline[kept], there[kept]
    scale = _round(0.06 * np.ptp(outline[:, 0]) / np.abs(there).max())
    panel.fill(*(outline + scale * there).T, facecolor="0.82", edgecolor="0.45", linewidth=1.0)
    panel.plot(*np.vstack([outline, outline[:1]]).T, color="0.6", linewidth=0.6, linestyle=(0, (3, 3)))
    known = np.isfinite(fields.spring_first.values)
    ends = np.stack([fields.spring_first.values[known], fields.spring_second.values[known]], axis=1).astype(int)
    if np.isfinite(moved).any():
        panel.add_collection(LineCollection((rest + scale * moved)[ends], colors="#14213d", linewidths=0.5))
    else:
        panel.text(0.5, 0.5, "not solved", transform=panel.transAxes, ha="center", va="center")
    panel.set(aspect="equal", adjustable="datalim", xlabel="x [mm]", ylabel="y [mm]")
    panel.set_title(f"{beam} mm, mesh {1e3 * float(fields.mesh_size):g} mm, displacements x {scale:g}")
    panel.grid(False)


def _round(value):
    """Nearest of 1, 2, 5 times a power of ten below."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)) * power
