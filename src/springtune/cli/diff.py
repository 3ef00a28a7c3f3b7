"""Command diff: compare two datasets."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..safe_io.escapes import clipped, shown
from ..safe_io.tables import aligned
from ..studies.output.text import cell_text, paragraphs, variable_name
from . import examples
from .options import dataset_path

if TYPE_CHECKING:
    import xarray as xr

    from ..studies.output.comparison import Change, Comparison, GroupChanges

ROWS = 20
"""Rows of a table."""

COMPARED = ("before", "after")

DIFFERENT, TROUBLE = 1, 2
"""Exit codes, as those of diff."""


class Trouble(click.ClickException):
    """Nothing could be compared."""

    exit_code = TROUBLE


def tolerance(context: click.Context, parameter: click.Parameter, given: str | None) -> float | None:
    """Read a tolerance: a finite number, not below zero."""
    if given is None:
        return None
    try:
        number = float(given)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number >= 0):
        raise click.BadParameter(f"'{given}' is no tolerance; give a number such as 1e-6, or 0")
    return number


@click.command(
    epilog=examples(
        "springtune diff results/before results/mine",
        "springtune diff before.nc mine --relative 1e-3 --group sensitivity",
        "springtune diff before.nc after.nc --json > changes.json",
    )
)
@click.argument("before")
@click.argument("after")
@click.option("--relative", callback=tolerance, help="Tolerance of the larger number.  [default: 1e-6]")
@click.option(
    "--absolute", callback=tolerance, help="Tolerance in SI units.  [default: 0; of numbers without unit, --relative]"
)
@click.option("--group", "groups", multiple=True, help="Group to compare, such as sensitivity; all without.")
@click.option("--ignore", "ignored", multiple=True, help="Variables to leave out, such as 'reference_*'.")
@click.option("--rows", type=click.IntRange(1), default=ROWS, show_default=True, help="Rows of each table.")
@click.option("--all", "every", is_flag=True, help="All rows.")
@click.option("--config", is_flag=True, help="Show the diff of the studies' files, too.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def diff(
    before: str,
    after: str,
    relative: float | None,
    absolute: float | None,
    groups: tuple[str, ...],
    ignored: tuple[str, ...],
    rows: int,
    every: bool,
    config: bool,
    as_json: bool,
) -> None:
    """Say what changed from one dataset to another beyond a tolerance, scene by scene.

    BEFORE and AFTER are results/<study>, its dataset.nc, or the name of a study. Scenes are matched by their labels, in
    whatever order. Numbers are the same within --relative or --absolute, and NaN is NaN; along a curve or over a field
    --relative is of its largest number. Seconds, what is measured of the machine, when and where a dataset was made are
    not compared; versions and the studies' files are told and make no difference.

    Exits with 0 if nothing changed, 1 if something did, and 2 if nothing could be compared.
    """
    from ..studies.output import comparison, reading

    try:
        paths = [dataset_path(before), dataset_path(after)]
        with opened(paths[0]) as one, opened(paths[1]) as other, reading.guarded(f"{paths[0]}, {paths[1]}"):
            given = comparison.Tolerance(comparison.RELATIVE if relative is None else relative, absolute)
            found = comparison.compare(one, other, given, groups, ignored, None if every else rows)
            if as_json:
                click.echo(json.dumps(as_dict(found, paths, config), indent=1))
            else:
                click.echo(comparison_text(found, paths, None if every else rows, config))
    except (OSError, ValueError) as error:
        raise Trouble(shown(error)) from None
    if found.different:
        raise click.exceptions.Exit(DIFFERENT)


@contextmanager
def opened(path: Path) -> "Iterator[xr.DataTree]":
    """Context of an open dataset."""
    from ..studies.output import reading

    reading.check_opens(path)
    with reading.open(path) as tree:
        yield tree


# -- text --------------------------------------------------------------------------------------------------------------


def comparison_text(found: "Comparison", paths: Sequence[Path], most: int | None = ROWS, config: bool = False) -> str:
    """Comparison as text."""
    width = max(map(len, COMPARED)) + 1
    head = [f"{f'{side}:':{width}} {path}" for side, path in zip(COMPARED, paths)]
    parts = [[*head, _summary(found)]]
    for group in found.groups:
        parts += _of_group(group, most)
    changes = found.changes
    if changes:
        parts.append(_changes(found, changes, most))
    if found.attributes or found.config:
        parts.append(_told(found, config))
    return paragraphs(parts)


def _summary(found: "Comparison") -> str:
    """Summary in one line."""
    said = [f"group {path} only {side}" for side, own in zip(COMPARED, found.alone) for path in own]
    for number, side in enumerate(COMPARED):
        for group in found.groups:
            count, what = group.cells[number].count, "scenes" if group.name == "/" else f"cells of {group.name}"
            said += [f"{count} {what} only {side}"] if count else []
    statuses = sum(one.changed for group in found.groups for one in group.flags)
    values = sum(one.changed for group in found.groups for one in group.values)
    unlike = sum(len(group.unlike) + sum(map(len, group.variables)) for group in found.groups)
    said += [f"{statuses} statuses changed"] if statuses else []
    said += [f"{values} values changed"] if values else []
    said += [f"{unlike} variables are not in both, or cannot be compared"] if unlike else []
    compared = sum(one.compared for group in found.groups for one in (*group.flags, *group.values))
    if said:
        return f"different: {', '.join(said)}; {compared} values compared"
    if found.different:
        return f"different: labels; {compared} values compared"
    return f"the same: {compared} values compared"


def _of_group(group: "GroupChanges", most: int | None) -> Iterator[list[str]]:
    """Paragraphs on the labels, cells, variables and statuses of a group."""
    what = "scenes" if group.name == "/" else f"cells of {group.name}"
    lines = []
    for name, both in group.labels.items():
        for side, own in zip(COMPARED, both):
            shown = own[:most]
            if own:
                said = ", ".join(_place(group, {name: label}) for label in shown)
                more = f", and {len(own) - len(shown)} more" if len(own) > len(shown) else ""
                lines.append(f"  {name} only {side}: {said}{more}")
    if lines:
        yield [f"labels of {group.name}", *lines]
    for side, alone in zip(COMPARED, group.cells):
        if alone.count:
            lines = [f"  {_place(group, labels)}" for labels in alone.rows]
            yield [f"{what} only {side}: {alone.count}", *lines, *_more(alone.count - len(lines))]
    lines = [f"  {name} only {side}" for side, own in zip(COMPARED, group.variables) for name in own]
    lines += [f"  {name} {why}" for name, why in group.unlike.items()]
    if lines:
        yield [f"variables of {group.name}", *lines]
    for one in group.flags:
        if one.changed:
            rows = [
                [
                    f"  {_place(group, row.labels | row.point) or 'all'}",
                    f"{row.before or 'nothing'} -> {row.after or 'nothing'}",
                ]
                for row in one.rows
            ]
            yield [
                f"{variable_name(group.name, one.name)} changed: {one.changed} of {one.compared}",
                *aligned(rows, 0).splitlines(),
                *_more(one.changed - len(rows)),
            ]


def _place(group: "GroupChanges", labels: "Mapping[str, str | float]") -> str:
    """Labels of dimensions with several labels, for readers."""
    return cell_text({name: label for name, label in labels.items() if group.sizes[name] > 1}, group.units)


def _changes(found: "Comparison", changes: "list[Change]", most: int | None) -> list[str]:
    """Number of changes by variable, and the largest changes."""
    head = ["  variable", "cells", "changed", "largest change"]
    counts = [
        [f"  {variable_name(group.name, one.name)}", one.compared, one.changed, _largest(one.rows)]
        for group in found.groups
        for one in group.values
        if one.changed
    ]
    axes = {group.name: group for group in found.groups}
    rows = [["  variable", *COMPARED, "change", "at"]]
    for row in changes[:most]:
        group = axes[row.group]
        at = _place(group, row.labels | row.point)
        rows.append(
            [f"  {variable_name(row.group, row.variable)}", _value(row.before), _value(row.after), _difference(row), at]
        )
    total = sum(one.changed for group in found.groups for one in group.values)
    return [
        "values that changed", *aligned([head, *counts], 0, (1, 2)).splitlines(), "",
        "the largest changes, measured by the tolerance", *aligned(rows, 0, (1, 2, 3)).splitlines(),
        *_more(total - len(rows) + 1),
    ]  # fmt: skip


def _largest(rows: "list[Change]") -> str:
    """Largest change, preferably a number."""
    return _difference(next((row for row in rows if math.isfinite(row.difference)), rows[0]))


def _told(found: "Comparison", config: bool) -> list[str]:
    """Differences of attributes and of the studies' files."""
    lines = ["told, and no difference of results"]
    rows = [[f"  {name}", f"{_short(old)} -> {_short(new)}"] for name, (old, new) in found.attributes.items()]
    lines += aligned(rows, 0).splitlines()
    if found.config:
        less, more = (sum(line.startswith(sign) for line in found.config[2:]) for sign in "-+")
        told = "" if config else "; --config shows them"
        lines.append(f"  the studies' files: {less} lines less, {more} more{told}")
        lines += found.config if config else []
    return lines


def _short(text: str) -> str:
    return clipped(" ".join(text.split()) or "none")


def _more(count: int) -> list[str]:
    """Line on rows that are left out, if any."""
    return [f"  and {count} more; --all shows them"] if count > 0 else []


def _value(value: float | str) -> str:
    if isinstance(value, str):
        return _short(value) if value else "nothing"
    return "nothing" if math.isnan(value) else f"{value:.9g}"


def _difference(row: "Change") -> str:
    """Difference with unit, and as a share of the former number."""
    number = row.difference
    if not math.isfinite(number):
        return "gone" if row.after == "" or row.after != row.after else "new" if row.before != row.before else ""
    units = "" if row.units in ("", "1") else f" {row.units}"
    before = float(row.before)
    share = f" ({100 * number / abs(before):+.2g} %)" if before and units else ""
    return f"{number:+.3g}{units}{share}"


# -- JSON --------------------------------------------------------------------------------------------------------------


def as_dict(found: "Comparison", paths: Sequence[Path], config: bool = False) -> dict[str, object]:
    """Comparison as a dict for JSON."""
    return {
        "different": found.different,
        "before": str(paths[0]),
        "after": str(paths[1]),
        "groups_only_before": found.alone[0],
        "groups_only_after": found.alone[1],
        "groups": {group.name: _group_dict(group) for group in found.groups},
        "attributes": {name: {"before": old, "after": new} for name, (old, new) in found.attributes.items()},
    } | ({"config": found.config} if config else {})


def _group_dict(group: "GroupChanges") -> dict[str, object]:
    made: dict[str, object] = {
        "labels": {
            name: {f"only_{side}": own for side, own in zip(COMPARED, both)} for name, both in group.labels.items()
        },
        "cells_in_both": group.both,
    }
    for side, alone, names in zip(COMPARED, group.cells, group.variables):
        made[f"cells_only_{side}"] = {"count": alone.count, "rows": alone.rows}
        made[f"variables_only_{side}"] = names
    made["not_comparable"] = group.unlike
    for part, found in (("status", group.flags), ("values", group.values)):
        made[part] = {
            one.name: {"compared": one.compared, "changed": one.changed, "rows": [_row_dict(row) for row in one.rows]}
            for one in found
            if one.changed
        }
    return made


def _row_dict(row: "Change") -> dict[str, object]:
    def plain(value: float | str) -> float | str | None:
        return value if isinstance(value, str) or math.isfinite(value) else None

    found: dict[str, object] = {**row.labels, **row.point}
    return {
        "at": found, "before": plain(row.before), "after": plain(row.after), "difference": plain(row.difference),
        "over_tolerance": plain(row.excess), "units": row.units,
    }  # fmt: skip
