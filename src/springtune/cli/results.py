"""Commands for results: info, diff, export, browse, archive and docs."""

import math
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..registry import how_to_install
from ..safe_io import aligned, check_folder, clipped, shown
from ..studies.output.text import bytes_text, cell_text, paragraphs, variable_name
from ..studies.runs.source import CONFIG_FOLDER, workflow_folder
from . import PATH, WrongCall, command, file_errors

if TYPE_CHECKING:
    from ..studies.output.comparison import Change, Comparison, GroupChanges

ROWS = 20  # rows of a table

COMPARED = ("before", "after")


@command("springtune info results/paper", "springtune info dataset.nc --study > again.yaml")
@click.argument("path", type=PATH)
@click.option("--study", is_flag=True, help="Print the study that made the dataset, and nothing else.")
def info(path: Path, study: bool) -> None:
    """Show a dataset's scenes by status, errors, groups, versions and inputs.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading, summary

    if study:
        with reading.open(path) as tree:
            if "config" not in tree.attrs:
                raise click.ClickException(f"{path}: has no attribute 'config'; springtune did not write it")
            click.echo(tree.attrs["config"], nl=False)
        return
    click.echo(summary.info(path))


@command(
    "springtune export results/paper --to cells.csv",
    "springtune export results/paper --group sensitivity --to curves.parquet",
)
@click.argument("path", type=PATH)
@click.option("--to", "target", required=True, type=PATH, help="File: .csv or .parquet.")
@click.option("--group", default="/", show_default=True, help="Group of the table, such as sensitivity.")
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
def export(path: Path, target: Path, group: str, force: bool) -> None:
    """Write a group of a dataset as a long table, with a row for each combination of its labels.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading
    from ..studies.output.export import export as write

    with reading.open(path) as tree, reading.guard(path), file_errors(f"--to: {target}"):
        click.echo(write(tree, target, group, force))


@command("springtune browse results/paper")
@click.argument("path", type=PATH)
def browse(path: Path) -> None:
    """Open the page of a study's results in a browser, and print its path.

    PATH is results/<study>, or a file in it.
    """
    page = (path if path.is_dir() else path.parent) / "index.html" if path.exists() else path
    if not page.is_file():
        raise click.ClickException(f"{shown(page)}: there is no such page; run the study, which writes it")
    click.echo(str(page))
    click.launch(str(page))


@command("springtune archive results/paper", "springtune archive results/paper --out paper.zip")
@click.argument("folder", type=PATH)
@click.option("--out", type=PATH, help="Zip file to write.  [default: results/<study>.crate.zip]")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
def archive(folder: Path, out: Path | None, force: bool) -> None:
    """Pack the results of a study into one zip file for others.

    FOLDER is results/<study>. The file is an RO-Crate: the study with the files that it names, the dataset, page,
    figures, tables, the versions of all packages, and the SHA-256 of every file.
    """
    from ..studies.kinds import load_study
    from ..studies.runs.locks import claimed_study

    config = claimed_study(folder) or folder.parent.parent / CONFIG_FOLDER / f"{folder.name}.yaml"
    if not config.is_file():
        raise ValueError(f"{folder}: there is no {config}; give the results/<study> of a study that was run")
    if find_spec("rocrate") is None:
        raise click.ClickException(f"the library rocrate is missing; {how_to_install('archive')}")
    from ..studies.archive import pack

    target = out or folder.with_name(f"{folder.name}.crate.zip")
    if target.is_dir() or target.suffix != ".zip":
        raise click.UsageError(f"--out: {target} is no name of a zip file; give one such as {folder.name}.zip")
    if out:
        check_folder(out)
    if target.exists() and not force:
        raise click.ClickException(f"{target}: is there already; give --force, or another name by --out")
    with file_errors(f"--out: {target}"):
        names = pack(load_study(config), folder, target)
    click.echo(f"{target}: {len(names)} files, {bytes_text(target.stat().st_size)}")


@command("springtune docs")
def docs() -> None:
    """Print where the pages, the manual of studies and the examples are."""
    places = {"pages": "docs/README.md", "keys of a study": "config/README.md", "examples": "examples"}
    click.echo(aligned(((what, workflow_folder() / place) for what, place in places.items()), left=0))


# -- diff --------------------------------------------------------------------------------------------------------------


@command(
    "springtune diff results/before results/mine",
    "springtune diff before.nc results/mine --relative 1e-3 --group sensitivity",
)
@click.argument("before")
@click.argument("after")
@click.option(
    "--relative", type=click.FloatRange(0), default=1e-6, show_default=True, help="Tolerance of the larger number."
)
@click.option(
    "--absolute", type=click.FloatRange(0), help="Tolerance in SI units.  [default: 0; without unit, --relative]"
)
@click.option("--group", "groups", multiple=True, help="Group to compare, such as sensitivity; all by default.")
@click.option("--ignore", "ignored", multiple=True, help="Variables to leave out, such as 'reference_*'.")
@click.option("--rows", type=click.IntRange(1), default=ROWS, show_default=True, help="Rows of each table.")
def diff(
    before: str, after: str, relative: float, absolute: float | None, rows: int, **chosen: tuple[str, ...]
) -> None:
    """List the values that differ between two datasets by more than a tolerance.

    BEFORE and AFTER are results/<study>, or its dataset.nc. Scenes are matched by their labels. Numbers are equal
    within --relative or --absolute, and NaN equals NaN. Along a curve or over a field, --relative is of the largest
    number. Run times and other measurements of the machine are not compared. Versions and studies are printed, and
    are no difference.

    Exit codes: 0 nothing changed, 1 something changed, 2 nothing could be compared.
    """
    from ..studies.output import reading
    from ..studies.output.comparison import Tolerance, compare

    try:
        paths = [reading.dataset_file(before), reading.dataset_file(after)]
        with reading.open(paths[0]) as one, reading.open(paths[1]) as other, reading.guard(f"{paths[0]}, {paths[1]}"):
            found = compare(one, other, Tolerance(relative, absolute), most=rows, **chosen)
            click.echo(comparison_text(found, paths, rows))
    except (OSError, ValueError) as error:
        raise WrongCall(shown(error)) from None
    if found.different:
        raise click.exceptions.Exit(1)


def comparison_text(found: "Comparison", paths: Sequence[Path], most: int = ROWS) -> str:
    """Comparison as text."""
    groups = {group.name: group for group in found.groups}
    changed = [(group.name, one) for group in found.groups for one in (*group.flags, *group.values) if one.changed]
    parts = [[f"{f'{side}:':7} {path}" for side, path in zip(COMPARED, paths)]]
    parts[0].append(_summary(found, sum(one.changed for _, one in changed)))
    parts += [part for group in found.groups for part in _only_in_one(group, most)]
    if changed:
        counts: list[list[object]] = [["  variable", "cells", "changed", "largest change"]]
        for name, one in changed:
            largest = next((row for row in one.rows if math.isfinite(row.difference)), one.rows[0])
            counts.append([f"  {variable_name(name, one.name)}", one.compared, one.changed, _difference(largest)])
        flags = [row for group in found.groups for one in group.flags for row in one.rows]
        rows = [["  variable", *COMPARED, "change", "at"]]
        for row in [*flags[:most], *found.changes[:most]]:
            values = _value(row.before), _value(row.after), _difference(row)
            rows.append([f"  {variable_name(row.group, row.variable)}", *values, _place(groups[row.group], row.labels)])
        parts.append(["values that changed", *aligned(counts, 0, (1, 2)).splitlines()])
        table, more = aligned(rows, 0, (1, 2, 3)), _omitted(sum(one.changed for _, one in changed) + 1 - len(rows))
        parts.append(["the largest changes, measured by the tolerance", *table.splitlines(), *more])
    if found.attributes:
        attributes = [[f"  {name}", f"{_short(old)} -> {_short(new)}"] for name, (old, new) in found.attributes.items()]
        parts.append(["attributes that differ; they are no results", *aligned(attributes, 0).splitlines()])
    return paragraphs(parts)


def _summary(found: "Comparison", changed: int) -> str:
    """Summary in one line."""
    groups = found.groups
    counts = [f"group {path} only {side}" for side, own in zip(COMPARED, found.only_groups) for path in own]
    for number, side in enumerate(COMPARED):
        counts += [f"{len(g.cells[number])} {_cells(g.name)} only {side}" for g in groups if g.cells[number]]
    unlike = sum(len(group.unlike) + sum(map(len, group.variables)) for group in groups)
    counts += [f"{changed} values changed"] if changed else []
    counts += [f"{unlike} variables are only in one, or cannot be compared"] if unlike else []
    result = f"different: {', '.join(counts) or 'labels'};" if found.different else "the same:"
    return f"{result} {sum(one.compared for group in groups for one in (*group.flags, *group.values))} values compared"


def _cells(group: str) -> str:
    return "scenes" if group == "/" else f"cells of {group}"


def _only_in_one(group: "GroupChanges", most: int) -> Iterator[list[str]]:
    """Paragraphs on labels, cells and variables of a group that only one dataset has."""
    labels = []
    for name, both in group.labels.items():
        for side, own in zip(COMPARED, both):
            names = ", ".join(_place(group, {name: label}) for label in own[:most])
            more = f", and {len(own) - most} more" if len(own) > most else ""
            labels += [f"  {name} only {side}: {names}{more}"] if own else []
    if labels:
        yield [f"labels of {group.name}", *labels]
    for side, cells in zip(COMPARED, group.cells):
        if cells:
            lines = [f"  {_place(group, one)}" for one in cells[:most]]
            yield [f"{_cells(group.name)} only {side}: {len(cells)}", *lines, *_omitted(len(cells) - len(lines))]
    variables = [f"  {name} only {side}" for side, own in zip(COMPARED, group.variables) for name in own]
    if variables or group.unlike:
        yield [f"variables of {group.name}", *variables, *(f"  {name} {why}" for name, why in group.unlike.items())]


def _place(group: "GroupChanges", labels: "Mapping[str, str | float]") -> str:
    """Return the labels of a cell as text, without dimensions of one label."""
    return cell_text({name: label for name, label in labels.items() if group.sizes[name] > 1}, group.units)


def _short(text: str) -> str:
    return clipped(" ".join(text.split()) or "none")


def _omitted(count: int) -> list[str]:
    """Return a line on rows that are left out, or an empty list."""
    return [f"  and {count} more; --rows shows them"] if count > 0 else []


def _value(value: float | str) -> str:
    if isinstance(value, str):
        return _short(value) if value else "nothing"
    return "nothing" if math.isnan(value) else f"{value:.9g}"


def _difference(row: "Change") -> str:
    """Difference with unit, and as a share of the former number."""
    number = row.difference
    if not math.isfinite(number):
        return "removed" if row.after == "" or row.after != row.after else "new" if row.before != row.before else ""
    units = "" if row.units in ("", "1") else f" {row.units}"
    before = float(row.before)
    share = f" ({100 * number / abs(before):+.2g} %)" if before and units else ""
    return f"{number:+.3g}{units}{share}"
