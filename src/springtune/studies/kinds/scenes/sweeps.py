"""Figures of sweeps: errors against a parameter that a study gives several values."""

from springtune.problem.parameters import SWEPT

from ...config.kind import distinct
from ...output import labels, style
from ...output.selection import at, cells, group, labelled_beam, labels_of, last_swept
from .figures import USUAL, by_beam, compared, error_line, error_panels, like_with_like, parts_of, swept_words
from .outputs import SCENE_LABELS

ALONG_X = {
    "force": ("Force [N]", 1.0),
    "thickness": ("Thickness [mm]", 1e3),
    "young_modulus": ("Young's modulus [MPa]", 1e-6),
    "poisson_ratio": ("Poisson's ratio", 1.0),
    "stiffness_scale": ("Factor on the stiffness", 1.0),
}
"""What is written along the axis of a parameter, and the unit there over that of the dataset."""

WIDE = 20.0
"""Largest value over the smallest from which on an axis is logarithmic."""


def sweep(tree):
    """Figures of sweeps: one for each parameter that is swept, mesh type, material and load."""
    present = group(tree, "/").status != 0
    names = [name for name in SWEPT if present.sizes.get(name, 1) > 1]
    for name in names:
        for stem, selection in distinct(f"sweep_{name}", SCENE_LABELS, cells(present, SCENE_LABELS)).items():
            here = present.sel(selection)
            counts = {one: _most(here.sel(kinematics=one), name) for one in labels_of(here, "kinematics")}
            chosen = max(counts, key=lambda one: (counts[one], one == USUAL))
            if counts[chosen] > 1:
                yield stem, plot_sweep, selection | {"parameter": name, "kinematics": chosen}


@style.styled
def plot_sweep(
    data,
    ax=None,
    *,
    parameter,
    beam=None,
    mesh_type=None,
    mesh_size=None,
    material=None,
    load=None,
    kinematics="nonlinear",
):
    """Deformation error against a parameter that the study sweeps, a panel a beam, a line a definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its root.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as beams; by default a new figure.
    parameter : str
        ``"force"``, ``"thickness"``, ``"young_modulus"``, ``"poisson_ratio"`` or ``"stiffness_scale"``. Of the others
        that are swept each beam shows values under which this one has most; of several the largest force, under it
        the largest thickness, and so on.
    beam : str, optional
        One beam in place of all.
    mesh_size : float, optional
        [m]; without, of each beam the one that has most values, the finest of several.
    mesh_type, material, load, kinematics : str, optional
        Labels of the scenes. One that is not given must leave no choice.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_panels,)
        One a beam, more where a beam has many definitions.

    Raises
    ------
    ValueError
        If the parameter is not swept, the selection leaves a choice, or nothing.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> st.plot_sweep(tree, parameter="force")
    Traceback (most recent call last):
    ValueError: parameter: 'force' is not swept; the study sweeps nothing
    """
    root = like_with_like(data)
    swept = [name for name in SWEPT if name in root.status.dims]
    if parameter not in swept:
        raise ValueError(f"parameter: {parameter!r} is not swept; the study sweeps {', '.join(swept) or 'nothing'}")
    root = root[["status", "deformation_error", "beam_length", "beam_height"]]
    root, beams, selection = by_beam(root, beam, mesh_type, material, load, kinematics)
    several = [name for name in beams if _most((root.status != 0).sel(beam=[name]), parameter) > 1]
    looks = {one: style.line(number) for number, one in enumerate(labels_of(root.status != 0, "definition"))}
    shown = [_of_beam(root, name, parameter, mesh_size) for name in several or beams]
    shown = [(one, part) for one in shown for part in parts_of(one.status != 0)]

    def draw(panel, one):
        here, definitions = one
        drawn = _panel(panel, here, {name: looks[name] for name in definitions}, parameter)
        panel.set_xlabel(ALONG_X[parameter][0])
        return here.attrs["words"], *drawn

    return error_panels(ax, shown, draw, compared(root, selection), True)


def _most(present, parameter):
    """Values that a beam has of a parameter, at most."""
    return int(present.any([name for name in present.dims if name not in ("beam", parameter)]).sum(parameter).max())


def _of_beam(root, name, parameter, mesh_size):
    """Errors of a beam over a parameter and definitions, with what they are of in words."""
    here = root.sel(beam=name)
    present = here.status != 0
    sizes = labels_of(present, "mesh_size")
    if mesh_size is not None and mesh_size not in sizes:
        listed = ", ".join(map(str, sizes))
        raise ValueError(f"mesh_size: nothing of beam {name!r} has {mesh_size!r} m; it has {listed}")
    there = present.any([one for one in present.dims if one not in ("mesh_size", parameter)])
    counts = {size: int(there.sel(mesh_size=size).sum()) for size in sizes}
    if mesh_size is None and max(counts.values()) == 1 and len(sizes) > 1:
        # Each value has a mesh of its own: the finest where it has several.
        here = here.isel(mesh_size=there.argmax("mesh_size"))
        meshes = f"mesh {1e3 * min(sizes):g} to {1e3 * max(sizes):g}\u00a0mm"
    else:
        size = max(sizes, key=lambda one: (counts[one], -one)) if mesh_size is None else mesh_size
        here, meshes = here.sel(mesh_size=size), f"mesh {1e3 * size:g}\u00a0mm"
    values = last_swept(here.status != 0, parameter)
    words = [labelled_beam(root, name), meshes]
    words += swept_words(values)
    return at(here, values).assign_attrs(words=", ".join(words))


def _panel(panel, here, looks, parameter):
    """Draw errors over a parameter: ends of lines for names, and what a note says."""
    here = here.transpose("definition", parameter, ...)
    x, ends, said, statuses = ALONG_X[parameter][1] * here[parameter].values, [], [], set()
    for definition, look in looks.items():
        cell = here.sel(definition=definition)
        # What other beams or grids ask for makes no gaps.
        end, doubts, lost = error_line(panel, x, cell, definition, look, cell.status.values != 0)
        ends, statuses = ends + end, statuses | doubts
        for reason, found in lost.items():
            span = f"{min(found):.4g}" if len(found) == 1 else f"{len(found)} from {min(found):.4g} to {max(found):.4g}"
            said.append(f"{definition}, {span}: {reason}")
    if statuses:
        said.insert(0, f"hollow: {', '.join(sorted(statuses))}")
    asked = x[(here.status != 0).any("definition").values]
    if len(asked) > 1 and asked.min() > 0 and asked.max() / asked.min() > WIDE:
        panel.set_xscale("log")
    if ends:
        panel.axhline(0, color="0.3", linewidth=0.7, zorder=1)
    room = panel.get_window_extent().width / panel.figure.dpi
    return ends, "\n".join(labels.wrapped(text, room) for text in said)
