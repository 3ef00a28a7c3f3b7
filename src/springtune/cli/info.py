"""What a dataset holds, and where it comes from."""

import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from ..problem.status import Status
from ..safe_io.escapes import shown
from ..studies.output.text import aligned, bytes_text, label_text, paragraphs, without_numbers
from .examples import examples

if TYPE_CHECKING:
    import xarray as xr

REASONS = 5
"""Reasons of a status that are told."""


@click.command(epilog=examples("springtune info results/paper"))
@click.argument("path", type=click.Path(path_type=Path))
def info(path: Path) -> None:
    """Say what a dataset holds: how its scenes ended, its errors, its groups, and where it comes from.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading

    try:
        reading.check_opens(path)
        with reading.open(path) as tree, reading.guarded(path):
            click.echo(info_text(tree, path / "dataset.nc" if path.is_dir() else path))
    except (OSError, ValueError) as error:
        raise click.ClickException(shown(error)) from None


def info_text(tree: "xr.DataTree", path: Path) -> str:
    """What a dataset holds, as text."""
    parts = [_head(tree, path)]
    ends = [line for node in tree.subtree for line in _ends(node)]
    parts += [["how it ended", *ends]] if ends else []
    errors = _errors(tree)
    parts += [errors] if errors else []
    parts += [_groups(tree), _provenance(tree)]
    return paragraphs(parts)


def _head(tree: "xr.DataTree", path: Path) -> list[str]:
    made = f", made {tree.attrs['created']}" if "created" in tree.attrs else ""
    study = tree.attrs.get("study", "unknown")
    return [str(tree.attrs.get("title", study)), f"study {study}: {path}, {bytes_text(path.stat().st_size)}{made}"]


def _ends(node: "xr.DataTree") -> Iterator[str]:
    """Lines on how many cells of a group came to which status, and why not all are solved."""
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
    """Lines on the reasons of a status: those that differ in numbers alone are one, told by its first."""
    alike = defaultdict(list)
    for text in texts:
        alike[without_numbers(text)].append(text)
    kinds = sorted(alike.values(), key=len, reverse=True)
    for members in kinds[:REASONS]:
        such = "such as " if len(set(members)) > 1 else ""
        yield f"    {len(members)} {status}: {such}{members[0] or 'no reason given'}"
    if len(kinds) > REASONS:
        yield f"    {status}: and {len(kinds) - REASONS} more reasons"


def _path(node: "xr.DataTree", name: str) -> str:
    where = "scenes" if node.path == "/" else node.path
    return where if name == "status" else f"{where}, {name.removesuffix('_status').replace('_', ' ')}"


def _errors(tree: "xr.DataTree") -> list[str]:
    """Median and worst error of each definition, and where the worst one is."""
    root = tree.to_dataset()
    if "deformation_error" not in root or "definition" not in root.deformation_error.dims:
        return []
    counted = root.status == Status.SOLVED
    if "reference_applies" in root:
        counted = counted & (root.reference_applies == 1)
    error = root.deformation_error.where(counted).transpose(*root.deformation_error.dims)
    several = error.sizes.get("kinematics", 1) > 1
    rows: list[list[object]] = [
        ["  definition", *(["kinematics"] if several else []), "cells", "median", "worst", "at"]
    ]
    for definition in error.definition.values:
        for number in range(error.sizes.get("kinematics", 1)):
            here = error.sel(definition=definition)
            here = here.isel(kinematics=number) if "kinematics" in here.dims else here
            values = here.values
            if not np.isfinite(values).any():
                continue
            sizes = np.abs(values[np.isfinite(values)])
            worst = np.unravel_index(np.nanargmax(np.abs(values)), values.shape)
            axes = [(here[name], number) for name, number in zip(here.dims, worst)]
            place = ", ".join(
                label_text(str(one.name), one.values[at], one.attrs.get("units", "1")) for one, at in axes
            )
            kind = [str(error.kinematics.values[number])] if several else []
            numbers = [len(sizes), f"{100 * np.median(sizes):.3g} %", f"{100 * values[worst]:+.3g} %"]
            rows.append([f"  {definition}", *kind, *numbers, place])
    right = range(1 + several, 4 + several)
    head = "errors, (network - reference) / |reference|, of scenes that are solved and within their reference's reach"
    return [head, *aligned(rows, 0, right).splitlines()] if rows[1:] else []


def _groups(tree: "xr.DataTree") -> list[str]:
    rows = []
    for node in tree.subtree:
        sizes = node.to_dataset().drop_vars(node.coords).sizes  # what its own variables have
        rows.append(
            [f"  {node.path}", len(node.data_vars), ", ".join(f"{name} {size}" for name, size in sizes.items())]
        )
    return ["groups, their variables and dimensions", *aligned(rows, 0, (1,)).splitlines()]


def _provenance(tree: "xr.DataTree") -> list[str]:
    """Versions, commit and hashes."""
    attributes = {str(name): str(value) for name, value in tree.attrs.items()}
    lines = ["made with", f"  springtune {attributes.get('springtune_version', 'unknown')}"]
    if attributes.get("git_commit"):
        changed = attributes.get("git_diff", "").count("\ndiff --git ") + attributes.get("git_diff", "").startswith(
            "diff"
        )
        files = f", {changed} changed files in git_diff" if changed else ""
        lines.append(f"  commit {attributes['git_commit']}{files}")
    software = _json(attributes.get("software"))
    if software:
        lines.append("  " + ", ".join(f"{name} {version}" for name, version in software.items() if version != "none"))
    if attributes.get("host"):
        lines.append(f"  on {attributes['host']}")
    lines += [f"  sha256 {digest}  {name}" for name, digest in _json(attributes.get("inputs")).items()]
    return lines


def _json(text: str | None) -> dict[str, str]:
    try:
        return dict(json.loads(text or "{}"))
    except ValueError:
        return {}
