"""Deformation error against mesh size, one panel a beam, one line a definition."""

import numpy as np

from ...output import style
from ...output.names import SIZE, selections


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
    others = [dimension for dimension in root.status.dims if dimension not in SIZE]
    present = (root.status != 0).any(others).stack(cell=SIZE)
    cells = [dict(zip(SIZE, cell)) for cell in present.cell.values[present.values]]
    chosen = selections("size", SIZE, cells)
    for stem, selection in chosen.items():
        _draw(root.sel(selection), selection, folder, stem)
    return list(chosen)


def _draw(root, selection, folder, stem):
    beams = [beam for beam in root.beam.values if (root.status.sel(beam=beam) != 0).any()]
    arguments = {"ncols": len(beams), "sharey": True, "squeeze": False, "figsize": (1.2 + 2.2 * len(beams), 3.2)}
    with style.figure(folder, stem, **arguments) as (drawn, axes):
        for panel, beam in zip(axes[0], beams):
            here = root.sel(beam=beam)
            sizes = 1e3 * here.mesh_size.values
            for number, definition in enumerate(here.definition.values):
                error = 100 * here.deformation_error.sel(definition=definition).values
                if np.isfinite(error).any():
                    panel.plot(sizes, error, label=definition, **style.line(number))
            printed = 100 * (here.paper_displacement / here.paper_reference_displacement - 1).values
            if here.force < 0:  # printed without sign
                printed = -printed
            if np.isfinite(printed).any():
                panel.plot(sizes, printed, "x", color="0.45", markersize=6, label="as printed")
            panel.axhline(0, color="0.3", linewidth=0.8)
            panel.set_xscale("log")
            panel.set_xticks(sizes, [f"{size:g}" for size in sizes])
            panel.minorticks_off()
            panel.set_xlim(sizes.min() / 1.2, sizes.max() * 1.2)
            panel.set(title=f"{beam} mm", xlabel="Mesh size [mm]")
        axes[0, 0].set_ylabel("Deformation error [%]")
        handles, labels = axes[0, 0].get_legend_handles_labels()
        title = f"{selection['mesh_type']}, {selection['material']}, {selection['load']}"
        drawn.suptitle(title, x=0.01, y=0.985, ha="left")
        drawn.legend(handles, labels, loc="lower center", ncols=len(labels))
        width, height = drawn.get_size_inches()
        drawn.subplots_adjust(left=0.62 / width, right=1 - 0.1 / width, bottom=0.78 / height, top=1 - 0.55 / height)
        drawn.subplots_adjust(wspace=0.1)
