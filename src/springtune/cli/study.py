"""Commands for studies: new, scenes and definitions."""

import os
from pathlib import Path
from string import Template

import click

from ..registry import NAME, NAME_RULE
from ..safe_io.atomic import write_text
from ..safe_io.tables import aligned
from ..studies.runs.source import CONFIG_FOLDER, config_file, is_source_tree
from . import WrongCall, examples


@click.command(
    epilog=examples(
        "springtune new my-study", "springtune new studies/my-study.yaml", "springtune new my-plate --shape"
    )
)
@click.argument("study")
@click.option("--shape", is_flag=True, help="A study of a shape, an outline with a hole, rather than of a beam.")
def new(study: str, shape: bool) -> None:
    """Write a small study with comments, which runs, for you to change.

    STUDY is its name, or the path of its file. A name alone becomes config/<name>.yaml in a checkout, and <name>.yaml
    elsewhere. Existing files are not overwritten.
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
    from ..mesh.types import MESH_TYPES

    schema = Path(os.path.relpath(config_file("study.schema.json"), path.parent)).as_posix()
    words = path.stem.replace("-", " ").replace("_", " ").strip() or path.stem
    template = Template(Path(__file__).with_name(f"study_of_a_{body}.yaml").read_text())
    text = template.substitute(
        path=path.as_posix(),
        title=words[0].upper() + words[1:],
        mesh_types=", ".join(name for name in MESH_TYPES if name.isalpha() and name != "structured"),
    )
    return f"# yaml-language-server: $schema={schema}\n{text}"


@click.command(
    epilog=examples("springtune scenes config/paper.yaml", "SPRINGTUNE_MAX_SCENES=2e6 springtune scenes large.yaml")
)
@click.argument("config", type=click.Path(path_type=Path))
def scenes(config: Path) -> None:
    """List a study's scenes and what they share, without running it.

    Counts scenes, meshes, references and curves of each grid. Mistakes are printed with their lines.
    """
    from ..studies.config.kind import kinds
    from ..studies.config.messages import StudyError
    from ..studies.kinds import load_study  # here, so that --help does not wait for it
    from ..studies.kinds.bodies.kind import summary

    try:
        study = load_study(config)
    except StudyError as error:
        click.echo(str(error), err=True)
        raise SystemExit(1) from None
    parts = [(kind, study.parts[kind.name]) for kind in kinds()]
    click.echo(summary(study, [row for kind, part in parts if part for row in kind.summary(part)]))


@click.command(epilog=examples("springtune definitions | grep area"))
def definitions() -> None:
    """List the definitions of spring stiffness."""
    from .. import DEFINITIONS

    others = DEFINITIONS.packages
    rows = [
        [name, f"{one.summary} ({others[name]})" if name in others else one.summary]
        for name, one in DEFINITIONS.items()
    ]
    click.echo(aligned(rows, left=2))
