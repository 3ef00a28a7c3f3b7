"""Commands for studies: new, scenes, run and definitions."""

import gc
import os
import subprocess
import sys
import warnings
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout, suppress
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Any

import click

from ..problem.quantities import nearest
from ..registry import NAME, NAME_RULE, how_to_install
from ..safe_io import aligned, write_bytes, write_text
from ..studies.runs.source import CONFIG_FOLDER, TASKS, USUAL_STUDY, config_file, is_source_tree, workflow_folder
from . import PATH, WrongCall, command, file_errors

MANUAL = "`springtune docs` prints where every key is explained"  # comment in new studies


@command(
    "springtune new mine",
    "springtune new studies/mine.yaml",
    "springtune new plate --shape",
    "springtune new tables --from paper",
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
        raise WrongCall(f"--shape cannot be combined with --from {source}; leave one of the two out")
    with file_errors(f"{path}: cannot be written", "name another place"):
        if source:
            _copy(source, path)
        else:
            write_text(path, template_text(path, "shape" if shape else "beam"))
    scenes = "" if source else "4 scenes; " if shape else "2 scenes; "
    click.echo(f"{path}: {scenes}change it as you like, and run it:\n  springtune run {path}")


def _copy(name: str, path: Path) -> None:
    """Copy a study that comes along, and the files that it names, none of which is overwritten."""
    from ..studies.kinds import load_study
    from ..studies.runs.keys import input_files

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
    if path.name and path.suffix not in (".yaml", ".yml"):
        path = path.with_name(f"{path.name}.yaml")
        path = CONFIG_FOLDER / path if given == path.stem and is_source_tree(Path()) else path
    return path


def template_text(path: Path, body: str) -> str:
    """Text of a new study of a beam or of a shape."""
    from ..mesh.cells import MESH_TYPES

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


@command("springtune scenes config/mine.yaml", "SPRINGTUNE_MAX_SCENES=2e6 springtune scenes large.yaml")
@click.argument("config", type=PATH)
@click.option("--results", type=PATH, default=".", help="Folder of results/.")
def scenes(config: Path, results: Path) -> None:
    """List a study's scenes, what they share and what is stored, without running it.

    Counts scenes, meshes, references and curves of each grid, and stored results. Mistakes are printed with their
    lines.
    """
    from ..studies.config.model import kinds
    from ..studies.kinds.bodies.kind import summary

    study = _load(config)
    parts = [(kind, study.parts[kind.name]) for kind in kinds()]
    click.echo(summary(study, [row for kind, part in parts if part for row in kind.summary(part)]))
    click.echo(f"\n{_stored_text(study, results / 'results' / study.name)}")


def _stored_text(study: Any, folder: Path) -> str:
    """Text on a study's stored results, and on what a run computes."""
    from ..studies.runs import plan, store

    if not (folder / TASKS).exists():  # planning 10,000 scenes takes a second
        return f"nothing is stored in {folder}"
    asked, stored = Counter[str](), Counter[str]()
    for job in plan.stage_jobs(study, folder).values():
        assert job.stage  # of a plan
        done = not plan.rerun_reason(job)
        for file in job.content["files"]:
            keys, path = {task["key"] for task in file["tasks"]}, Path(job.content["folder"], f"{file['name']}.h5")
            asked[job.stage.name] += len(keys)
            with suppress(store.DamagedError):  # a run names it
                stored[job.stage.name] += len(keys if done else keys & store.stored_keys(path))
    counts = ", ".join(f"{stage} {stored[stage]} of {count}" for stage, count in asked.items())
    new = "a run computes nothing" if stored == asked else f"a run computes the other {(asked - stored).total()}"
    return f"stored in {folder}: {counts}; {new}"


@command("springtune definitions | grep area")
def definitions() -> None:
    """List the definitions of spring stiffness."""
    from .. import DEFINITIONS

    packages = {name: f" ({package})" for name, package in DEFINITIONS.packages.items()}
    click.echo(aligned([[name, one.summary + packages.get(name, "")] for name, one in DEFINITIONS.items()], left=2))


# -- run ---------------------------------------------------------------------------------------------------------------


@command(
    "springtune run config/mine.yaml",
    "springtune run config/mine.yaml --cores 4",
    "springtune run config/mine.yaml -n",
    "springtune run config/mine.yaml --workflow-profile slurm",
    context_settings={"ignore_unknown_options": True},
    options_metavar="[--results FOLDER]",
)
@click.option(
    "--results", type=click.Path(file_okay=False, path_type=Path), help="Folder of results/, made if missing."
)
@click.argument("arguments", nargs=-1, type=click.UNPROCESSED, metavar="[STUDY] [OPTIONS OF SNAKEMAKE]")
def run(results: Path | None, arguments: tuple[str, ...]) -> None:
    """Run a study; without a name, the paper's.

    Checks the study and then runs Snakemake, with results/ in this folder or that of --results. All other options are
    Snakemake's. Exit codes: 0 all is made, also if scenes could not be solved; 1 the study is wrong or a job failed; 2
    wrong options.
    """
    from ..problem.shapes import AssumptionWarning  # here, so that --help does not wait for it
    from ..studies.runs.plan import PAPER_STUDIES

    gc.disable()  # scenes and their tasks stay to the end: collecting garbage among them takes a sixth of the time
    named = bool(arguments) and not arguments[0].startswith("-")
    options = [*arguments[named:]]
    if {"--configfile", "--configfiles"} & {one.partition("=")[0] for one in options}:
        raise click.UsageError("give the study itself, without --configfile: springtune run mine.yaml")
    if not named and (late := [one for one in options if one.endswith((".yaml", ".yml"))]):
        first = f"./{late[0]}" if late[0].startswith("-") else f"{late[0]} {options[0]}"
        raise click.UsageError(f"name the study first: springtune run {first}")
    if _wants_slurm(options) and not find_spec(SLURM):
        why = "the profile slurm needs Snakemake's plugin for Slurm, which is not installed"
        raise click.UsageError(f"{why}; {how_to_install('slurm')}")
    shown = Path(arguments[0]) if named else config_file(USUAL_STUDY)
    path = shown.absolute()
    with warnings.catch_warnings(action="ignore", category=AssumptionWarning):  # Snakemake's reading says it
        study = _load(shown)
    folder, source = results.absolute() if results else Path.cwd(), workflow_folder()
    for place in (folder / "results", folder / _results(study)):
        if place.is_file():
            raise click.ClickException(f"{place} cannot be written; it is a file: move it, or give another --results")
    if results and folder != Path.cwd():
        click.echo(f"results go to {results}/results/{study.name}; paths below are as seen from {results}", err=True)
    path = path.relative_to(folder) if path.is_relative_to(folder) else path
    workflow = [] if folder == source else ["--snakefile", str(source / "Snakefile")]
    forced: list[str] = []
    with file_errors(f"--results {folder}", "name a folder that can be written"):
        folder.mkdir(parents=True, exist_ok=True)
        os.chdir(folder)
    set_cache()
    if _computes(options) or _is_dry_run(options):
        study = study if path == shown else _load(path)  # its files are seen from here
        others = [name for name in PAPER_STUDIES if name != study.name] if "paper" in options else []
        studies = [study, *(_load(config_file(f"{name}.yaml", path.parent)) for name in others)]
    if _is_dry_run(options):
        # A dry run removes no records. An option of the user's, which comes later, replaces this one.
        outdated = _outdated(studies, "a run makes it again")
        forced = ["--forcerun", *map(str, outdated)] if outdated else []
    elif _computes(options):
        _unlock(studies, [*workflow, "--unlock", f"--configfile={path}"])
        found = _outdated(studies, "it is made again")
        for record in found or {}:
            record.unlink()
        if found == {} and _asks_for_all(options):
            from ..studies.output.summary import idle_report

            click.echo(f"Nothing to be done: {_results(study)} is complete.\n{idle_report(_results(study))}", nl=False)
            return
    # A list of targets would take a path that follows it for one more of them, and so would --configfile. A path that
    # begins with - is not an option behind =.
    sys.argv = ["snakemake", *forced, *workflow, *options, f"--configfile={path}"]
    with redirect_stdout(sys.__stdout__), redirect_stderr(sys.__stderr__):  # its control characters are its own
        from snakemake.cli import main as snakemake  # here, since it takes half a second, and keeps its streams

        snakemake(sys.argv[1:])


def set_cache() -> None:
    """Set a cache folder here for Snakemake if the user's cannot be written."""
    usual = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    with suppress(OSError):
        usual.mkdir(parents=True, exist_ok=True)
    if not (usual.is_dir() and os.access(usual, os.W_OK)):
        os.environ["XDG_CACHE_HOME"] = str(Path(".snakemake/cache").absolute())
        click.echo(f"note: {usual} cannot be written; .snakemake/cache stands in for it", err=True)


READ_ONLY_OPTIONS = {
    "--archive", "--cleanup-metadata", "--d3dag", "--dag", "--detailed-summary", "--dry-run", "--dryrun", "--filegraph",
    "--lc", "--li", "--lint", "--list", "--list-changes", "--list-input-changes",
    "--list-params-changes", "--list-rules", "--list-target-rules", "--list-untracked", "--lp",
    "--lt", "--lu", "--report", "--rulegraph", "--summary", "--unlock", "-D", "-S", "-l", "-n", "-np",
}  # fmt: skip
"""Options of Snakemake that compute nothing."""


def _computes(options: list[str]) -> bool:
    """Return whether Snakemake computes anything with these options."""
    return not any(one.partition("=")[0] in READ_ONLY_OPTIONS for one in options)


OPTION_VALUE_COUNTS = {"--cores": 1, "-c": 1, "--jobs": 1, "-j": 1, "--quiet": 0, "-q": 0, "--keep-going": 0, "-k": 0}
"""Number of values of the options that do not change the products of a run."""


def _asks_for_all(options: list[str]) -> bool:
    """Return whether the options request the whole study and force nothing."""
    rest = options
    while rest and rest[0].partition("=")[0] in OPTION_VALUE_COUNTS:
        rest = rest[1 + (OPTION_VALUE_COUNTS[rest[0]] if "=" not in rest[0] else 0) :]
    return not rest


def _is_dry_run(options: list[str]) -> bool:
    """Return whether the run is a dry run."""
    return not {"-n", "-np", "--dry-run", "--dryrun"}.isdisjoint(options)


def _results(study: Any) -> Path:
    return Path("results") / study.name


def _unlock(studies: list[Any], options: list[str]) -> None:
    """Remove the lock of a killed run; refuse a study under computation, a read-only folder and a full disk."""
    from ..studies.runs import locks

    here, state = Path.cwd(), Path(".snakemake")
    if not os.access(state if state.exists() else here, os.W_OK):
        remedy = "`springtune info` and `browse` write nothing: call these"
        raise click.ClickException(f"{here} cannot be written; {remedy}")
    disk = os.statvfs(here)
    if disk.f_blocks and not disk.f_bavail:
        raise click.ClickException(f"{here}: the disk is full; make room, then call the same command again")
    killed = [one.name for one in studies if locks.check_idle(_results(one))]
    if killed:
        subprocess.run([sys.executable, "-m", "snakemake", *options], check=False, capture_output=True)
        which = ", ".join(str(Path("results", name)) for name in killed)
        click.echo(f"{which}: the run before was killed and left its lock; the lock is removed", err=True)


def _outdated(studies: list[Any], remedy: str) -> dict[Path, str] | None:
    """Records of outdated jobs, with the reasons; None if a job was never done. Missing files are printed."""
    from ..studies.runs import plan

    each = [plan.outdated_records(study, _results(study)) for study in studies]
    found = {record: why for one in each for record, why in (one or {}).items()}
    for why in found.values():
        if why.endswith(plan.MISSING_ENDING):
            click.echo(f"{why}; {remedy}", err=True)
    return found if found or None not in each else None


SLURM = "snakemake_executor_plugin_slurm"
"""Package of the plugin; without it Snakemake only reports unknown options of the profile."""


def _wants_slurm(options: list[str]) -> bool:
    """Return whether the options name the profile for Slurm."""
    named = [two for one, two in zip(options, options[1:]) if one == "--workflow-profile"]
    named += [one.partition("=")[2] for one in options if one.startswith("--workflow-profile=")]
    return any(Path(one).name == "slurm" for one in named)


def _load(path: Path) -> Any:
    """Study of a file; an error is printed and ends the command."""
    from ..studies.config.messages import StudyError
    from ..studies.kinds import load_study

    try:
        return load_study(path)
    except StudyError as error:
        click.echo(str(error) + _suggestion(path), err=True)
        raise SystemExit(1) from None


def _suggestion(path: Path) -> str:
    """Suggestion of an existing study for a missing one, or an empty string."""
    near = config_file(f"{path.stem}.yaml")
    if path.exists() or near == path or not near.is_file():
        return ""
    copied = f"`springtune new {path.stem} --from {path.stem}` writes it here"
    return f"; {copied}" if near.is_absolute() else f"; did you mean {near}?"
