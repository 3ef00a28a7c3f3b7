"""Select and check the files of an archive; `springtune.studies.archive.crate` writes it."""

import hashlib
import json
import os
import platform
import shutil
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from filecmp import cmpfiles
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from springtune.safe_io.atomic import write_text
from springtune.safe_io.escapes import markdown

from ..config.messages import StudyError
from ..output.browse import page as browse
from ..output.reading import attributes
from ..runs import provenance, records, rerun
from ..runs.keys import OURS, installed
from ..runs.plan import plan
from ..runs.source import PACKAGE
from ..runs.workload import COMMANDS_FILE
from .parts import ELSEWHERE
from .verify import files as verified

if TYPE_CHECKING:
    from ..config.model import Study
    from ..runs.plan import Plan
    from ..runs.rerun import Job

METADATA, SUMS, README, DIFF = "ro-crate-metadata.json", "SHA256SUMS", "README.md", "code.diff"

CODE, INPUTS = "code", "inputs"
"""Folders for files of the checkout, and of elsewhere."""

CITATION = "CITATION.cff"
OF_RESULTS = "results"

LOCK_FILES = ("requirements/run.txt", "requirements/cholesky.txt")
"""Lock files of studies; the second is an optional extra."""

CHECKOUT_FILES = (
    "Snakefile",
    "Makefile",
    "README.md",
    "pyproject.toml",
    "hatch_build.py",
    "LICENSE",
    CITATION,
    "tools/setup.sh",
    *LOCK_FILES,
)
"""Required files of a checkout."""

FOLDERS = {
    "src": (".css", ".html", ".jinja", ".js", ".py", ".pyi", ".typed", ".yaml"),
    "workflow": (".csl", "README.md", "Snakefile", ".rst", ".smk", ".typ", ".yaml", ".yml"),
    "requirements": (".in", ".txt"),
}
"""Packed folders, and the endings used without git."""

OF_PROFILES, LINK = "workflow/profiles", "profiles"
"""Folder packed as committed, since users edit profiles, and the link to it."""

NOT_PACKED = ("__pycache__", ".egg-info", ".pyc", ".DS_Store")
"""Endings of generated files and folders."""

MOST_FILES, MOST_TEXT = 100_000, 2**24
"""Limits of files and metadata bytes; parsed metadata takes thirty times the memory."""

MOST_TOLD = 5


class ArchiveError(StudyError):
    """A study cannot be archived; the message names the reason and the remedy."""


@dataclass(frozen=True)
class Packed:
    """A file of an archive; `original` is the SHA-256 of its source if that differs."""

    name: str
    source: Path | bytes
    sha256: str
    size: int
    original: str = ""


@dataclass(frozen=True)
class Code:
    """The program of a checkout: its `diff`, its packed untracked files (`new`), and unpacked ones (`left`)."""

    files: dict[str, Path]
    commit: str
    diff: str
    new: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    texts: dict[str, str] = field(default_factory=dict)

    @property
    def changed(self) -> bool:
        """Whether it differs from its commit."""
        return bool(self.diff or self.new)


@dataclass(frozen=True)
class Contents:
    """Contents of an archive without metadata.

    `departures` are installed versions other than the locked ones, `untold` attributes left out on request; `machine`
    is empty if other machines took part.
    """

    study: "Study"
    plan: "Plan"
    jobs: "dict[str, Job]"
    files: dict[str, Packed]
    config: str
    inputs: tuple[str, ...]
    code: Code
    attributes: dict[str, str]
    machine: dict[str, str]
    departures: dict[str, tuple[str, str]]
    untold: list[str]

    @property
    def folder(self) -> str:
        """Folder of its results."""
        return f"{OF_RESULTS}/{self.study.name}"

    @property
    def dataset(self) -> str:
        """Name of the dataset."""
        return f"{self.folder}/{rerun.DATASET}"

    @property
    def software(self) -> dict[str, str]:
        """Versions that made the dataset."""
        return dict(json.loads(self.attributes["software"]))


def gather(
    study: "Study",
    folder: Path,
    scratch: Path,
    store: bool = False,
    untracked: bool = False,
    chosen: Mapping[str, bool] | None = None,
) -> Contents:
    """Select and check the contents of an archive."""
    checkout = _checkout(folder)
    checked = verified(study, folder)
    if checked.faults or checked.stale:
        raise ArchiveError(*_unfinished(study, folder, checked.faults, checked.stale))
    made = plan(study, folder, 1)
    jobs, untold = rerun.jobs(study, made), rerun.untold(folder, chosen)
    given = provenance.input_files(study)
    code = _code(study, checkout, {file.resolve() for file in given}, untracked)
    names = archived_names(study, given, checkout)
    paths = {name: path for path, name in names.items()}
    paths |= {f"{CODE}/{name}": path for name, path in code.files.items()}
    paths |= {f"{OF_RESULTS}/{study.name}/{name}": path for name, path in _made(folder, jobs, made, store)}
    packed = {name: _of_file(name, path) for name, path in paths.items()}
    packed |= {f"{CODE}/{name}": of_text(f"{CODE}/{name}", text) for name, text in code.texts.items()}
    dataset, page = (f"{OF_RESULTS}/{study.name}/{name}" for name in (rerun.DATASET, rerun.PAGE))
    packed[dataset], told, host = _without(packed[dataset], {"host", *untold}, scratch)
    if packed[dataset].sha256 != packed[dataset].original:  # the page has the attributes of the dataset
        write_text(scratch / rerun.PAGE, browse.page(scratch / rerun.DATASET, rerun.linked(study)))
        packed[page] = _of_file(page, scratch / rerun.PAGE)
    if code.diff and "git_diff" not in untold:
        packed[DIFF] = of_text(DIFF, code.diff)
    own = names[study.path.resolve()]
    elsewhere = any((folder / note).is_file() for note in (COMMANDS_FILE, ELSEWHERE))  # other machines took part
    tell_machine = host == platform.node() and "host" not in untold and not elsewhere
    found = Contents(
        study=study,
        plan=made,
        jobs=jobs,
        files=packed,
        config=own,
        inputs=tuple(sorted(set(names.values()) - {own})),
        code=code,
        attributes=told,
        machine=machine() if tell_machine else {},
        departures=_departures(checkout, told),
        untold=untold,
    )
    packed[README] = of_text(README, _readme(found))
    return found


# -- the checkout ------------------------------------------------------------------------------------------------------


def _checkout(folder: Path) -> Path:
    """Return this checkout's folder; refused if it could not run elsewhere."""
    checkout = Path.cwd()
    if folder.resolve().parent.parent != checkout:
        place = folder.parent.parent
        raise ArchiveError(f"{folder}: an archive holds the checkout that it was run in; call it there: cd {place}")
    missing = [name for name in CHECKOUT_FILES if not Path(name).is_file()]
    if missing:
        raise ArchiveError(
            f"{', '.join(missing)}: missing in this folder, and nobody could run the archive without; go to a checkout "
            "of springtune, or unpack its source distribution, and run the study there"
        )
    other = _other_library(checkout / "src/springtune")
    if other:
        raise ArchiveError(
            f"src/springtune/{other} of this folder is not that of the library that runs and that made the results; "
            "set up the environment of this folder: make study"
        )
    return checkout


def _other_library(packed: Path) -> str:
    """First file that differs from the running library; empty if none does."""
    if packed.resolve() == PACKAGE.resolve():
        return ""
    names = {
        path.relative_to(folder).as_posix()
        for folder in (packed, PACKAGE)
        for path in folder.rglob("*")
        if path.is_file() and not _is_made(path.relative_to(folder).as_posix())
    }
    _, others, lacking = cmpfiles(packed, PACKAGE, sorted(names), shallow=False)
    return min(others + lacking, default="")


def _unfinished(study: "Study", folder: Path, faults: Iterable[tuple[str, str]], stale: Iterable[str]) -> list[str]:
    said = [f"{name}: {why}" for name, why in faults]
    said += [f"{name}: the study or the program changed since" for name in stale]
    shown = said[:MOST_TOLD] + ([f"and {len(said) - MOST_TOLD} more"] if len(said) > MOST_TOLD else [])
    remedy = f"springtune run {study.path}"
    if any(why.endswith(records.DAMAGED) for _, why in faults):
        remedy = f"springtune verify {study.path} --set-aside, then {remedy}"
    head = f"{folder}: is not what the study asks for now, and is not archived"
    return [head, *(f"  {line}" for line in (*shown, f"make it: {remedy}"))]


def _code(study: "Study", checkout: Path, given: set[Path], untracked: bool) -> Code:
    """The checkout's program, by git or, without git, by file endings; `given` inputs are packed anyway."""
    commit, texts = provenance.git_commit(checkout), {}
    known = _git(checkout, "ls-files", "-z", "--cached", "--", *FOLDERS, LINK) if commit else []
    if known:
        others = _git(checkout, "ls-files", "-z", "--others", "--", *FOLDERS, "tools")
        changed = _git(checkout, "diff", "--name-only", "-z", "--relative", "HEAD", "--", OF_PROFILES)
        texts = {name: provenance.git(checkout, "show", f"HEAD:./{name}") for name in changed}
    else:  # a source distribution, or a checkout inside of another one's ignored folder
        commit = ""
        paths = [path for top in FOLDERS for path in (checkout / top).rglob("*") if path.is_file()]
        found = [path.relative_to(checkout).as_posix() for path in paths]
        known = [LINK, *filter(_is_usual, found)]
        others = [name for name in found if not _is_usual(name)]
    others += [name for name, text in texts.items() if not text]  # not committed yet
    others = [name for name in others if not _is_made(name) and (checkout / name).resolve() not in given]
    asked = {*known, *CHECKOUT_FILES, *others} if untracked else {*known, *CHECKOUT_FILES} - {*others}
    files = dict(_followed(checkout, asked))
    left = {name for name, path in files.items() if not path.resolve().is_relative_to(checkout.resolve())}
    left |= set() if untracked else {*others}
    needed = {path.relative_to(PACKAGE.parent).as_posix() for path in OURS.files if path.is_relative_to(PACKAGE)}
    for name in sorted(left):
        if name.removeprefix("src/") in needed:
            raise ArchiveError(
                f"{name}: the study is computed by it, and git does not know it; add it to git, or pack it and all "
                "others by --untracked"
            )
    texts |= {f"{LINK}{name.removeprefix(OF_PROFILES)}": text for name, text in texts.items()}
    return Code(
        {name: path for name, path in files.items() if name not in left},
        commit.removesuffix(provenance.CHANGED),
        provenance.difference(study, checkout, "--binary", "--relative") if commit else "",
        tuple(sorted(files.keys() & {*others})),
        tuple(sorted(left)),
        {name: text for name, text in texts.items() if text and name in files},
    )


def _git(checkout: Path, *arguments: str) -> list[str]:
    return [name for name in provenance.git(checkout, *arguments).split("\0") if name]


def _followed(checkout: Path, names: Iterable[str]) -> Iterator[tuple[str, Path]]:
    """Files by name; a link to a folder is followed, as zip has no links."""
    names = sorted(set(names))
    for name in names:
        path = checkout / name
        if path.is_file():
            yield name, path
        elif path.is_dir() and path.resolve().is_relative_to(checkout):
            below = path.resolve().relative_to(checkout).as_posix() + "/"
            for other in names:
                if other.startswith(below) and (checkout / other).is_file():
                    yield f"{name}/{other.removeprefix(below)}", checkout / other


def _is_usual(name: str) -> bool:
    """Return whether a visible file is packed by its ending if git is missing."""
    parts = PurePosixPath(name).parts
    return name.endswith(FOLDERS[parts[0]]) and not any(part.startswith(".") for part in parts)


def _is_made(name: str) -> bool:
    return any(part.endswith(NOT_PACKED) for part in PurePosixPath(name).parts)


# -- the study's files -------------------------------------------------------------------------------------------------


def archived_names(study: "Study", given: set[Path], checkout: Path) -> dict[Path, str]:
    """Archive names of input files; their relative places stay."""
    config, files = study.path.resolve(), {file.resolve() for file in given}
    for path in files - {config}:
        if str(path) in study.text:
            raise ArchiveError(
                f"{study.path}: names {path}, which is this machine's own; name the file as seen from the study's "
                f"folder, such as {path.name} beside it, and run the study again"
            )
    outside = [path.parent for path in files if not path.is_relative_to(checkout)]
    base = Path(os.path.commonpath(outside)) if config.parent in outside else None
    names = {}
    for path in sorted(files):
        if path.is_relative_to(checkout):
            names[path] = f"{CODE}/{path.relative_to(checkout).as_posix()}"
        else:
            names[path] = f"{INPUTS}/{path.relative_to(base).as_posix()}" if base else _beside(path, checkout)
    folder = PurePosixPath(names[config]).parent
    for path, name in names.items():
        if not name or os.path.relpath(name, folder) != os.path.relpath(path, config.parent):
            raise ArchiveError(
                f"{study.path}: reads {path.name}, which an archive could not hold where the study finds it; "
                "put the study and its files into one folder, in the checkout or outside, and run it"
            )
    return names


def _beside(path: Path, checkout: Path) -> str:
    """Name of a file in a folder beside the checkout; empty for others."""
    parts = Path(os.path.relpath(path, checkout)).parts
    beside = len(parts) > 2 and parts[0] == ".." and parts[1] not in ("..", CODE, OF_RESULTS, INPUTS)
    return "/".join(parts[1:]) if beside else ""


# -- results -----------------------------------------------------------------------------------------------------------


def _made(folder: Path, jobs: "dict[str, Job]", made: "Plan", store: bool) -> Iterator[tuple[str, Path]]:
    """Product files by their names from the study's folder on."""
    from ..runs import checked_json

    for name, job in jobs.items():
        paths = [job.record, folder / f"benchmarks/{name}.tsv"]
        if name not in made.jobs:
            paths += map(Path, job.products)
        elif store:
            paths += map(Path, checked_json.demand(job.record)["products"])
            paths.append(made.tasks(name))
        for path in paths:
            if path.is_file():
                yield path.relative_to(folder).as_posix(), path


def stored_size(study: "Study", folder: Path) -> int:
    """Size of all stored results [B]."""
    made = plan(study, folder, 1)
    every = dict(_made(folder, rerun.jobs(study, made), made, True))
    few = dict(_made(folder, rerun.jobs(study, made), made, False))
    return sum(every[name].stat().st_size for name in every.keys() - few.keys())


def _without(dataset: Packed, names: Collection[str], scratch: Path) -> tuple[Packed, dict[str, str], str]:
    """The dataset without some attributes, the others, and the machine's name.

    Attributes are overwritten in place; all other bytes stay.
    """
    import h5py
    import numpy as np

    assert isinstance(dataset.source, Path)
    try:
        found = attributes(dataset.source)
    except ValueError as error:
        raise ArchiveError(str(error)) from None
    host, copy = found.get("host", ""), scratch / rerun.DATASET
    shutil.copyfile(dataset.source, copy)
    with h5py.File(copy, "a") as file:
        for name in names:
            text = found.pop(name, "")
            if text and file.attrs.get_id(name).dtype.kind != "S":
                option = next(option for option, other in rerun.BLANKED.items() if other == name).replace("_", "-")
                raise ArchiveError(
                    f"{dataset.source}: its attribute '{name}' has letters besides ASCII, and cannot be blanked in its "
                    f"place; run the study again with --{option}"
                )
            if text:
                file.attrs.modify(name, np.bytes_(b"-" * len(text)))
    return replace(_of_file(dataset.name, copy), original=dataset.sha256), found, host


def _departures(checkout: Path, told: dict[str, str]) -> dict[str, tuple[str, str]]:
    """Versions of the dataset that differ from the locked ones."""
    wanted = {name: version for lock in LOCK_FILES for name, version in locked(checkout / lock).items()}
    used = json.loads(told.get("software", "{}"))
    return {name: (wanted[name], one) for name, one in sorted(used.items()) if wanted.get(name, one) != one}


# -- the archive -------------------------------------------------------------------------------------------------------


def _readme(found: Contents) -> str:
    """README of the archive."""
    study = f"../{found.config}" if not found.config.startswith(f"{CODE}/") else found.config.removeprefix(f"{CODE}/")
    commit = f"commit {found.code.commit}" if found.code.commit else "from no git checkout"
    version = found.attributes["springtune_version"]
    changed = ", changed" if found.code.changed else ""
    if DIFF in found.files:
        changed += f"; what of package, rules and study differs from the commit is in `{DIFF}`"
    return f"""# {markdown(found.study.title)}

The study `{found.study.name}`, computed by springtune {version} ({commit}{changed}). Every file is
described in `{METADATA}`: this is an RO-Crate.

| | |
|---|---|
| `{found.config}` | the study |
| `{found.dataset}` | its dataset: NetCDF-4, for xarray or any HDF5 viewer |
| `{found.folder}/{rerun.PAGE}` | a page to browse it |
| `{CODE}/` | the program, with the versions of all packages in `{CODE}/{LOCK_FILES[0]}` |

To check that all is as it was packed:

    sha256sum -c {SUMS}

To compute it again, with Python {minor(found.software["python"])} and make, and to compare:

    cd {CODE}
    make study STUDY={study}
    . .venv/bin/activate
    springtune diff ../{found.folder} {found.folder} --relative 0 --absolute 0

`springtune verify ARCHIVE --reproduce` does all of this with the archive as it was packed.
"""


def _of_file(name: str, path: Path) -> Packed:
    return Packed(name, path, records.checksum(path), path.stat().st_size)


def of_text(name: str, text: str) -> Packed:
    """Archive file with a given text."""
    content = text.encode(errors="surrogateescape")
    return Packed(name, content, hashlib.sha256(content).hexdigest(), len(content))


def several(value: Any) -> list[Any]:
    """Return a list, also of a single value."""
    return value if isinstance(value, list) else [value]


# -- software and machine ----------------------------------------------------------------------------------------------


def minor(version: str) -> str:
    """Python version without its last number, as wheels use it.

    Examples
    --------
    >>> minor("3.11.7")
    '3.11'
    """
    return ".".join(version.split(".")[:2])


def locked(path: Path) -> dict[str, str]:
    """Versions that a lock file requests on this machine."""
    from packaging.requirements import InvalidRequirement, Requirement
    from packaging.utils import canonicalize_name

    found = {}
    for line in path.read_text().splitlines():
        text = line.removesuffix("\\").strip()
        if not text or text.startswith(("#", "-")):
            continue
        try:
            one = Requirement(text)
        except InvalidRequirement:
            continue
        if one.marker is None or one.marker.evaluate():
            found[str(canonicalize_name(one.name))] = str(one.specifier).removeprefix("==")
    return found


def departures(lock: Path) -> dict[str, tuple[str, str]]:
    """Installed versions that differ from a lock file."""
    here = {name: (version, installed(name)) for name, version in locked(lock).items()}
    return {name: pair for name, pair in here.items() if pair[0] != pair[1]}


def machine() -> dict[str, str]:
    """Properties of the machine that numbers and times depend on, without names."""
    found = {"architecture": platform.machine(), "system": platform.system(), "cores": str(os.cpu_count())}
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return found | ({"processor": models[0]} if models else {})
