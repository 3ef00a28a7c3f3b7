"""Jobs of a study, and why a job runs again.

A job does a bundle of tasks of a stage; bundles have about equal expected work and are the same on each machine. Other
jobs make the dataset, figures, tables, pages and the paper.
"""

import json
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import log2
from pathlib import Path
from typing import Any

from springtune.safe_io import write_bytes

from ..config.model import FORMATS, Output, Stage, Study, kinds, modules, outputs, view_files
from . import attempts, store
from .keys import inputs, stage_key
from .source import PACKAGE, RECORDS, TASKS, checksum, hash_of, read_note

MOST_JOBS = 64  # most jobs of a stage


@dataclass
class Task:
    """A task of a stage; tasks of one name are in one bundle."""

    values: Mapping[str, Any]  # argument of `solve`, without labels, so that a new label computes nothing again
    code: Sequence[object] = ()  # code that its values choose, by `keys.definition_key` and `keys.mesh_type_key`
    labels: Mapping[str, Any] = field(default_factory=dict)  # of its cell of the dataset; a label may be several
    seconds: float = 0.0  # expected time, for bundles of about equal work
    name: str = ""  # by default a hash of its values
    file: str = ""  # stem of the file of its result; by default its key
    shared: Mapping[str, Any] = field(default_factory=dict)  # values that all tasks of that file share
    key: str = ""  # by default a hash of all inputs

    def key_of(self, stage: Stage) -> str:
        """Return the key of the task's result."""
        return self.key or hash_of(self.values, stage_key(stage.module, attempts.MODULE), self.code)


@dataclass(frozen=True)
class Job:
    """A job of a run; it runs again if `digest` changes, a hash of its tasks and code without other jobs' products."""

    folder: Path
    name: str
    digest: str
    products: tuple[str, ...]
    reads: tuple[str, ...] = ()  # products of other jobs
    stage: Stage | None = None
    label: str = ""  # of its bundle
    content: Mapping[str, Any] = field(default_factory=dict)  # its tasks

    @property
    def record(self) -> Path:
        """File that the job writes at its end, its record."""
        return self.folder / RECORDS / f"{self.name}.json"

    @property
    def tasks(self) -> Path:
        """File with the tasks of the job."""
        return self.folder / TASKS / f"{self.name}.json"

    @property
    def results(self) -> set[tuple[str, str]]:
        """File and key of each result that the job makes."""
        return {(file["name"], task["key"]) for file in self.content["files"] for task in file["tasks"]}

    def write(self) -> None:
        """Write the tasks for the process of the job; an unchanged file is not written."""
        if self.stage and read_note(self.tasks).get("digest") != self.digest:
            note = {"digest": self.digest, "module": self.stage.module, "products": self.products}
            note["checksum"] = hash_of(self.stage.module, self.content)
            write_bytes(self.tasks, json.dumps(note | {"content": self.content}).encode())


def share_out(seconds: Mapping[str, float]) -> dict[str, list[str]]:
    """Share tasks out in bundles of about equal work; more work makes more bundles.

    >>> share_out({"coarse": 1.0, "fine": 4.0, "middle": 2.0})
    {'0': ['fine'], '1': ['coarse', 'middle']}
    """
    total = sum(seconds.values())
    # One job for 2 s, 8 for 2 minutes, 64 for 2 hours: against start-up, and for machines of many cores.
    count = min(2 ** round(log2(total / 2) / 2), MOST_JOBS, len(seconds)) if total > 2 else 1
    load = dict.fromkeys(map(str, range(count)), 0.0)
    bundles: dict[str, list[str]] = {}
    for name in sorted(seconds, key=lambda name: (-seconds[name], name)):
        label = min(load, key=lambda label: load[label])
        bundles.setdefault(label, []).append(name)
        load[label] += seconds[name]
    return {label: sorted(names) for label, names in bundles.items()}


def stages() -> tuple[Stage, ...]:
    """Stages of all study kinds."""
    return tuple(stage for kind in kinds() for stage in kind.stages)


def stage_jobs(study: Study, folder: Path) -> dict[str, Job]:
    """Jobs of a study's stages by name; nothing is written."""
    jobs, bundles = dict[str, Job](), dict[str, dict[str, list[str]]]()
    tasks: dict[str, dict[str, list[Task]]] = {}
    for kind in kinds():
        for stage in kind.stages if study.parts[kind.name] else ():
            named = tasks[stage.name] = defaultdict(list)
            for task in stage.tasks(study):
                named[task.name or hash_of(task.values)].append(task)
            if not stage.like:
                seconds = {name: sum(task.seconds for task in own) for name, own in named.items()}
                bundles[stage.name] = {name: [name] for name in named} if stage.timed else share_out(seconds)
    for stage in stages():
        for label, names in bundles.get(stage.like or stage.name, {}).items():
            if own := [task for name in names for task in tasks[stage.name].get(name, ())]:
                jobs[f"{stage.name}_{label}"] = _job(stage, folder, label, own)
    return jobs


def _job(stage: Stage, folder: Path, label: str, tasks: Sequence[Task]) -> Job:
    files, seen = dict[tuple[str, str], dict[str, Any]](), dict[tuple[str, int], dict[str, Any]]()
    for task in tasks:
        key = task.key_of(stage)
        name, shared = task.file or key, id(task.shared)
        if (name, shared) not in seen:  # by id(): a text of the shared values takes longer than the rest
            seen[name, shared] = files.setdefault((name, repr(task.shared)), {"name": name, **task.shared, "tasks": {}})
        seen[name, shared]["tasks"][key] = {"key": key, **task.values}
    content = {
        "results": str(folder),
        "folder": str(folder / stage.folder),
        "files": [file | {"tasks": list(file["tasks"].values())} for file in files.values()],
    }
    names = dict.fromkeys(name for name, _ in files)  # beams of one extent share a file
    products = tuple(str(folder / stage.folder / f"{name}{ending}") for name in names for ending in stage.endings)
    hashed = content["files"]
    if stage.unkeyed is not None:  # JSON of 100,000 tasks takes a quarter of a second
        hashed = [file | {"tasks": [[key, *map(task.get, stage.unkeyed)] for key, task in file["tasks"].items()]}
                  for file in files.values()]  # fmt: skip
    digest = hash_of(stage.module, content | {"files": hashed})
    return Job(folder, f"{stage.name}_{label}", digest, products, stage=stage, label=label, content=content)


def rows(stage: Stage, study: Study, folder: Path) -> Iterator[dict[str, Any]]:
    """Rows of the stored results of a stage, in the order of its tasks, each with the labels of its task."""
    tasks, files = [(task, task.key_of(stage)) for task in stage.tasks(study)], defaultdict(list)
    for task, key in tasks:
        files[task.file or key].append(key)
    found = {name: store.read(folder / stage.folder / f"{name}.h5", held) for name, held in files.items()}
    for task, key in tasks:
        result = found[task.file or key][key]
        yield from ({**task.labels, **row} for row in result.get("rows", [result]))


# -- jobs after the stages ---------------------------------------------------------------------------------------------

DATASET, SUMMARY, PAGE = "dataset.nc", "summary.txt", "index.html"  # files that every study has

COLLECT, BROWSE, PRESENT = "collect", "browse", "present"
"""Names of jobs after the stages; jobs of outputs begin with the last one."""

PAPER, PAPER_FILE = "paper", "paper.pdf"  # the job that typesets the paper, and its product

PAPER_STUDIES = ("paper", "definitions", "block", "laying", "stability", "benchmark", "shapes")


STUDIES_READ: list[tuple[Study, dict[str, Job]]] = []
"""Studies that this process runs, with all their jobs: the requested one, and those that the paper reads."""


def output_jobs(study: Study) -> dict[str, list[Output]]:
    """Requested outputs of a study that have files, by the job that makes them."""
    found: dict[str, list[Output]] = {}
    for one in outputs().values():
        if one.name in study.outputs and output_files(one, study):
            found.setdefault(f"{PRESENT}_{one.job}", []).append(one)
    return found


def output_files(output: Output, study: Study) -> list[str]:
    """Files of an output; for the page, all tables as CSV and the page itself."""
    figures = [f"figures/{stem}.{ending}" for stem in output.figures(study) for ending in FORMATS]
    names = [*output.tables(study)]
    if output.page:
        names = [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]
    return figures + [f"{output.into}/{name}" for name in names]


def presented_files(study: Study) -> list[str]:
    """Files of all requested outputs, relative to the study's folder; those of removed values are not among them."""
    return [path for members in output_jobs(study).values() for one in members for path in output_files(one, study)]


def linked_files(study: Study) -> list[str]:
    """Files that the page to browse links to, relative to the study's folder."""
    return [path for path in presented_files(study) if Path(path).suffix in (f".{FORMATS[0]}", ".html")]


def jobs(study: Study, folder: Path) -> dict[str, Job]:
    """All jobs of a study by name."""
    found, read = stage_jobs(study, folder), (str(folder / DATASET),)
    made = [(COLLECT, collect_digest(study, found), [DATASET, SUMMARY])]
    for name, members in output_jobs(study).items():
        files = [file for one in members for file in output_files(one, study)]
        made.append((name, _present_digest(study, members, files), files))
    made.append((BROWSE, _browse_digest(study), [PAGE]))
    for name, digest, files in made:
        products = tuple(str(folder / file) for file in files)
        found[name] = Job(folder, name, digest, products, () if name == COLLECT else read)
    return found


def collect_digest(study: Study, jobs: dict[str, Job]) -> str:
    """Digest of a study's dataset: of the study's files, the results of its stages and the code."""
    code = [stage_key(name) for name in ("studies.kinds.collect", *modules("kind", "collect"))]
    code += [stage_key(made.collect) for made in outputs().values() if made.collect and made.name in study.outputs]
    results = sorted({result for job in jobs.values() for result in job.results})  # in any bundles
    return hash_of(study.name, inputs(study), results, code)


def _present_digest(study: Study, members: Iterable[Output], files: list[str]) -> str:
    used = ["studies.output.present", *modules("outputs")]
    templates = []
    for one in members:
        used += filter(None, (name.partition(":")[0] for name in (one.module, one.write)))
        if one.page:
            shown = {"bodies", *(kind for kind, part in study.parts.items() if part)}  # as `present.write_page` takes
            used += [name for name in modules("tables", "figures") if name.split(".")[2] in shown]
            templates.append(checksum(PACKAGE / "studies/output/page.html"))
    return hash_of(files, [stage_key(name) for name in dict.fromkeys(used)], templates)


def _browse_digest(study: Study) -> str:
    files = [*sorted((PACKAGE / "studies/output/assets").iterdir()), *view_files()]
    assets = [(path.name, checksum(path)) for path in files]
    return hash_of(linked_files(study), stage_key("studies.output.browse"), assets)


def paper_job(source: Path, datasets: Iterable[Path], folder: Path) -> Job:
    """The job that typesets the paper."""
    texts = {path.name: checksum(path) for path in sorted(source.iterdir()) if path.is_file()}
    examples = sorted((source.resolve().parents[1] / "examples").glob("*.py"))
    texts |= {f"examples/{path.name}": checksum(path) for path in examples}
    used = ["studies.paper.build", *(one.module for one in outputs().values() if one.module)]
    digest = hash_of(texts, [stage_key(name) for name in dict.fromkeys(used)])
    return Job(folder, PAPER, digest, (str(folder / PAPER_FILE),), tuple(map(str, datasets)))


MISSING_ENDING = " is missing"  # end of the reason of a missing product


def rerun_reason(job: Job) -> str:
    """Return why a job must run, or an empty string; of other jobs it looks at products alone."""
    if not job.record.exists():
        return "not done yet"
    if read_note(job.record).get("digest") != job.digest:
        return "its parameters, code or packages changed"
    for product in job.products:
        if not Path(product).exists():
            return f"{product}{MISSING_ENDING}"
    made = job.record.stat().st_mtime_ns
    newer = (path for path in map(Path, job.reads) if path.exists() and path.stat().st_mtime_ns > made)
    return next((f"{path} is newer" for path in newer), "")


def outdated_records(study: Study, folder: Path) -> dict[Path, str] | None:
    """Return the records of done jobs that must run again, with the reasons; None if a job was never done."""
    if not (folder / TASKS).exists():  # never run: planning 10,000 scenes takes a second
        return None
    faults = {job.record: why for job in jobs(study, folder).values() if (why := rerun_reason(job))}
    known = {record: why for record, why in faults.items() if record.exists()}
    return known if len(known) == len(faults) else known or None
