"""Whether an archive is what was packed, and whether it can be computed again."""

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..safe_io.escapes import shown
from ..studies.output.text import aligned

if TYPE_CHECKING:
    from ..studies.archive.reproduction import Checked, Reproduced

TOLD = 20
"""Most files that are told with a fault."""


def verified(path: Path, again: bool, fresh: bool) -> bool:
    """Tell of an archive."""
    from ..studies.archive.reproduction import ReproductionError, check, reproduce

    try:
        found = check(path)
    except ReproductionError as error:
        raise click.ClickException(shown(error)) from None
    except OSError as error:
        raise click.ClickException(shown(f"{path}: cannot be read ({error.strerror}); give an archive")) from None
    _tell(found)
    if found.faults:
        if again:
            click.echo("  it is not computed again: it is not what was packed; get it again")
        return False
    if not again:
        click.echo(
            f"its numbers are not computed again; `springtune verify {path} --reproduce` does that, by the program in "
            f"it: the last runs of its jobs took {found.seconds:.0f} s, without what was stored before"
        )
        return True
    try:
        with tempfile.TemporaryDirectory() as folder:
            return _compared(reproduce(found, Path(folder), fresh, click.echo))
    except (ReproductionError, OSError, ValueError) as error:
        raise click.ClickException(shown(f"{path}: not reproduced: {error}")) from None


def _tell(found: "Checked") -> None:
    click.echo(shown(f"{found.path}: {found.title}, study {found.study}, springtune {found.version}"))
    click.echo(f"  sha256 {found.sha256}")
    click.echo(f"  {found.files} files compared with their checksums, faults: {len(found.faults)}")
    rows = [[name, why] for name, why in sorted(found.faults.items())]
    if rows:
        click.echo(aligned(rows[:TOLD], 4))
        if len(rows) > TOLD:
            click.echo(f"    and {len(rows) - TOLD} more")


def _compared(made: "Reproduced") -> bool:
    """Tell of two datasets; whether they are the same, as far as they can be."""
    for name, (before, after) in made.others.items():
        click.echo(shown(f"  {name}: {before} in the archive, {after} here"))
    from ..studies.output.comparison import RELATIVE

    if made.ended_otherwise:
        click.echo(
            f"  {made.ended_otherwise} cases of the benchmark ended otherwise, by this machine's speed or programs: "
            "the group /benchmark is not compared"
        )
    exact, near = made.exact, made.near
    count = sum(one.compared for group in exact.groups for one in (*group.flags, *group.values))
    if not exact.different:
        click.echo(f"reproduced: {count} values are the same, bit by bit")
        return True
    changed = sum(one.changed for group in exact.groups for one in (*group.flags, *group.values))
    if made.same:
        click.echo(
            f"reproduced to rounding: {changed} of {count} values differ, none by more than {RELATIVE:g} of its size; "
            "other software or another processor rounds in another order (docs/robustness.md)"
        )
        return True
    from .diff import comparison_text

    click.echo(
        comparison_text(
            near if near.different else exact, [Path("the archive"), Path("computed again")], ("before", "after"), 5
        )
    )
    if not made.others:
        click.echo("  software and machine are the same, so all bits should be")
    click.echo("not reproduced: the values above differ")
    return False
