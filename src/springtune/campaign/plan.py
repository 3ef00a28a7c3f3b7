"""From a study to the tasks of its stages: what each Snakemake job is to do, written to files that it can watch.

Scenes are put together in bundles of meshes of about equal cost, since one process a scene would be all start-up. The
file of a bundle changes only when its tasks do, so Snakemake reruns a job only when it has something to look at; a job
then computes only results that are not stored yet.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..jobs import atomic, bundles
from ..kinds import kinds

if TYPE_CHECKING:
    from ..kinds.base import Output, Stage
    from ..study.model import Study

COSTS_FILE = "costs.json"
"""File beside the studies' folders: what tasks cost on this machine."""

BUNDLES_FILE = "tasks/bundles.json"
"""File in a study's folder: what each bundle holds."""


def stages() -> "tuple[Stage, ...]":
    """Stages of all study kinds.

    Returns
    -------
    tuple of Stage
    """
    return tuple(stage for kind in kinds() for stage in kind.stages)


def table_files(output: "Output", study: "Study") -> list[str]:
    """Files of the tables of an output: where it is the page, each table of all study kinds as CSV, and the page.

    Parameters
    ----------
    output : Output
    study : Study

    Returns
    -------
    list of str
    """
    if not output.page:
        return list(output.tables(study))
    return [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]


def usual_costs() -> dict[str, tuple[float, float]]:
    """Seconds of tasks before any was measured, see `springtune.jobs.bundles.Costs`."""
    return {name: cost for kind in kinds() for name, cost in kind.costs.items()}


def write_tasks(study: "Study", folder: Path, cores: int) -> dict[str, list[str]]:
    """Write the task files of a study under ``folder/tasks``, those whose content changed.

    Parameters
    ----------
    study : Study
    folder : Path
        Where the study's results go.
    cores : int
        Bundles are made at least for so many cores.

    Returns
    -------
    dict of str to list of str
        Labels of the bundles by stage.
    """
    known, found, wanted = _planned(study, folder, cores)
    if found != known:
        atomic.write_json(folder / BUNDLES_FILE, found)
    for stage in stages():
        for label, content in wanted[stage.name].items():
            _write(folder, f"{stage.name}_{label}", content, stage.products(content))
    return {name: list(contents) for name, contents in wanted.items()}


def task_contents(study: "Study", folder: Path) -> dict[str, dict[str, dict[str, Any]]]:
    """Contents of the task files of a study as its next run has them; nothing is written.

    Parameters
    ----------
    study : Study
    folder : Path
        Where the study's results are.

    Returns
    -------
    dict of str to dict
        By stage and label of the bundle.
    """
    return _planned(study, folder, 1)[2]


def _write(folder: Path, name: str, content: dict[str, Any], products: Iterable[Path]) -> None:
    path = folder / "tasks" / f"{name}.json"
    if not path.exists() or atomic.read_json(path) != content:
        atomic.write_json(path, content)
    done = folder / "done" / f"{name}.json"
    # Snakemake guards what is declared; results are not, so a missing one makes the job run again.
    if done.exists() and not all(file.exists() for file in products):
        done.unlink()


def _planned(
    study: "Study", folder: Path, cores: int
) -> tuple[dict[str, Any], dict[str, Any], dict[str, dict[str, dict[str, Any]]]]:
    """Bundles as they are noted and as they shall be, and contents of the tasks by stage and label."""
    notes = folder / BUNDLES_FILE
    known: dict[str, Any] = atomic.read_json(notes) if notes.exists() else {"cores": 0}
    # More cores want more bundles; what is solved stays solved, whichever bundle it is in.
    before: dict[str, Any] = known if known["cores"] >= cores else {"cores": cores}
    costs = bundles.Costs(folder.parent / COSTS_FILE, usual_costs())
    found: dict[str, Any] = {}
    shared: dict[str, dict[str, list[Any]]] = {}
    for stage in stages():
        if stage.members is None:  # it works on another one's bundles
            continue
        members = stage.members(study, costs)
        if stage.alone:
            found[stage.name] = {name: [name] for name in members}
        else:
            seconds = {name: each for name, (each, _) in members.items()}
            kept = before.get(stage.name, {})
            found[stage.name] = bundles.share_out(seconds, cores, costs.start_up, kept) if members else {}
        shared[stage.name] = {label: [members[name][1] for name in names] for label, names in found[stage.name].items()}
    wanted: dict[str, dict[str, dict[str, Any]]] = {}
    for stage in stages():
        each = {label: stage.content(study, folder, one) for label, one in shared[stage.like or stage.name].items()}
        wanted[stage.name] = {label: content for label, content in each.items() if content}
    return known, found | {"cores": before["cores"]}, wanted
