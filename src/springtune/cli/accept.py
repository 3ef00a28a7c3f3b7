"""What is accepted as right of a study, kept beside it, and what departs from that."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..safe_io.escapes import shown
from .diff import DIFFERENT, Trouble, comparison_text, opened, tolerance
from .examples import examples
from .folders import CONFIG_FOLDER, RESULTS_FOLDER, dataset_path
from .options import WrongCall

if TYPE_CHECKING:
    import xarray as xr

EXPECTED_FOLDER = CONFIG_FOLDER / "expected"

LISTED_UNSOLVED = 10
"""Scenes without solution that are listed by name."""


@click.command(
    epilog=examples(
        "springtune accept results/mine",
        "springtune accept mine --variables displacement,sensitivity/displacement --relative 1e-4",
        "springtune accept --check",
        "springtune accept --check mine --to config/expected/mine.nc",
    )
)
@click.argument("results", required=False)
@click.option(
    "--to",
    "target",
    type=click.Path(path_type=Path),
    help="File: .yaml, or .nc.  [default: config/expected/<study>.yaml]",
)
@click.option("--check", is_flag=True, help="Compare results with what is accepted; of all studies without RESULTS.")
@click.option("--variables", default="", help="Names with commas between, such as sensitivity/displacement.")
@click.option("--relative", callback=tolerance, help="Tolerance of all values.  [default: that of the file, else 1e-6]")
@click.option("--absolute", callback=tolerance, help="The same, in SI units.")
@click.option("--unsolved", is_flag=True, help="Accept that scenes are not solved.")
@click.option("--all", "every", is_flag=True, help="With --check, all rows.")
def accept(
    results: str | None,
    target: Path | None,
    check: bool,
    variables: str,
    relative: float | None,
    absolute: float | None,
    unsolved: bool,
    every: bool,
) -> None:
    """Keep values and whole curves of a study as right, or say what departs from them.

    RESULTS is results/<study>, its dataset.nc, or the name of a study. What is accepted is a file to be kept with the
    study and reviewed as code is: a line a scene, with its status, displacement, error and stiffness, and one a curve.
    Tolerances in it are yours: of all values, of a variable, of a line. Accepting anew says what changes, and keeps
    them. Scenes that are not solved are listed and refused without --unsolved.

    With --check, exits with 0 if all is as accepted, 1 if anything departs, and 2 if nothing could be compared.
    """
    if check:
        if variables or relative is not None or absolute is not None or unsolved:
            raise click.UsageError("--check takes variables and tolerances from the file; edit that")
        _check(results, target, every)
        return
    if results is None:
        raise click.UsageError("name the results to accept: springtune accept results/mine")
    names = [name.strip() for name in variables.split(",") if name.strip()]
    try:
        _accept(dataset_path(results), target, names, relative, absolute, unsolved)
    except (OSError, ValueError) as error:
        if str(error).startswith("--"):  # an option names what is not there
            raise WrongCall(shown(error)) from None
        raise click.ClickException(shown(error)) from None


def _accept(
    path: Path, target: Path | None, names: list[str], relative: float | None, absolute: float | None, unsolved: bool
) -> None:
    from ..studies.output import comparison, expected, reading

    with opened(path) as tree, reading.guarded(path):
        if expected.ACCEPTED in tree.attrs:
            raise ValueError(f"{path}: holds accepted values; give the results of a study")
        holes = expected.unsolved(tree)
        if holes:
            _tell_unsolved(holes)
            if not unsolved:
                raise ValueError(f"{path}: nothing is accepted; mend these, or accept that they are so with --unsolved")
        target = target or _usual_target(str(tree.attrs.get("study", path.parent.name)))
        former = expected.read(target) if target.exists() else None
        made = expected.accepted(tree, names or (_names(former) if former is not None else []))
    if former is not None:
        made = expected.with_tolerances_of(made, former)
    if relative is not None or absolute is not None:
        own = expected.tolerances(made)
        before = own.get("", comparison.Tolerance())
        given = comparison.Tolerance(
            before.relative if relative is None else relative, before.absolute if absolute is None else absolute
        )
        made = expected.with_tolerances(made, own | {"": given})
    if former is not None:
        found = comparison.compare(former, made, groups=(), own=expected.tolerances(former), most=20)
        click.echo(comparison_text(found, (target, path), sides=("accepted", "now")))
    expected.write(target, made)
    click.echo(
        f"{target}: {_count(made)} accepted of {path}; keep it with the study, and `springtune accept --check` compares"
    )


def _usual_target(study: str) -> Path:
    """Where the expected values of a study are, or will be."""
    found = [EXPECTED_FOLDER / f"{study}{ending}" for ending in (".yaml", ".nc")]
    return next((path for path in found if path.exists()), found[0])


def _names(tree: "xr.DataTree") -> list[str]:
    """Names of the variables of expected values."""
    from ..studies.output.comparison import OF_CELLS, variable_name

    nodes = [(node.path, str(name)) for node in tree.subtree for name in node.data_vars]
    return [variable_name(path, name) for path, name in nodes if name != OF_CELLS]


def _count(tree: "xr.DataTree") -> str:
    """How many scenes and other cells."""
    from ..studies.output.expected import cells

    counts = cells(tree).items()
    return ", ".join(f"{count} scenes" if path == "/" else f"{count} of {path}" for path, count in counts)


def _tell_unsolved(holes: list[tuple[str, str, str, str]]) -> None:
    """Say which cells are not solved."""
    click.echo(f"{len(holes)} are not solved:", err=True)
    for group, place, status, why in holes[:LISTED_UNSOLVED]:
        head = "" if group == "/" else f"{group}: "
        click.echo(shown(f"  {head}{place}: {status}{f', {why}' if why else ''}"), err=True)
    if len(holes) > LISTED_UNSOLVED:
        click.echo(f"  and {len(holes) - LISTED_UNSOLVED} more", err=True)


def _check(results: str | None, target: Path | None, every: bool) -> None:
    """Compare, and exit as diff does."""
    from ..studies.output import comparison, expected, reading

    try:
        if results is None:
            files = (
                [target]
                if target
                else [path for ending in expected.EXPECTED_ENDINGS for path in EXPECTED_FOLDER.glob(f"*{ending}")]
            )
            if not files:
                raise ValueError(
                    f"{EXPECTED_FOLDER}: nothing is accepted; call `springtune accept results/<study>` first"
                )
        else:
            files = [target or _usual_target(dataset_path(results).parent.name)]
        departed = False
        for file in sorted(files):
            kept = expected.read(file)
            path = dataset_path(results or str(RESULTS_FOLDER / kept.attrs[expected.ACCEPTED]))
            with opened(path) as tree, reading.guarded(path):
                found = comparison.compare(
                    kept, tree, own=expected.tolerances(kept), part=True, most=None if every else 20
                )
            departed |= found.different
            click.echo(comparison_text(found, (file, path), sides=("accepted", "now")))
    except (OSError, ValueError) as error:
        raise Trouble(shown(error)) from None
    if departed:
        raise click.exceptions.Exit(DIFFERENT)
