"""Command diff: compare two datasets."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..safe_io.escapes import clipped, shown
from ..safe_io.tables import aligned
from ..studies.output.text import cell_text, paragraphs, variable_name
from . import WrongCall, examples
from .options import dataset_path

if TYPE_CHECKING:
    from ..studies.output.comparison import Change, Comparison, GroupChanges

ROWS = 20
"""Rows of a table."""

COMPARED = ("before", "after")


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
) -> None:
    """Say what changed from one dataset to another beyond a tolerance, scene by scene.

    BEFORE and AFTER are results/<study>, its dataset.nc, or the name of a study. Scenes are matched by their labels, in
    whatever order. Numbers are the same within --relative or --absolute, and NaN is NaN; along a curve or over a field
    --relative is of its largest number. Seconds, what is measured of the machine, when and where a dataset was made are
    not compared; versions and the studies' files are told and make no difference.

    Exits with 0 if nothing changed, 1 if something did, and 2 if nothing could be compared.
    """
    from ..studies.output import reading
    from ..studies.output.comparison import RELATIVE, Tolerance, compare

    try:
        paths = [dataset_path(before), dataset_path(after)]
        with (
            reading.open(paths[0]) as one,
            reading.open(paths[1]) as other,
            reading.guarded(f"{paths[0]}, {paths[1]}"),
        ):
            given, most = Tolerance(RELATIVE if relative is None else relative, absolute), None if every else rows
            found = compare(one, other, given, groups, ignored, most)
            click.echo(comparison_text(found, paths, most, config))
    except (OSError, ValueError) as error:
        raise WrongCall(shown(error)) from None
    if found.different:
        raise click.exceptions.Exit(1)


def comparison_text(found: "Comparison", paths: Sequence[Path], most: int | None = ROWS, config: bool = False) -> str:
    """Comparison as text."""
    width = max(map(len, COMPARED)) + 1
    head = [f"{f'{side}:':{width}} {path}" for side, path in zip(COMPARED, paths)]
    parts = [[*head, _summary(found)]]
    for group in found.groups:
        parts += _of_group(group, most)
    if changes := found.changes:
        parts.append(_changes(found, changes, most))
    if found.attributes or found.config:
        parts.append(_told(found, config))
    return paragraphs(parts)


def _summary(found: "Comparison") -> str:
    """Summary in one line."""
    groups = found.groups
    said = [f"group {path} only {side}" for side, own in zip(COMPARED, found.alone) for path in own]
    for number, side in enumerate(COMPARED):
        alone = [(group.cells[number].count, group.name) for group in groups]
        said += [f"{count} {_cells(name)} only {side}" for count, name in alone if count]
    counts = {
        "statuses changed": sum(one.changed for group in groups for one in group.flags),
        "values changed": sum(one.changed for group in groups for one in group.values),
        "variables are not in both, or cannot be compared": sum(
            len(group.unlike) + sum(map(len, group.variables)) for group in groups
        ),
    }
    said += [f"{count} {what}" for what, count in counts.items() if count]
    result = f"different: {', '.join(said) or 'labels'}" if found.different else "the same"
    compared = sum(one.compared for group in groups for one in (*group.flags, *group.values))
    return f"{result}{';' if found.different else ':'} {compared} values compared"


def _cells(group: str) -> str:
    return "scenes" if group == "/" else f"cells of {group}"


def _of_group(group: "GroupChanges", most: int | None) -> Iterator[list[str]]:
    """Paragraphs on the labels, cells, variables and statuses of a group."""
    lines = []
    for name, both in group.labels.items():
        for side, own in zip(COMPARED, both):
            if own:
                said = ", ".join(_place(group, {name: label}) for label in own[:most])
                more = f", and {len(own) - most} more" if most and len(own) > most else ""
                lines.append(f"  {name} only {side}: {said}{more}")
    if lines:
        yield [f"labels of {group.name}", *lines]
    for side, alone in zip(COMPARED, group.cells):
        if alone.count:
            lines = [f"  {_place(group, labels)}" for labels in alone.rows]
            yield [f"{_cells(group.name)} only {side}: {alone.count}", *lines, *_more(alone.count - len(lines))]
    lines = [f"  {name} only {side}" for side, own in zip(COMPARED, group.variables) for name in own]
    lines += [f"  {name} {why}" for name, why in group.unlike.items()]
    if lines:
        yield [f"variables of {group.name}", *lines]
    for one in group.flags:
        if one.changed:
            rows = [
                (f"  {_place(group, row.labels) or 'all'}", f"{_value(row.before)} -> {_value(row.after)}")
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
    counts = [["  variable", "cells", "changed", "largest change"]]
    for group in found.groups:
        for one in group.values:
            if one.changed:
                largest = next((row for row in one.rows if math.isfinite(row.difference)), one.rows[0])
                counted = [str(one.compared), str(one.changed), _difference(largest)]
                counts.append([f"  {variable_name(group.name, one.name)}", *counted])
    axes = {group.name: group for group in found.groups}
    rows = [
        [
            f"  {variable_name(row.group, row.variable)}",
            *(_value(row.before), _value(row.after), _difference(row)),
            _place(axes[row.group], row.labels),
        ]
        for row in changes[:most]
    ]
    total = sum(one.changed for group in found.groups for one in group.values)
    return [
        "values that changed",
        *aligned(counts, 0, (1, 2)).splitlines(),
        "",
        "the largest changes, measured by the tolerance",
        *aligned([["  variable", *COMPARED, "change", "at"], *rows], 0, (1, 2, 3)).splitlines(),
        *_more(total - len(rows)),
    ]


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
