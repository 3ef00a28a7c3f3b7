"""Commands for studies: new, scenes, definitions, split, merge and schema."""

import os
from pathlib import Path
from string import Template

import click

from ..registry import NAME, NAME_RULE
from ..safe_io.atomic import write_text
from ..safe_io.tables import aligned
from ..studies.runs.source import CONFIG_FOLDER, config_file, is_source_tree
from . import WrongCall, examples, studies_here
from .options import allow, loaded, max_scenes


@click.command(
    epilog=examples(
        "springtune new my-study", "springtune new studies/my-study.yaml", "springtune new my-plate --shape"
    )
)
@click.argument("study")
@click.option("--shape", is_flag=True, help="A study of a shape, an outline with a hole, rather than of a beam.")
def new(study: str, shape: bool) -> None:
    """Write a small study with comments, to be changed into your own; it runs as it is.

    STUDY is its name, or the path of its file. A name alone becomes config/<name>.yaml in a checkout, and <name>.yaml
    elsewhere. What is there already is never overwritten.
    """
    path = _path(study)
    if not NAME.fullmatch(path.stem):
        raise WrongCall(f"'{path.stem}' cannot name a study; {NAME_RULE}")
    if os.path.lexists(path):
        raise click.ClickException(f"{path}: is there already; give another name, or change that file")
    if not path.parent.is_dir():
        raise click.ClickException(f"{path.parent}: there is no such folder; make it, or name another")
    try:
        write_text(path, template_text(path, "shape" if shape else "beam"))
    except OSError as error:
        why = error.strerror or error
        raise click.ClickException(f"{path}: cannot be written: {why}; name another place") from None
    if not path.resolve().is_relative_to(Path.cwd().resolve()):
        click.echo(f"written outside of this folder: {path.resolve()}")
    scenes = 4 if shape else 2
    click.echo(f"{path}: {scenes} scenes; change it as you like, and run it:\n  springtune run {path}")


def _path(given: str) -> Path:
    """Path of a new study."""
    path = Path(given)
    if path.suffix not in (".yaml", ".yml"):
        if not path.name:
            return path
        path = path.with_name(f"{path.name}.yaml")
        path = CONFIG_FOLDER / path if given == path.stem and is_source_tree(Path()) else path
    return path


def template_text(path: Path, body: str) -> str:
    """Text of a new study of a beam or of a shape."""
    from ..mesh import MESH_TYPES

    schema = Path(os.path.relpath(config_file(SCHEMA), path.parent)).as_posix()
    words = path.stem.replace("-", " ").replace("_", " ").strip() or path.stem
    template = Template(Path(__file__).with_name(f"study_of_a_{body}.yaml").read_text())
    text = template.substitute(
        path=path.as_posix(),
        title=words[0].upper() + words[1:],
        mesh_types=", ".join(name for name in MESH_TYPES if name.isalpha() and name != "structured"),
    )
    return f"# yaml-language-server: $schema={schema}\n{text}"


@click.command(
    epilog=examples(
        "springtune scenes config/paper.yaml",
        "springtune scenes --max-scenes 2000000 config/large.yaml",
    )
)
@max_scenes
@click.argument("config", type=click.Path(path_type=Path), shell_complete=studies_here)
def scenes(config: Path, most: int | None) -> None:
    """Say what a study asks for, before anything runs.

    Counts scenes, meshes, references and curves, and what grids share. A study with mistakes is refused with the line
    of each.
    """
    allow(most)
    from ..studies.config.kind import kinds
    from ..studies.config.messages import StudyError
    from ..studies.kinds import load_study  # here, so that --help does not wait for it
    from ..studies.kinds.scenes.kind import summary

    try:
        study = load_study(config)
    except StudyError as error:
        click.echo(str(error), err=True)
        raise SystemExit(1) from None
    parts = [(kind, study.parts[kind.name]) for kind in kinds()]
    click.echo(summary(study, [row for kind, part in parts if part for row in kind.summary(part)]))


@click.command(
    epilog=examples(
        "springtune definitions | grep area",
    )
)
def definitions() -> None:
    """List the definitions of spring stiffness."""
    from .. import DEFINITIONS

    others = DEFINITIONS.packages
    rows = [
        [name, f"{one.summary} ({others[name]})" if name in others else one.summary]
        for name, one in DEFINITIONS.items()
    ]
    click.echo(aligned(rows, left=2))


BY = ("mesh", "grid")
"""As `springtune.studies.config.sections.DEALT_BY`, without its import."""

MOST_PARTS = 1000
"""As `springtune.studies.config.sections.MOST_PARTS`."""


@click.command(
    epilog=examples(
        "springtune split config/paper.yaml --into 3",
        "springtune split config/paper.yaml --into 2 --by grid --out parts",
    )
)
@max_scenes
@click.argument("config", type=click.Path(path_type=Path), shell_complete=studies_here)
@click.option("--into", "count", type=click.IntRange(2, MOST_PARTS), required=True, help="Number of parts.")
@click.option(
    "--by",
    type=click.Choice(BY),
    default=BY[0],
    show_default=True,
    help="What stays together: the scenes of a mesh, but of one that alone is more than a part; or those of a grid.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the parts; that of the study without.")
def split(config: Path, count: int, by: str, out: Path | None, most: int | None) -> None:
    """Write studies that together ask for the scenes of a study, each for its own.

    CONFIG is the study. Each part, config/<study>-1-of-3.yaml and so on, holds the whole study and says which part of
    it is asked for; it runs as any study does, at any site. `springtune merge` then puts their results together. Parts
    are about equal in what they are expected to cost; a section such as `laying` is in one of them.
    """
    allow(most)
    from ..studies.archive.parts import share_table, write_parts  # here, so that --help does not wait for it

    written = write_parts(loaded(config), count, by, config.parent if out is None else out)
    click.echo(aligned(share_table(written), left=0, right=(1, 2, 3)))
    parts = [part for part, _ in written]
    results = " ".join(f"results/{part.name}" for part in parts)
    click.echo(f"\nspringtune run {parts[0].path}   # and so on, each where it is to run; then, with all results in "
               f"one place,\nspringtune merge {config} {results}")  # fmt: skip


@click.command(
    epilog=examples(
        "springtune merge config/paper.yaml results/paper-1-of-2 results/paper-2-of-2",
        "springtune merge config/paper.yaml results/paper-1-of-2 --incomplete",
    )
)
@click.argument("config", type=click.Path(path_type=Path), shell_complete=studies_here)
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--incomplete", is_flag=True, help="Merge what is there; the study then computes the rest.")
def merge(config: Path, results: tuple[Path, ...], incomplete: bool) -> None:
    """Put the results of a study's parts together in results/<study>, so that its run computes no scene again.

    CONFIG is the whole study, RESULTS are the folders of its parts, which `springtune split` wrote, wherever they were
    computed. All files are compared with their checksums, and parts must be of this very study, computed by the same
    code, packages and Python; nothing is written before all fits. `st.merge` in Python joins datasets of different
    studies.
    """
    from ..studies.archive.parts import merge_sites, merge_text  # here, so that --help does not wait for it

    study = loaded(config)
    try:
        merged = merge_sites(study, results, incomplete)
    except OSError as error:
        raise click.ClickException(f"{error.filename}: {error.strerror}; the same command goes on from here") from None
    click.echo(merge_text(merged, results))
    click.echo(f"springtune run {config}   # collects the dataset" + (", and computes the rest" if merged.left else ""))


SCHEMA = "study.schema.json"


@click.command(epilog=examples("springtune schema > study.schema.json"))
def schema() -> None:
    """Print the JSON schema of studies, for editors."""
    from ..studies.config.sections import schema_text

    click.echo(schema_text(), nl=False)
