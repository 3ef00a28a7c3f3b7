"""Content of a dataset as text: how its scenes ended, its errors, its groups, and where it comes from."""

import os
from collections import defaultdict
from collections.abc import Iterator
from html import escape
from itertools import product
from pathlib import Path

import numpy as np
import xarray as xr

from springtune.safe_io.tables import aligned

from . import reading
from .selection import judged
from .text import bytes_text, from_json, paragraphs, place_text, sign_text, without_numbers

REASONS = 5
"""Most reasons that are listed for a status."""


class Info(str):
    """Content of a dataset: a text that terminals and notebooks show as it is."""

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
    parts = [_head(tree, path)]
    ends = [line for node in tree.subtree for line in _ends(node)]
    parts += [["how it ended", *ends]] if ends else []
    errors = _errors(tree)
    parts += [errors] if errors else []
    parts += [_groups(tree), _provenance(tree)]
    return paragraphs(parts)


def _head(tree: xr.DataTree, path: Path) -> list[str]:
    made = f", made {tree.attrs['created']}" if "created" in tree.attrs else ""
    study = tree.attrs.get("study", "unknown")
    return [str(tree.attrs.get("title", study)), f"study {study}: {path}, {bytes_text(path.stat().st_size)}{made}"]


def _ends(node: xr.DataTree) -> Iterator[str]:
    """Lines with the number of cells by status, and the reasons of those not solved."""
    data = node.to_dataset()
    for name in (str(name) for name in data.data_vars if str(name).rpartition("_")[2] == "status"):
        status = data[name]
        if "flag_meanings" not in status.attrs:
            continue
        meanings = dict(zip(status.attrs["flag_values"].tolist(), status.attrs["flag_meanings"].split()))
        flags = status.values
        counts = {word: int((flags == flag).sum()) for flag, word in meanings.items() if flag}
        asked = sum(counts.values())
        if not asked:
            continue
        said = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
        yield f"  {_path(node, name)}: {asked} asked, {said}"
        texts = data.get(name.removesuffix("status") + "message")
        if texts is None or texts.dims != status.dims:
            continue
        for flag, word in meanings.items():
            if word not in ("not_requested", "solved") and counts[word]:
                yield from _reasons(word, [str(text) for text in texts.values[flags == flag]])


def _reasons(status: str, texts: list[str]) -> Iterator[str]:
    """Lines with the reasons of a status; reasons that differ only in numbers count as one."""
    alike = defaultdict(list)
    for text in texts:
        alike[without_numbers(text)].append(text)
    kinds = sorted(alike.values(), key=len, reverse=True)
    for members in kinds[:REASONS]:
        such = "such as " if len(set(members)) > 1 else ""
        yield f"    {len(members)} {status}: {such}{members[0] or 'no reason given'}"
    if len(kinds) > REASONS:
        yield f"    {status}: and {len(kinds) - REASONS} more reasons"


def _path(node: xr.DataTree, name: str) -> str:
    where = "scenes" if node.path == "/" else node.path
    return where if name == "status" else f"{where}, {name.removesuffix('_status').replace('_', ' ')}"


def _errors(tree: xr.DataTree) -> list[str]:
    """Median and worst error of each definition, with the cell of the worst."""
    root = tree.to_dataset()
    if "deformation_error" not in root or "definition" not in root.deformation_error.dims:
        return []
    error = judged(root)
    by = [name for name in ("definition", "kinematics") if name in error.dims]
    named = [name for name in by if name == "definition" or error.sizes[name] > 1]
    rows: list[list[object]] = [["  definition", *named[1:], "cells", "median", "worst", "", "at"]]
    for labels in product(*(error[name].values for name in by)):
        here = error.sel(dict(zip(by, labels)))
        sizes = np.abs(here.values[np.isfinite(here.values)])
        if len(sizes):
            worst = tuple(map(int, np.unravel_index(np.nanargmax(np.abs(here.values)), here.shape)))
            numbers = [len(sizes), f"{100 * np.median(sizes):.3g} %", f"{100 * here.values[worst]:+.3g} %"]
            place = place_text(root, here.dims, worst)
            word = sign_text(root, float(here.values[worst]), here.dims, worst)
            rows.append([f"  {labels[0]}", *labels[1 : len(named)], *numbers, word, place])
    head = "errors, (network - reference) / |reference|, of scenes that are solved and within their reference's reach"
    return [head, *aligned(rows, 0, range(len(named), len(named) + 3)).splitlines()] if rows[1:] else []


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
    if attributes.get("study_commit"):
        lines.append(f"  study: commit {attributes['study_commit']}")
    software = from_json(attributes.get("software"))
    if software:
        lines.append("  " + ", ".join(f"{name} {version}" for name, version in software.items() if version != "none"))
    lines += [f"  sha256 {digest}  {name}" for name, digest in from_json(attributes.get("inputs")).items()]
    return lines
