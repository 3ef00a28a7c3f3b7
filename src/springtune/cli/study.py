"""Commands for studies: new, scenes and definitions."""

import os
from collections import Counter
from contextlib import suppress
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING

import click

from ..problem.quantities import nearest
from ..registry import NAME, NAME_RULE
from ..safe_io.atomic import write_bytes, write_text
from ..safe_io.tables import aligned
from ..studies.runs.source import CONFIG_FOLDER, TASKS, config_file, is_source_tree, workflow_folder
from . import WrongCall, examples

if TYPE_CHECKING:
    from ..studies.config.model import Study

MANUAL = "`springtune docs` prints where every key is explained"
"""Comment in new studies."""


@click.command(
    epilog=examples(
        "springtune new mine",
        "springtune new studies/mine.yaml",
        "springtune new plate --shape",
        "springtune new tables --from paper",
    )
)
@click.argument("study")
@click.option("--shape", is_flag=True, help="A study of a shape, an outline with a hole, rather than of a beam.")
@click.option("--from", "source", help="Copy a study that comes along, with its files, such as paper or shapes.")
def new(study: str, shape: bool, source: str | None) -> None:
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
    if shape and source:
        raise WrongCall(f"--shape means nothing beside --from {source}; leave one of the two out")
    try:
        if source:
            _copy(source, path)
        else:
            write_text(path, template_text(path, "shape" if shape else "beam"))
    except OSError as error:
        why = error.strerror or error
        raise click.ClickException(f"{path}: cannot be written: {why}; name another place") from None
    scenes = "" if source else "4 scenes; " if shape else "2 scenes; "
    click.echo(f"{path}: {scenes}change it as you like, and run it:\n  springtune run {path}")


def _copy(name: str, path: Path) -> None:
    """Copy a study that comes along, and the files that it names, none of which is overwritten."""
    from ..studies.kinds import load_study
    from ..studies.runs.provenance import input_files

    folder = workflow_folder() / CONFIG_FOLDER
    known = sorted(one.stem for one in folder.glob("*.yaml"))
    if name not in known:
        raise WrongCall(f"--from: '{name}' is no study that comes along; {nearest(name, known)}")
    study = load_study(folder / f"{name}.yaml")
    copies = {path.parent / file.relative_to(folder): file for file in input_files(study) if file != study.path}
    for copy, file in copies.items():
        if copy.exists() and copy.read_bytes() != file.read_bytes():
            raise click.ClickException(f"{copy}: is there already, and is not that of '{name}'; name another folder")
    for copy, file in copies.items():
        copy.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(copy, file.read_bytes())
    text = study.text.partition("\n")[2].replace("README.md explains every key", MANUAL)
    write_text(path, f"{schema_line(path)}\n{text}")


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

    words = path.stem.replace("-", " ").replace("_", " ").strip() or path.stem
    template = Template(Path(__file__).with_name(f"study_of_a_{body}.yaml").read_text())
    text = template.substitute(
        path=path.as_posix(),
        manual=MANUAL,
        title=words[0].upper() + words[1:],
        mesh_types=", ".join(name for name in MESH_TYPES if name.isalpha() and name != "structured"),
    )
    return f"{schema_line(path)}\n{text}"


def schema_line(path: Path) -> str:
    """First line of a study, by which editors check it."""
    schema = Path(os.path.relpath(config_file("study.schema.json"), path.parent)).as_posix()
    return f"# yaml-language-server: $schema={schema}"


@click.command(
    epilog=examples("springtune scenes config/mine.yaml", "SPRINGTUNE_MAX_SCENES=2e6 springtune scenes large.yaml")
)
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--results", type=click.Path(path_type=Path), default=".", help="Folder in which results/ is.")
def scenes(config: Path, results: Path) -> None:
    """List a study's scenes, what they share and what is stored, without running it.

    Counts scenes, meshes, references and curves of each grid, and stored results. Mistakes are printed with their
    lines.
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
    click.echo(f"\n{_stored_text(study, results / 'results' / study.name)}")


def _stored_text(study: "Study", folder: Path) -> str:
    """Text on a study's stored results, and on what a run computes."""
    from ..studies.runs import plan, rerun, store

    if not (folder / TASKS).exists():  # planning 10,000 scenes takes a second
        return f"nothing is stored in {folder}"
    asked, stored = Counter[str](), Counter[str]()
    for job in plan.plan(study, folder).values():
        assert job.stage  # of a plan
        done = not rerun.rerun_reason(job)
        for file in job.content["files"]:
            keys, path = {task["key"] for task in file["tasks"]}, Path(job.content["folder"], f"{file['name']}.h5")
            asked[job.stage.name] += len(keys)
            with suppress(store.DamagedError):  # a run names it
                stored[job.stage.name] += len(keys if done else keys & store.stored_keys(path))
    counts = ", ".join(f"{stage} {stored[stage]} of {count}" for stage, count in asked.items())
    new = "a run computes nothing" if stored == asked else f"a run computes the other {(asked - stored).total()}"
    return f"stored in {folder}: {counts}; {new}"


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
