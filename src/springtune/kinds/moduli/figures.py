"""Definitions compared: effective against asked Poisson's ratio, error against mesh size, and errors by load."""

import numpy as np

from ...output import style
from ...output.dataset import most_asked
from ...output.names import definitions

FAMILIES = (
    ("uniform", "van-gelder", "lattice", "element-fit"),
    ("area", "angular", "delingette", "adjoint"),
    ("baudet", "baudet-corrected", "flechon", "axis-exact"),
)
"""Definitions in the order in which lines take their looks; the others come after."""

FLOOR = 1e-5
"""Smallest error drawn on a logarithmic axis [1]; below is rounding and the reference's own error."""


def draw(tree, folder):
    """Draw all figures.

    Parameters
    ----------
    tree : xarray.DataTree
        With the group ``/moduli``.
    folder : str or Path

    Returns
    -------
    list of str
        Stems of the files written.
    """
    root, moduli = tree.to_dataset(), tree["moduli"].to_dataset()
    chosen = definitions(root["load"].values.tolist(), root.mesh_type.values.tolist())
    for stem, selection in chosen.items():
        if "load" in selection:
            _sizes(root.sel(selection), selection["load"], folder, stem)
        elif "mesh_type" in selection:
            _loads(root.sel(selection), selection["mesh_type"], folder, stem)
        else:
            _moduli(moduli, folder, stem)
    return list(chosen)


def _looks(names):
    """Look of the line of each definition."""
    order = [name for family in FAMILIES for name in family]
    order += [name for name in names if name not in order]
    return {name: style.line(number) for number, name in enumerate(order)}


def _panels(folder, stem, types, height):
    """Figure with one panel a mesh type, at most four in a row, room for a legend under each."""
    columns = min(4, max(1, len(types)))
    rows = max(1, -(-len(types) // columns))
    return style.figure(
        folder,
        stem,
        nrows=rows,
        ncols=columns,
        sharey=True,
        squeeze=False,
        figsize=(0.8 + 2.55 * columns, 0.5 + height * rows),
    )


def _arrange(drawn, axes, types, legend, title):
    """Place panels of `_panels`; `legend` is the room under each [inch]."""
    for panel in axes.flat[len(types) :]:
        panel.set_visible(False)
    width, height = drawn.get_size_inches()
    drawn.suptitle(title, x=0.01, y=1 - 0.08 / height, va="top", ha="left")
    panel = (height - 0.5) / len(axes)
    drawn.subplots_adjust(
        left=0.62 / width, right=1 - 0.1 / width, bottom=legend / height, top=1 - 0.6 / height, wspace=0.06,
        hspace=(legend + 0.2) / (panel - legend - 0.2),
    )  # fmt: skip


def _legend(panel, columns=2):
    panel.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.24),
        fontsize=5.4,
        ncols=columns,
        handlelength=2.0,
        columnspacing=0.6,
    )


def _grouped(curves):
    """Curves by label: those that are one line to the eye share it."""
    groups = {}
    for name, values in curves.items():
        groups.setdefault(tuple(np.round(values, 3)), []).append(name)
    for names in groups.values():
        label = ", ".join(names[:2]) + (f" +{len(names) - 2}" if len(names) > 2 else "")
        yield names[0], label, curves[names[0]]


def _moduli(moduli, folder, stem):
    """Effective against asked Poisson's ratio, one panel a mesh type, on its finest patch."""
    types = [name for name in moduli.mesh_type.values if (moduli.status.sel(mesh_type=name) == 1).any()]
    looks = _looks(moduli.definition.values)
    asked = moduli.poisson_ratio.values
    title = "Effective Poisson's ratio against the one asked for"
    with _panels(folder, stem, types, 3.1) as (drawn, axes):
        for panel, mesh_type in zip(axes.flat, types):
            panel.plot([0, 0.5], [0, 0.5], color="0.75", linewidth=3, zorder=0, label="as asked")
            curves = {}
            for definition in moduli.definition.values:
                here = moduli.sel(mesh_type=mesh_type, definition=definition)
                sizes = np.flatnonzero((here.status == 1).any("poisson_ratio").values)
                if len(sizes):
                    curves[definition] = here.effective_poisson_ratio.values[sizes[0]]
            for definition, label, found in _grouped(curves):
                panel.plot(asked, found, label=label, **looks[definition])
            panel.set(title=mesh_type, xlim=(-0.01, 0.51), ylim=(-0.4, 0.65), xlabel="asked for")
            _legend(panel)
        for panel in axes[:, 0]:
            panel.set_ylabel("effective")
        _arrange(drawn, axes, types, 1.15, title)


def _sizes(root, load, folder, stem):
    """Field error against mesh size with fitted rates, one panel a mesh type, of one beam and material."""
    root = _main(root)
    error = root.field_error
    types = [name for name in root.mesh_type.values if np.isfinite(error.sel(mesh_type=name)).all("mesh_size").any()]
    looks = _looks(root.definition.values)
    title = f"{_title(root)}, {load}: error of the displacement field in L2, fitted rate in brackets"
    with _panels(folder, stem, types, 3.5) as (drawn, axes):
        for panel, mesh_type in zip(axes.flat, types):
            every = error.sel(mesh_type=mesh_type).transpose("definition", "mesh_size").values
            full = np.isfinite(every).all(axis=1)
            curves = {
                name: 100 * np.maximum(row, FLOOR) for name, row in zip(root.definition.values[full], every[full])
            }
            sizes = 1e3 * root.mesh_size.values
            for definition, label, values in _grouped(curves):
                if len(sizes) > 1:
                    label += f" ({np.polyfit(np.log(sizes), np.log(values), 1)[0]:.1f})"
                panel.loglog(sizes, values, label=label, **looks[definition])
            panel.set(title=mesh_type, xlabel="Mesh size [mm]")
            panel.set_xticks(sizes, [f"{size:g}" for size in sizes])
            panel.minorticks_off()
            _legend(panel)
        for panel in axes[:, 0]:
            panel.set_ylabel("Error [%]")
        _arrange(drawn, axes, types, 1.5, title)


def _loads(root, mesh_type, folder, stem):
    """Heat map of the deformation error, definition by load, finest meshes of the main beam, for three materials."""
    root = _main(root, materials=True)
    solved = root.status == 1
    # Those of which most loads are there; of these the first, the middle and the last.
    counts = solved.any("mesh_size").sum(["definition", "load"]).values
    full = np.flatnonzero(counts > 0.5 * counts.max())
    order = full[np.argsort(root.material_poisson_ratio.values[full], kind="stable")]
    materials = root.material.values[[*dict.fromkeys((order[0], order[len(order) // 3], order[-1]))]]
    root = root.isel(definition=np.flatnonzero(solved.any(["mesh_size", "load", "material"])))
    names, loads = root.definition.values, root["load"].values
    arguments = {"ncols": len(materials), "sharey": True, "squeeze": False}
    figsize = (2.1 + 1.35 * len(materials), 1.35 + 0.23 * len(names))
    with style.figure(folder, stem, figsize=figsize, **arguments) as (drawn, axes):
        for panel, material in zip(axes[0], materials):
            here = root.deformation_error.sel(material=material).transpose("mesh_size", "definition", "load").values
            error = np.full(here.shape[1:], np.nan)
            for values in 100 * here[::-1]:  # the finest mesh that each was solved on stays
                error = np.where(np.isfinite(values), values, error)
            shade = np.log10(np.clip(np.abs(error), 0.1, 100))
            image = panel.imshow(shade, cmap="YlOrBr", vmin=-1, vmax=2, aspect="auto")
            for row, column in np.argwhere(np.isfinite(error)):
                size = abs(error[row, column])
                text = f"{error[row, column]:+.{0 if size >= 9.95 else 1 if size >= 0.095 else 2}f}"
                colour = "white" if shade[row, column] > 1.2 else "k"
                panel.text(column, row, text, ha="center", va="center", fontsize=6, color=colour)
            panel.set_xticks(range(len(loads)), loads)
            panel.xaxis.set_tick_params(rotation=90, labelsize=7)
            panel.set_yticks(range(len(names)), names)
            panel.set_title(material, fontsize=8)
            panel.grid(False)
        width, height = drawn.get_size_inches()
        bar = drawn.add_axes([1 - 0.55 / width, 0.85 / height, 0.1 / width, 1 - 1.4 / height])
        drawn.colorbar(image, cax=bar, ticks=[-1, 0, 1, 2]).set_ticklabels(["0.1", "1", "10", "100"])
        drawn.suptitle(
            f"{root.attrs['beam']}, {mesh_type}: deformation error [%]",
            x=0.01,
            y=1 - 0.08 / height,
            va="top",
            ha="left",
        )
        drawn.subplots_adjust(left=1.3 / width, right=1 - 0.65 / width, bottom=0.85 / height, top=1 - 0.55 / height)
        drawn.subplots_adjust(wspace=0.08)


def _main(root, materials=False):
    """The beam, kinematics and, unless all are wanted, the material that most scenes are of."""
    dimensions = ["beam", "kinematics"] if materials else ["beam", "kinematics", "material"]
    chosen = {dimension: most_asked(root, dimension) for dimension in dimensions}
    data = root.sel(chosen)
    data.attrs = chosen
    return data


def _title(root):
    return ", ".join(root.attrs[name] for name in ("beam", "material") if name in root.attrs)
