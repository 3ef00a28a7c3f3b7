"""Commands for results: info, export, clean, verify, browse and archive."""

import tempfile
from collections import defaultdict
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from ..registry import how_to_install
from ..safe_io.escapes import shown
from ..safe_io.tables import aligned
from ..studies.output.text import bytes_text
from . import examples
from .options import idle, studies

if TYPE_CHECKING:
    from ..studies.archive.contents import Contents
    from ..studies.archive.reproduction import Reproduced
    from ..studies.config.model import Study


@click.command(epilog=examples("springtune info results/paper"))
@click.argument("path", type=click.Path(path_type=Path))
def info(path: Path) -> None:
    """Say what a dataset holds: how its scenes ended, its errors, its groups, and where it comes from.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading, summing_up

    reading.check_opens(path)
    click.echo(summing_up.info(path))


@click.command(
    epilog=examples(
        "springtune export results/paper --to cells.csv",
        "springtune export results/paper --group sensitivity --select beam=200x30 --to curves.parquet",
        "springtune export results/paper --group fields --select beam=200x40,mesh_type=free --to network.nc",
        "springtune export results/paper --select beam=200x40,load=traction --to traction.pvd",
        "springtune export results/shapes --select shape=cook,definition=lattice --to cook.vtu",
    )
)
@click.argument("path", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "target",
    required=True,
    type=click.Path(path_type=Path),
    help="File: .csv, .parquet, .zarr, .nc, .vtu or .pvd.",
)
@click.option("--group", default="/", show_default=True, help="Group of the table, such as sensitivity.")
@click.option("--variables", default="", help="Names of variables, with commas between; all without.")
@click.option("--select", "pairs", multiple=True, help="Labels to keep, such as beam=200x40,mesh_size='5 mm'.")
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
def export(path: Path, target: Path, group: str, variables: str, pairs: tuple[str, ...], force: bool) -> None:
    """Write a dataset as a long table, one row a cell (CSV, Parquet), whole (Zarr), or one mesh with its fields (.nc).

    For ParaView: one scene with displacements, their error, and each spring's stiffness and force (.vtu), or a
    collection of all that are selected (.pvd); of shapes, by shape, load and definition, the networks that are drawn.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading
    from ..studies.output.export import export as write
    from ..studies.output.export import selected

    names = [name.strip() for name in variables.split(",") if name.strip()]
    reading.check_opens(path)
    with reading.open(path) as tree, reading.guarded(path):
        click.echo(write(tree, target, group, names, selected(pairs), force))


LISTED = 12
"""Most files that are listed by folder."""


@click.command(epilog=examples("springtune clean config/paper.yaml", "springtune clean results/paper --remove"))
@click.argument("study", required=False, type=click.Path(path_type=Path))
@click.option("--remove", is_flag=True, help="Remove what is listed.")
def clean(study: Path | None, remove: bool) -> None:
    """List what lies in results/<study> and the study no longer asks for; nothing else is touched.

    STUDY is its YAML file, or results/<study>; without it, all folders in results. Figures and tables of values that
    were taken out, their meshes and stored results, files of jobs that are no more, and what a run that was stopped
    left unfinished. Results that an edit of the code made stale are among them.
    """
    from ..studies.runs.rerun import orphans

    chosen = list(studies(study, "; nothing is listed or removed"))
    found = {folder: orphans(one, folder) for one, folder in chosen}
    for folder in found if remove else ():
        idle(folder)
    total, count = 0, 0
    for folder, paths in found.items():
        size = sum(path.stat().st_size for path in paths)
        total, count = total + size, count + len(paths)
        click.echo(f"{folder}: {len(paths)} files, {bytes_text(size)}" if paths else f"{folder}: nothing to remove")
        by_folder = defaultdict(list)
        for path in paths:
            by_folder[path.parent].append(path)
        for parent, members in by_folder.items():
            for path in members[:LISTED]:
                click.echo(f"  {path.relative_to(folder)}  {bytes_text(path.stat().st_size)}")
            if len(members) > LISTED:
                click.echo(f"  {parent.relative_to(folder)}: and {len(members) - LISTED} more")
    if not remove:
        if count:
            again = " ".join(["springtune clean", *([str(study)] if study else []), "--remove"])
            click.echo(f"{count} files, {bytes_text(total)}; `{again}` removes them")
        return
    for folder, paths in found.items():
        for path in paths:
            path.unlink(missing_ok=True)
        for parent in sorted({path.parent for path in paths} - {folder}, reverse=True):  # deepest first
            if not any(parent.iterdir()):
                parent.rmdir()
    click.echo(f"removed {count} files, {bytes_text(total)}")


@click.command(
    epilog=examples(
        "springtune verify config/paper.yaml",
        "springtune verify results/paper --scenes 50",
        "springtune verify results/paper.crate.zip",
        "springtune verify results/paper.crate.zip --reproduce",
    )
)
@click.argument("study", required=False, type=click.Path(path_type=Path))
@click.option("--scenes", type=click.IntRange(0), default=5, show_default=True, help="Scenes to compute again.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of the drawing of these scenes.")
@click.option("--set-aside", is_flag=True, help="Rename damaged files, so that the next run makes them again.")
@click.option("--reproduce", is_flag=True, help="Compute an archive again, by the program that is in it.")
@click.option("--fresh", is_flag=True, help="Do so in a new environment, even where this one is the same.")
@click.pass_context
def verify(
    context: click.Context,
    study: Path | None,
    scenes: int,
    seed: int,
    set_aside: bool,
    reproduce: bool,
    fresh: bool,
) -> None:
    """Compare all results with their checksums, and compute some scenes again.

    STUDY is its YAML file, or results/<study>; without it, all folders in results. Every file is read: what the stages
    stored, dataset, tables, figures, page. The scenes are drawn from the dataset and computed by the config that it
    holds. Exits with 1 if anything is not as it was made; nothing is changed without --set-aside.

    STUDY may be an archive (springtune archive), of which all files are compared with their checksums. With --reproduce
    it is unpacked into a temporary folder and the whole study is run by the program in it, in this environment where
    that has the packages of its lock file and in a new one otherwise; the datasets are compared bit by bit, apart from
    times. That runs what somebody packed: do it with archives whose origin you trust.
    """
    if study is not None and study.suffix == ".zip":
        own = {"scenes", "seed", "set_aside"}
        given = [name for name in own if context.get_parameter_source(name) is ParameterSource.COMMANDLINE]
        if given:
            option = f"--{given[0].replace('_', '-')}"
            raise click.UsageError(
                f"{option} is for results, not for an archive, which --reproduce computes again wholly"
            )
        if not verified(study, reproduce or fresh, fresh):
            raise click.exceptions.Exit(1)
        return
    if reproduce or fresh:
        option = "--reproduce" if reproduce else "--fresh"
        raise click.UsageError(f"{option} is for an archive: springtune archive results/<study> makes one")
    if sum(_verified(one, folder, scenes, seed, set_aside) for one, folder in studies(study)):
        raise click.exceptions.Exit(1)


def _verified(study: "Study", folder: Path, scenes: int, seed: int, set_aside: bool) -> int:
    """Verify a study, and return the number of faults."""
    place = folder.parent.parent
    if place.resolve() != Path.cwd():
        raise click.ClickException(f"{folder}: files are named from where the study was run; call it there: cd {place}")
    from ..studies.archive import verify

    found = verify.files(study, folder)
    click.echo(f"{folder}: {found.compared} files compared with their checksums, faults: {len(found.faults)}")
    if found.faults:
        click.echo(aligned(map(list, found.faults), 2))
        if set_aside:
            idle(folder)
        for path in verify.set_aside(found) if set_aside else ():
            click.echo(shown(f"  set aside: {path}"))
        first = "" if set_aside else f"`springtune verify {study.path} --set-aside`, then "
        click.echo(f"  {first}`springtune run {study.path}` makes them again")
    if found.stale:
        click.echo(f"  out of date, since the study or the program changed: {', '.join(found.stale)}")
    aside = verify.left(folder)
    if aside:
        click.echo(
            f"  left behind: {len(aside)} of *.damaged, *.unfinished; `springtune clean {study.path}` lists them"
        )
    if not scenes:
        return len(found.faults)
    try:
        made = list(verify.again(folder, study.path.parent, scenes, seed))
    except (ValueError, OSError) as error:
        click.echo(f"no scene is computed again: {shown(error)}")
        return len(found.faults) + 1
    wrong = [one for one in made if not one.agrees]
    largest = max((one.difference for one in made if one.agrees), default=0.0)
    click.echo(
        f"{len(made)} scenes computed again (seed {seed}): {len(made) - len(wrong)} agree, "
        f"to {largest:.1e} of their numbers"
    )
    for one in wrong:
        change = f"{one.before}, now {one.after}" if one.before != one.after else f"differs by {one.difference:.1e}"
        click.echo(shown(f"  {one.labels}: {change}"))
    return len(found.faults) + len(wrong)


@click.command(
    epilog=examples(
        "springtune browse results/paper", "springtune browse results/paper/dataset.nc --port 8000 --no-open"
    )
)
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port; by default one that is free.")
@click.option("--no-open", is_flag=True, help="Print the address, and open no browser.")
def browse(dataset: Path, port: int, no_open: bool) -> None:
    """Browse a study's results: serve the page of a dataset to this machine alone, until Ctrl-C.

    DATASET is results/<study>/dataset.nc, or its folder. The address holds a token, anew each time.
    """
    from ..studies.output.browse.server import Server  # here, so that --help does not wait for it
    from ..studies.output.reading import check_opens

    check_opens(dataset)
    server = Server(dataset, port)
    try:
        with server:
            click.echo(f"{server.address}\nCtrl-C ends it.")
            if no_open:
                server.serve_forever()
            # All users of the machine see a browser's arguments, so the address goes through a private file.
            with tempfile.TemporaryDirectory(prefix="springtune-") as folder:
                way = Path(folder, "browse.html")
                way.write_text(f'<meta http-equiv="refresh" content="0; url={server.address}">')
                click.launch(str(way))
                server.serve_forever()
    except KeyboardInterrupt:
        click.echo()


@click.command(
    epilog=examples(
        "springtune archive results/paper",
        "springtune archive config/paper.yaml --out paper.zip",
    )
)
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Zip file to write.  [default: results/<study>.crate.zip]")
@click.option("--with-store", is_flag=True, help="Pack what the stages stored, too: meshes, references, solutions.")
@click.option(
    "--untracked", is_flag=True, help="Pack files of the program's folders that git ignores or does not know."
)
@click.option("--no-diff", is_flag=True, help="Leave out what differs from the commit, in the dataset, too.")
@click.option(
    "--no-host", is_flag=True, help="Leave out processor, cores and system; no machine's name is packed anyway."
)
@click.option("--force", is_flag=True, help="Write over a file that is there.")
def archive(
    study: Path, out: Path | None, with_store: bool, untracked: bool, no_diff: bool, no_host: bool, force: bool
) -> None:
    """Pack a finished study into one file from which another machine computes it again.

    STUDY is its YAML file, or results/<study>. The file is a zip and an RO-Crate: the study and the files that it
    names, package and rules with the versions of all packages, dataset, page, figures and tables, what each job took,
    authors and licence as CITATION.cff has them, and the SHA-256 of every file. Names of machines are left out. The
    same study makes the same file, bit by bit. A study that is not finished, or whose files are not as they were made,
    is refused.
    """
    [(found, folder)] = studies(study)
    if find_spec("rocrate") is None:
        raise click.ClickException(f"the library rocrate is missing; {how_to_install('archive')}")
    from ..studies.archive.contents import stored_size
    from ..studies.archive.crate import write

    target = out or folder.with_name(f"{folder.name}.crate.zip")
    if target.is_dir() or target.suffix != ".zip":
        raise click.UsageError(f"--out: {target} is no name of a zip file; give one such as {folder.name}.zip")
    if target.exists() and not force:
        raise click.ClickException(f"{target}: is there already; give --force, or another name by --out")
    if with_store:
        click.echo(f"the store: {bytes_text(stored_size(found, folder))} more, before it is packed")
    chosen = {name: True for name, given in (("no_diff", no_diff), ("no_host", no_host)) if given}
    digest = write(found, folder, target, with_store, untracked, chosen, _tell_contents)
    click.echo(f"{target}: {bytes_text(target.stat().st_size)}, sha256 {digest}")
    click.echo(f"check it: springtune verify {target}; compute it again: springtune verify {target} --reproduce")


def _tell_contents(found: "Contents") -> None:
    """Print what is packed, and what matters for computing it again."""
    from ..studies.archive.contents import DIFF, FOLDERS

    size = sum(one.size for one in found.files.values())
    click.echo(f"{found.folder}: packing {len(found.files)} files, {bytes_text(size)}")
    code = found.code
    if not code.commit:
        endings = "; ".join(f"{name}/ {', '.join(known)}" for name, known in FOLDERS.items())
        click.echo("  no git here: the program is packed as it is, by the endings of files, without hidden ones")
        click.echo(f"    {endings}")
    elif code.changed:
        parts = [DIFF] if DIFF in found.files else []
        parts += [f"files that git does not know: {', '.join(code.new)}"] if code.new else []
        told = ", with " + " and ".join(parts) if parts else ""
        click.echo(f"  the program is not that of its commit: packed as it is{told}")
    if code.left:
        why = "that git ignores or does not know" if code.commit else "that are others"
        click.echo(f"  left out, files {why} (--untracked packs them): {', '.join(code.left)}")
    if code.texts:
        click.echo(f"  packed as committed, since profiles are a user's own: {', '.join(sorted(code.texts))}")
    if found.departures:
        said = ", ".join(f"{name} {used} (locked: {locked})" for name, (locked, used) in found.departures.items())
        click.echo(f"  made with other versions than the lock file's, so others get the same to rounding only: {said}")
    if not found.machine and "host" not in found.untold:
        click.echo("  computed on other machines, at least in part, of which no cores and no processor are told")


TOLD = 20
"""Most faulty files that are listed."""


def verified(path: Path, again: bool, fresh: bool) -> bool:
    """Verify an archive; return whether it is sound, and reproduced if requested."""
    from ..studies.archive.reproduction import check, reproduce

    try:
        found = check(path)
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror}); give an archive") from None
    click.echo(shown(f"{found.path}: {found.title}, study {found.study}, springtune {found.version}"))
    click.echo(f"  sha256 {found.sha256}")
    click.echo(f"  {found.files} files compared with their checksums, faults: {len(found.faults)}")
    if found.faults:
        rows = [[name, why] for name, why in sorted(found.faults.items())]
        click.echo(aligned(rows[:TOLD], 4))
        if len(rows) > TOLD:
            click.echo(f"    and {len(rows) - TOLD} more")
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
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: not reproduced: {error}") from None


def _compared(made: "Reproduced") -> bool:
    """Print the comparison of two datasets; return whether they agree to rounding."""
    for name, (before, after) in made.others.items():
        click.echo(shown(f"  {name}: {before} in the archive, {after} here"))
    from ..studies.output.comparison import RELATIVE

    if made.ended_otherwise:
        click.echo(
            f"  {made.ended_otherwise} cases of the benchmark or engines ended otherwise, by this machine's speed or "
            "programs: these groups are not compared"
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

    found, sides = near if near.different else exact, [Path("the archive"), Path("computed again")]
    click.echo(comparison_text(found, sides, ("before", "after"), 5))
    if not made.others:
        click.echo("  software and machine are the same, so all bits should be")
    click.echo("not reproduced: the values above differ")
    return False
