"""Plots of a single scene and of a single curve, and what figures of networks share."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.image import AxesImage

from springtune.problem.compare import sign_sentence

from . import style
from .answers import ERROR_COLOURS, ERROR_RANGE

if TYPE_CHECKING:
    import xarray as xr

    from springtune.mesh.cells import Mesh
    from springtune.scene.curve import Curve


LARGEST_ERROR_SHOWN = 100.0
"""Largest error of a curve in a plot [%]."""

BEYOND_SMALL_STRAIN = "beyond small strain"
"""Note of a figure on errors whose reference does not apply, `reference_applies` false."""

NO_RESULT, NOT_ASKED = "×", "–"
"""Cells of a heat map without an error."""


@style.styled
def draw_springs(ax: Axes | None, mesh: "Mesh", displacements: np.ndarray, forces: np.ndarray, title: str) -> Axes:
    """Draw deformed springs coloured by force [N], and the outline at rest."""
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN_WIDTH, 2.2))
    largest = float(np.abs(forces).max()) or 1.0
    outline = 1e3 * mesh.points[mesh.edges[mesh.on_outline]]
    panel.add_collection(LineCollection(outline, colors="0.6", linewidths=0.7))
    moved = 1e3 * (mesh.points + displacements)[mesh.edges]
    lines = LineCollection(moved, array=forces, cmap="coolwarm", clim=(-largest, largest), linewidths=0.7)
    panel.add_collection(lines)
    label = "Spring force [N], tension positive"
    panel.figure.colorbar(lines, ax=panel, label=label, orientation="horizontal", aspect=40)
    panel.autoscale()
    panel.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title=title)
    panel.grid(False)
    return panel


@style.styled
def draw_curve(ax: Axes | None, curve: "Curve") -> Axes:
    """Draw the deformation error over uniform stiffness, and its zero."""
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN_WIDTH, 2.5))
    error, said = 100 * curve.error, []
    unit, written = style.power_of_ten(float(curve.stiffness.max()))
    stiffness, colour = curve.stiffness / unit, style.line(0)["color"]
    panel.axhline(0.0, color="0.6", linewidth=0.7)
    panel.plot(stiffness, np.where(curve.stable, error, np.nan), color=colour, label="network")
    panel.plot(stiffness, np.where(curve.stable, np.nan, error), color=colour, linewidth=0.5, label="not stable")
    marks = {"best": curve.best_stiffness, "closed form": curve.predicted_stiffness}
    for number, (name, value) in enumerate(marks.items(), start=1):
        if np.isfinite(value):
            look = style.line(number) | {"marker": "", "linewidth": 0.9}
            panel.axvline(value / unit, label=f"{name}, {value / unit:.4g} {written}N/m", **look)
    panel.set(xlabel=f"Stiffness [{written}N/m]", ylabel="Deformation error [%]", title=curve.title)
    known = error[np.isfinite(error)]
    if len(known):  # a beam that buckled errs by thousands
        low, high = min(1.1 * known.min(), 0.0), max(1.1 * known.max(), 1.0)
        panel.set_ylim(*np.clip([low, high], -LARGEST_ERROR_SHOWN, LARGEST_ERROR_SHOWN))
        said = [sign_sentence({"": float(np.nansum(curve.displacement))})]
    else:
        style.write_reason(panel, curve.message or "There is no reference, and so no error.", bare=False)
    style.add_legend(panel, said)
    return panel


@style.styled
def draw_residuals(ax: Axes | None, residuals: Mapping[str, np.ndarray], places: Mapping[str, np.ndarray]) -> Axes:
    """Draw residuals over the noise of each column or field, over the largest load or coordinate."""
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN_WIDTH, 2.5))
    for number, (label, values) in enumerate(residuals.items()):
        along = places[label] if places[label].ndim == 1 else np.repeat(places[label][:, 0], 2)
        panel.plot(along / np.abs(along).max(), values, ".", color=style.line(number)["color"], label=label)
    panel.axhline(0.0, color="0.6", linewidth=0.7)
    panel.set(xlabel="Load, or x, over its largest [1]", ylabel="Residual over noise [1]")
    panel.legend(fontsize=style.SMALL_TEXT)
    return panel


# -- networks of a dataset ---------------------------------------------------------------------------------------------


def heat_map(panel: Axes, errors: np.ndarray, texts: np.ndarray) -> AxesImage:
    """Draw cells coloured by the size of an error [%], with texts; both have shape (n_rows, n_columns)."""
    shade, (low, high) = np.log10(np.clip(np.abs(errors), *ERROR_RANGE)), np.log10(ERROR_RANGE)
    colours = LinearSegmentedColormap.from_list("errors", ERROR_COLOURS)
    image = panel.imshow(shade, cmap=colours, vmin=low, vmax=high, aspect="auto")
    for (row, column), text in np.ndenumerate(texts):
        colour = "white" if shade[row, column] > 1.2 else "0.5" if text == NOT_ASKED else "k"
        panel.text(column, row, text, ha="center", va="center", fontsize=style.SMALL_TEXT, color=colour)
    panel.grid(False)
    return image


def error_text(error: float, sign: str = "+") -> str:
    """Format an error [%] for a cell of a heat map."""
    size = abs(error)
    return f"{error:{sign}.{0 if size >= 9.95 else 1 if size >= 0.095 else 2}f}".replace("-", "−")


def plane_vectors(fields: "xr.Dataset", name: str) -> np.ndarray:
    """Vectors in the plane from their components, such as ``"displacement_{}"``, shape (n, 2)."""
    return np.stack([fields[name.format(axis)].values for axis in "xy"], axis=1)


def extent(places: np.ndarray, nothing: tuple[float, float]) -> tuple[float, float]:
    """Width and height of points, shape (n, 2), without NaN; `nothing` if they have no extent."""
    known = places[np.isfinite(places).all(axis=1)]
    wide, high = np.ptp(known, axis=0) if len(known) else (0.0, 0.0)
    return (float(wide), float(high)) if min(wide, high) > 0 else nothing


def magnification(fields: "xr.Dataset") -> float:
    """Factor on displacements, 1, 2 or 5 times a power of ten, so that the largest is about a fifteenth of the body."""
    places = np.concatenate([plane_vectors(fields, "{}"), plane_vectors(fields, "outline_{}")])
    names = ("reference_displacement", "displacement")
    sizes = (np.hypot(fields[f"{name}_x"].values, fields[f"{name}_y"].values) for name in names)
    largest = next(filter(None, (np.max(size, where=np.isfinite(size), initial=0.0) for size in sizes)), 0.0)
    factor = 0.07 * max(extent(places, (0.0, 0.0))) / largest if largest else 0.0
    if not factor or 0.4 < factor < 2:
        return 1.0
    steps = np.array([1, 2, 5]) * 10.0 ** math.floor(math.log10(factor))
    return float(steps[steps <= factor * (1 + 1e-9)][-1])


NETWORK_LINE_WIDTH = 0.35
"""Width of the lines of springs that have one colour [pt]."""


def draw_network(
    panel: Axes, fields: "xr.Dataset", scale: float, most: float = 0.0, cmap: Colormap | None = None
) -> LineCollection | None:
    """Draw a deformed network, coloured up to `most` [N], over the outline of its reference and the one at rest."""
    outline, there = plane_vectors(fields, "outline_{}"), plane_vectors(fields, "reference_displacement_{}")
    rounds = fields.outline_round.values if "outline_round" in fields else np.where(np.isfinite(outline[:, 0]), 0, -1)
    for number in range(int(rounds.max(initial=-1)) + 1):
        places = np.flatnonzero(rounds == number)
        closed = np.append(places, places[:1])
        panel.plot(*1e3 * (outline + scale * there)[closed].T, color="0.7", linewidth=2.0, zorder=1)
        panel.plot(*1e3 * outline[closed].T, color="0.5", linewidth=0.6, linestyle=(0, (3, 3)), zorder=1)
    moved = 1e3 * (plane_vectors(fields, "{}") + scale * plane_vectors(fields, "displacement_{}"))
    if not np.isfinite(moved).any():
        return None
    nodes = fields.spring_nodes.transpose("spring", "spring_end").fillna(-1).values.astype(int)
    kept = (nodes >= 0).all(axis=1)
    springs = moved[nodes[kept]]
    panel.set(aspect="equal", adjustable="datalim")
    if not most:  # one line with gaps: thousands of lines take ten times as long
        gaps = np.pad(springs, ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
        panel.plot(*gaps.reshape(-1, 2).T, color="#0b3c5d", linewidth=NETWORK_LINE_WIDTH)
        return None
    width = float(np.clip(18 / np.sqrt(len(springs)), 0.25, 0.9))
    forces = fields.spring_force.values[kept]
    lines = LineCollection(springs, array=forces, cmap=cmap, clim=(-most, most), linewidths=width, zorder=2)
    panel.add_collection(lines)
    panel.autoscale()
    return lines
