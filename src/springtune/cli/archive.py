"""A finished study as one file: to be cited, checked, and computed again."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .examples import examples
from .folders import studies

if TYPE_CHECKING:
    from ..studies.archive.contents import Contents


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
    from ..studies.config.messages import StudyError

    try:
        [(found, folder)] = studies(study)
    except StudyError as error:
        raise click.ClickException(str(error)) from None
    try:
        import rocrate  # noqa: F401
    except ImportError:
        raise click.ClickException(
            "the library rocrate is missing; install the extra: pip install 'springtune[archive]'"
        ) from None
    from ..studies.archive.archive import write
    from ..studies.archive.contents import ArchiveError, stored_size
    from ..studies.archive.crate import CitationError

    target = out or folder.with_name(f"{folder.name}.crate.zip")
    if target.is_dir() or target.suffix != ".zip":
        raise click.UsageError(f"--out: {target} is no name of a zip file; give one such as {folder.name}.zip")
    if target.exists() and not force:
        raise click.ClickException(f"{target}: is there already; give --force, or another name by --out")
    try:
        if with_store:
            click.echo(f"the store: {_size(stored_size(found, folder))} more, before it is packed")
        chosen = {name: True for name, given in (("no_diff", no_diff), ("no_host", no_host)) if given}
        digest = write(found, folder, target, with_store, untracked, chosen, _tell)
    except (ArchiveError, CitationError) as error:
        raise click.ClickException(str(error)) from None
    except OSError as error:
        raise click.ClickException(
            f"{error.filename or target}: cannot be written: {error.strerror or error}"
        ) from None
    click.echo(f"{target}: {_size(target.stat().st_size)}, sha256 {digest}")
    click.echo(f"check it: springtune verify {target}; compute it again: springtune verify {target} --reproduce")


def _tell(found: "Contents") -> None:
    """Say what is packed, and what somebody should know who computes it again."""
    from ..studies.archive.contents import DIFF, FOLDERS

    click.echo(f"{found.folder}: packing {len(found.files)} files, {_size(found.size)}")
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


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count < 1e9 else f"{count / 1e9:.1f} GB"
