"""Dataset as text: solved cells, failures with reasons, errors, groups, origin.

The stage `collect` writes `text` beside the dataset; `info` adds what the file is.
"""

import os
from collections.abc import Iterator, Mapping
from html import escape
from itertools import product
from pathlib import Path

import numpy as np
import xarray as xr

from springtune.problem.status import Status
from springtune.safe_io.escapes import shown
from springtune.safe_io.tables import aligned

from . import reading
from .selection import select_own_law, valid_errors
from .text import NOT_ALL_SOLVED, bytes_text, from_json, paragraphs, place_text, range_text, sign_text, without_numbers

CELLS_NAMED = 3
"""Cells named for each status; more if fewer than two would remain."""

DEFINITIONS_LISTED = 8
"""Most definitions with a worst error."""

ROOT_GROUP = "/"


FINITE_STRAIN_GROUP = "/finite_strain"
"""Group of references for nonlinear kinematics."""


COMPARED_VARIABLES = {"status", "reference_displacement", "reference_applies", "reference_message"}
"""Variables of groups that compare scenes with small-strain references."""


def text(groups: Mapping[str, xr.Dataset], title: str, most: int | None = DEFINITIONS_LISTED) -> str:
    """Summarise a study's cells, with the errors of at most so many definitions."""
    states = [state for name, data in groups.items() for state in _states(name, data)]
    rows = [[what, str(sum(found.values())), _count_words(found)] for what, found, _ in states if found]
    lines = [title, "", aligned(rows, left=2, right=(1,))]
    if ROOT_GROUP in groups:
        root, finite = groups[ROOT_GROUP], groups.get(FINITE_STRAIN_GROUP)
        lines += [*_errors(root, finite, most), *_stiffness_to_type(root, finite)]
    for name, data in groups.items():
        if COMPARED_VARIABLES <= set(data):
            lines += _lines_on_references(data, "scenes" if name == ROOT_GROUP else name.strip("/"))
    holes = [(what, found, lost) for what, found, lost in states if lost]
    for what, found, lost in holes:
        for status, cells in lost.items():
            lines += [
                "",
                f"{what}, {_status_words(status)}: {len(cells)} of {sum(found.values())}",
                *_cell_lines(cells),
            ]
    if holes:
        told = "; ".join(
            f"{sum(map(len, lost.values()))} of {sum(found.values())} {what}" for what, found, lost in holes
        )
        lines += ["", f"{NOT_ALL_SOLVED}: {told}. dataset.nc names each, and why: `status`, `message`."]
    return "\n".join(lines) + "\n"


Cells = list[tuple[str, str]]


def _states(name: str, data: xr.Dataset) -> Iterator[tuple[str, dict[Status, int], dict[Status, Cells]]]:
    """Subject, counts by flag and unsolved cells of each status variable."""
    for variable in data.data_vars.values():
        label = str(variable.name)
        message = label.removesuffix("status") + "message"
        if not label.endswith("status") or message not in data or data[message].dims != variable.dims:
            continue
        flags = variable.values
        found = {status: int((flags == status).sum()) for status in Status if status != Status.NOT_REQUESTED}
        lost: dict[Status, Cells] = {
            status: [
                (place_text(data, variable.dims, place), str(data[message].values[tuple(place)]))
                for place in np.argwhere(flags == status)
            ]
            for status, number in found.items()
            if number and status != Status.SOLVED
        }
        part = label.removesuffix("status").strip("_").replace("_", " ")
        what = "scenes" if name == ROOT_GROUP else ", ".join(filter(None, (name.strip("/"), part)))
        yield what, {status: number for status, number in found.items() if number}, lost


def _status_words(status: Status) -> str:
    return str(status).replace("_", " ")


def _count_words(found: Mapping[Status, int]) -> str:
    return ", ".join(f"{number} {_status_words(status)}" for status, number in found.items())


def _cell_lines(cells: Cells) -> Iterator[str]:
    """Lines on some cells, one for each reason first, and the number of others."""
    reasons: dict[str, Cells] = {}
    for cell in cells:
        reasons.setdefault(without_numbers(cell[1]), []).append(cell)
    order = [*(alike[0] for alike in reasons.values()), *(cell for alike in reasons.values() for cell in alike[1:])]
    told = order if len(order) <= CELLS_NAMED + 1 else order[:CELLS_NAMED]
    for labels, message in told:
        yield f"  {shown(': '.join(filter(None, (labels, message))))}"
    if len(told) < len(order):
        yield f"  and {len(order) - len(told)} more"


def _errors(root: xr.Dataset, finite: xr.Dataset | None, most: int | None) -> Iterator[str]:
    """Median and worst error of definitions over solved scenes with a valid reference, the worst first."""
    if "definition" not in root.get("deformation_error", root).dims:
        return
    errors = valid_errors(root, finite)
    by = [name for name in ("definition", "kinematics") if name in errors.dims]
    found = []
    for labels in product(*(errors[name].values.tolist() for name in by)):
        cell = dict(zip(by, labels))
        own, here = root.sel(cell), errors.sel(cell)
        sizes = np.abs(here.values)
        if np.isfinite(sizes).any():
            place = [int(at) for at in np.unravel_index(np.nanargmax(sizes), sizes.shape)]
            worst = float(here.values[tuple(place)])
            numbers = [f"{100 * np.nanmedian(sizes):.3g} %", f"{100 * worst:+.3g} %"]
            word, where = sign_text(own, worst, here.dims, place), place_text(own, here.dims, place)
            found.append((abs(worst), [*labels, int(np.isfinite(sizes).sum()), *numbers, word, where]))
    found.sort(key=lambda row: -row[0])
    if found:
        yield from (
            "",
            "deformation errors, (network - reference) / |reference|, of solved scenes within the reference",
        )
        if finite is not None and select_own_law(finite) is not None:
            yield "  nonlinear networks against finite strain, linear ones against small strain"
        heads = [*by, "scenes", "median", "worst", "", "at"]
        right = range(len(by), len(by) + 3)
        yield from aligned([heads, *(row for _, row in found[:most])], 2, right).splitlines()
    if most is not None and len(found) > most:
        yield f"  and of {len(found) - most} more at most {100 * found[most][0]:.2f} %"


def _stiffness_to_type(root: xr.Dataset, finite: xr.Dataset | None) -> Iterator[str]:
    """What to type on the finest mesh of each type and material: of the best definition and the best uniform one."""
    if not {"stiffness_inside", "deformation_error"} <= {*root}:
        return
    errors, rows = abs(valid_errors(root, finite)), []
    for mesh_type, material in product(root.mesh_type.values.tolist(), root.material.values.tolist()):
        place = {"mesh_type": mesh_type, "material": material}
        known = errors.sel(place).dropna("mesh_size", how="all")
        if not known.size:
            continue
        size = known.mesh_size.values.min()
        own, off = root.sel(place).sel(mesh_size=size), known.sel(mesh_size=size)
        membrane = own.material_young_modulus * own.beam_thickness
        typed = own.stiffness_inside.notnull() | own.stiffness_outline.notnull()
        off = off.where(typed.transpose(*off.dims))
        medians = {name: np.nanmedian(one) for name in off.definition.values.tolist()
                   if np.isfinite(one := off.sel(definition=name).values).any()}  # fmt: skip
        uniform = {name for name in medians if own.stiffness.sel(definition=name).notnull().any()}
        for names in ({*medians} - uniform, uniform):
            if not names:
                continue
            best = min(sorted(names), key=medians.__getitem__)
            found = own.sel(definition=best)
            parts = (found[f"stiffness_{part}"].values for part in ("inside", "outline"))
            sides = [range_text(values[np.isfinite(values)]) for values in parts]
            shares = (found.stiffness_inside / membrane).values
            ratio = f"{np.nanmedian(shares):.3g}" if np.isfinite(shares).any() else ""
            rows.append([best, mesh_type, material, f"{1e3 * size:.4g} mm", *sides, ratio,
                         f"{100 * medians[best]:.2g} %"])  # fmt: skip
    if rows:
        yield from ("", "what to type [N/m], on the finest mesh: the best definition, and the best uniform stiffness")
        heads = ["definition", "mesh type", "material", "size", "inside", "outline", "inside / E t", "median error"]
        yield from aligned([heads, *rows], 2, range(3, 8)).splitlines()


def _lines_on_references(root: xr.Dataset, called: str) -> Iterator[str]:
    """Missing or inapplicable references with their scenes."""
    requested, there = root.status != Status.NOT_REQUESTED, root.reference_displacement.notnull()
    beyond = root.status.isin((Status.SOLVED, Status.UNSTABLE)) & there & (root.reference_applies == 0)
    for scenes, what in (
        (requested & ~there, "without a reference, and so without an error"),
        (beyond, "beyond small strain, so the error is not the network's alone"),
    ):
        if not scenes.any():
            continue
        few = scenes.any([dim for dim in scenes.dims if dim not in root.reference_message.dims])
        few = few.transpose(*root.reference_message.dims)
        messages = root.reference_message.values
        cells = [(place_text(root, few.dims, place), str(messages[tuple(place)])) for place in np.argwhere(few.values)]
        yield from ("", f"{called} {what}: {int(scenes.sum())} of {int(requested.sum())}", *_cell_lines(cells))


# -- of a file ---------------------------------------------------------------------------------------------------------


class Info(str):
    """Text that terminals and notebooks show verbatim."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self)}</pre>"


def info(path: str | os.PathLike[str]) -> Info:
    """Sum up the dataset of a study, as `springtune info` does.

    Parameters
    ----------
    path : str or Path
        ``results/<study>/dataset.nc``, or its folder.

    Returns
    -------
    str
        How scenes ended, errors by definition, groups, and versions of what made it.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If it is not the dataset of a study.

    Examples
    --------
    >>> import springtune as st
    >>> said = st.info("results/mine")
    >>> "groups, their variables and dimensions" in said, "springtune" in said
    (True, True)
    """
    with reading.open(path) as tree, reading.guarded(path):
        return Info(info_text(tree, reading.dataset_file(path)))


def info_text(tree: xr.DataTree, path: Path) -> str:
    """Content of a dataset as text."""
    made = f", made {tree.attrs['created']}" if "created" in tree.attrs else ""
    study = tree.attrs.get("study", "unknown")
    head = [tree.attrs.get("title", study), f"study {study}: {path}, {bytes_text(path.stat().st_size)}{made}"]
    cells = text({node.path: node.to_dataset() for node in tree.subtree}, "", None).strip("\n")
    return "\n\n".join(filter(None, [paragraphs([head]), cells, paragraphs([_groups(tree), _provenance(tree)])]))


def _groups(tree: xr.DataTree) -> list[str]:
    rows = []
    for node in tree.subtree:
        sizes = node.to_dataset().drop_vars(node.coords).sizes  # without inherited dimensions
        counts = ", ".join(f"{name} {size}" for name, size in sizes.items())
        rows.append([f"  {node.path}", len(node.data_vars), counts])
    return ["groups, their variables and dimensions", *aligned(rows, 0, (1,)).splitlines()]


def _provenance(tree: xr.DataTree) -> list[str]:
    """Versions, commit and hashes."""
    attributes = {str(name): str(value) for name, value in tree.attrs.items()}
    lines = ["made with", f"  springtune {attributes.get('springtune_version', 'unknown')}"]
    if attributes.get("git_commit"):
        lines.append(f"  commit {attributes['git_commit']}")
    software = from_json(attributes.get("software"))
    if software:
        lines.append("  " + ", ".join(f"{name} {version}" for name, version in software.items() if version != "none"))
    lines += [f"  sha256 {digest}  {name}" for name, digest in from_json(attributes.get("inputs")).items()]
    return lines
