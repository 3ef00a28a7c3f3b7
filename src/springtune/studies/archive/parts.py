"""Split a study into parts for several sites, merge their results, and pack the results of a stage for object storage.

Keys of results hold code, packages and parameters, so a merge is the union of stored files. Everything is compared
before anything is written.
"""

import io
import json
import os
import re
import shutil
import sys
import tarfile
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

import numpy as np

from springtune.registry import NAME, NAME_RULE
from springtune.safe_io import atomic
from springtune.safe_io.escapes import clipped, shown
from springtune.safe_io.inputs import check_alone

from ..config.load import digest_of, is_part, named_files, part_text, whole_text
from ..config.messages import StudyError, read_yaml
from ..config.model import Part
from ..kinds import load_study
from ..kinds.division import dealt, part_of, taken
from ..kinds.scenes.plan import scene_key
from ..output.reading import attributes
from ..runs import checked_json, driver, locks, records, rerun, store
from ..runs.checked_json import DamagedError
from ..runs.keys import installed
from ..runs.plan import plan
from ..runs.run_tasks import RECORDS, TASKS
from ..runs.task_costs import TaskCosts, Watch

if TYPE_CHECKING:
    from ..config.model import Study

HASH = re.compile('"([0-9a-f]{24})"')
"""Form of `springtune.studies.runs.checked_json.hash_of` in JSON."""

TIMES = "seconds"
"""Ending of names of values that differ in every run."""

NAMED = 3

STORED, MESH_FILE, MESHES = ".h5", ".vtu", "meshes"


ELSEWHERE = f"{TASKS}/elsewhere.json"
"""Note of files with results of other machines."""


class MergeError(StudyError):
    """Results that do not fit together; the message names them and the remedy."""


class _NotStoredError(Exception):
    """The result of a task is not stored."""


class _OnlyStored(TaskCosts):
    """Costs of jobs that must find all results stored."""

    def attempt(self, key: str, function: Callable[[], Any], failed: Callable[[str], dict[str, Any]]) -> Any:
        """Refuse to compute."""
        raise _NotStoredError(key)


@dataclass(frozen=True)
class Site:
    """Results of a part."""

    folder: Path
    study: "Study"
    attributes: dict[str, str]


@dataclass(frozen=True)
class Merged:
    """Outcome of a merge: `files` of the parts, `written` ones, and jobs `left` to run."""

    folder: Path
    files: int
    written: int
    missing: list[str]
    left: int


def merge_sites(study: "Study", folders: Sequence[Path], incomplete: bool = False) -> Merged:
    """Merge the parts' results into ``results/<study>``.

    No file is ever half written, so an interrupted merge can be repeated. Existing results stay.
    """
    target = Path("results", study.name)
    locks.check_claim(target, study.path)
    for folder in (target, *folders):
        locks.check_idle(folder)
    sites = [_site(study, folder) for folder in folders]
    missing = [*_absent(study, sites)]
    places: dict[Path, list[Path]] = defaultdict(list)
    for site in sites:
        found, faults = _examined(site)
        missing += faults
        for place in found:
            places[place].append(site.folder / place)
    if missing and not incomplete:
        remedy = "nothing is merged; --incomplete merges what is there, and the study computes the rest"
        raise MergeError(*missing, remedy)
    locks.begin([target])
    try:
        locks.claim(target, study.path)
        written = take_in(study, places, target)
        left = adopt(study, target, os.cpu_count() or 1)
    finally:
        locks.end()
    return Merged(target, len(places), written, missing, left)


def take_in(study: "Study", places: Mapping[Path, Sequence[Path]], target: Path) -> int:
    """Compare stored files, then add them to a study's results."""
    names = {scene_key(study, scene): study.name_of(scene) for scene in study.scenes}
    found = {place: _union(target / place, paths, names) for place, paths in sorted(places.items())}
    makes = {place: make for place, make in found.items() if make}
    atomic.remove_unfinished(target)
    if makes:
        before: dict[str, list[str]] = checked_json.read(target / ELSEWHERE, files=list) or {"files": []}
        checked_json.write(
            target / ELSEWHERE, {"files": sorted({*before["files"], *(place.as_posix() for place in makes)})}
        )
    for make in makes.values():
        make()
    return len(makes)


def _site(study: "Study", folder: Path) -> Site:
    """Read and check the folder of a part."""
    path = folder / rerun.DATASET
    if not folder.is_dir():
        raise MergeError(f"{folder}: there is no such folder; give the folders of results of all parts")
    if not path.is_file():
        raise MergeError(f"{folder}: has no {rerun.DATASET}; run this part to its end, where it was computed")
    try:
        found = attributes(path)
    except (OSError, ValueError) as error:
        raise MergeError(f"{error}; run this part again, where it was computed") from None
    text = found.get("config", "")
    if not is_part(text):
        raise MergeError(f"{folder}: is not of a part of a study; give the results of what `springtune split` wrote")
    if digest_of(whole_text(text)) != digest_of(study.text):
        why = _difference(whole_text(text), study.text)
        raise MergeError(
            f"{folder}: is a part of another study than {study.path}: {why}; split this one and run its parts"
        )
    said = read_yaml(text, str(path))[0]["part"]
    part = Part(int(said["number"]), int(said["of"]), said["by"], said["study"])
    name = found["study"]
    return Site(folder, part_of(replace(study, name=name, part=part)), found)


def _difference(one: str, other: str) -> str:
    """First line in which texts differ."""
    lines, others = one.splitlines(), other.splitlines()
    for number, (mine, its) in enumerate(zip(lines, others), 1):
        if mine != its:
            return f"line {number} is '{clipped(mine.strip())}' there and '{clipped(its.strip())}' here"
    return f"it has {len(lines)} lines there and {len(others)} here"


def _absent(study: "Study", sites: Sequence[Site]) -> Iterator[str]:
    """Missing parts with their scenes."""
    parts = [site.study.part for site in sites if site.study.part]
    ways = {(part.of, part.by): site.folder for part, site in zip(parts, sites)}
    if len(ways) > 1:
        told = ", ".join(f"{folder} of {count} by {by}" for (count, by), folder in ways.items())
        raise MergeError(f"parts of different splits do not make up a study: {told}; give those of one")
    for number in sorted(set(range(1, parts[0].of + 1)) - {part.number for part in parts}):
        own = part_of(replace(study, part=replace(parts[0], number=number)))
        scenes = _listed([own.name_of(scene) for scene in own.scenes], "scenes")
        yield f"part {number} of {parts[0].of} is not among them: {scenes or 'no scenes, other tasks'}"


def _listed(names: Sequence[str], what: str) -> str:
    """Count and first names of a list; empty for none."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return f"{len(names)} {what} ({', '.join(names[:NAMED])}{more})" if names else ""


def _examined(site: Site) -> tuple[list[Path], list[str]]:
    """Undamaged products of a part, and its faults."""
    found, damaged = dict[Path, None](), list[str]()
    done: set[str] = set()
    for path in sorted((site.folder / TASKS).glob("*_*.json")):
        note = checked_json.read(path, digest=str)
        record = checked_json.read(site.folder / RECORDS / path.name, digest=str, products=dict)
        if note is None or record is None or note["digest"] != record["digest"]:
            continue
        whole = True
        for product, known in record["products"].items():
            if known is None:
                continue
            place = Path(product).relative_to(Path("results", site.attributes["study"]))
            file = site.folder / place
            if file.is_file() and file.stat().st_size == known[0] and records.checksum(file) == known[2]:
                if is_stored(place):
                    found[place] = None
            else:
                damaged.append(f"{file} is {'damaged' if file.is_file() else 'missing'}")
                whole = False
        done |= set(keys_of(note["content"])) if whole else set()
    jobs = plan(site.study, Path("results", site.study.name), 1).jobs
    lacking = {name: set(keys_of(job.content)) - done for name, job in jobs.items()}
    lost = set().union(*lacking.values())
    if not lost:
        return [*found], []
    scenes = [site.study.name_of(scene) for scene in site.study.scenes if scene_key(site.study, scene) in lost]
    stages = sorted({jobs[name].stage.name for name, keys in lacking.items() if keys})
    what = _listed(scenes, "scenes") or f"results of {', '.join(stages)}"
    again = f"run {site.attributes['study']}.yaml again, where it was computed"
    if damaged:
        return [*found], [f"{site.folder}: {_listed(damaged, 'files')}, and so are not whole: {what}; {again}"]
    return [*found], [f"{site.folder}: computed in another way than here, or not yet: {what}; {_otherwise(site)}"]


def is_stored(place: Path) -> bool:
    """Return whether a file holds results by key; others are derived from these."""
    return place.suffix == STORED or place.parent.name == MESHES


def _otherwise(site: Site) -> str:
    """Difference of a site's installation from this one, with the remedy."""
    from ..runs.provenance import library_commit  # here: a merge that fits asks for nothing of it

    software = json.loads(site.attributes.get("software", "{}"))
    packages = {name: version for name, version in software.items() if name != "python" and installed(name) != version}
    told = [f"{name} {version} there and {installed(name)} here" for name, version in packages.items()]
    python = ".".join(software.get("python", "").split(".")[:2])
    here = f"{sys.version_info[0]}.{sys.version_info[1]}"
    if python and python != here:
        told.insert(0, f"Python {python} there and {here} here")
    commit, own = site.attributes.get("git_commit", ""), library_commit()
    if not told and commit != own:
        told = [f"the code is {commit or 'of no commit'} there and {own or 'of no commit'} here"]
    if not told:
        return f"run {site.attributes['study']}.yaml to its end, where it was computed"
    return f"{', '.join(told)}; install the same in both places and run the part again where it was another"


def keys_of(content: Any) -> list[str]:
    """Keys of results and their inputs in a task."""
    return HASH.findall(json.dumps(content))


def _union(target: Path, paths: Sequence[Path], names: Mapping[str, str]) -> Callable[[], None] | None:
    """Return what writes the merged file, or None if it need not change."""
    if target.parent.name == MESHES:
        return _mesh(target, paths)
    before = store.contents(target) if store.stored(target) else {}
    found, origin = dict(before), dict.fromkeys(before, target)
    for path in paths:
        try:
            check_alone(path)
        except (OSError, ValueError) as error:
            raise MergeError(f"{error}; run this part again, where it was computed") from None
        for key, result in store.contents(path).items():
            if key not in found or (store.LIMITS in found[key] and store.LIMITS not in result):
                found[key], origin[key] = result, path
            elif store.LIMITS not in result and not _same(found[key], result):
                what = names.get(key.partition("/")[0], f"result {key}")
                raise MergeError(
                    f"{what}: {origin[key]} and {path} differ, though all that it depends on is the same; nothing is "
                    "merged: compute it again in both places, one of which computes wrongly or not as its packages say"
                )
    new = {key: result for key, result in found.items() if origin[key] != target}
    if not new:
        return None
    if not before and len(paths) == 1:
        return lambda: atomic.write_bytes(target, paths[0].read_bytes())
    return lambda: store.add(target, new)


def _mesh(target: Path, paths: Sequence[Path]) -> Callable[[], None] | None:
    """As `_union`, for a mesh or its notes, which come from one part."""
    if target.suffix == MESH_FILE and len({records.checksum(path) for path in paths}) > 1:
        told = " and ".join(map(str, paths))
        raise MergeError(
            f"{told} differ, though all that they depend on is the same; nothing is merged: split into fewer parts, so "
            "that each mesh is made once, or give this one as a file (`mesh_files`)"
        )
    content = paths[0].read_bytes()
    if target.is_file() and target.read_bytes() == content:
        return None
    return lambda: atomic.write_bytes(target, content)


def _same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    """Return whether results agree bit by bit, run times apart."""
    names = {name for name in {**one, **other} if not name.endswith(TIMES)}
    return all(name in one and name in other and _as_text(one[name]) == _as_text(other[name]) for name in names)


def _as_text(value: Any) -> Any:
    return (value.dtype.str, value.shape, value.tobytes()) if isinstance(value, np.ndarray) else repr(value)


def adopt(study: "Study", folder: Path, cores: int) -> int:
    """Record jobs as done whose results are all stored; existing records stay."""
    planned = plan(study, folder, cores)
    planned.write()
    left = 0
    for job in planned.jobs.values():
        record, took = planned.record(job.name), folder / f"benchmarks/{job.name}.tsv"
        if not records.fault(record, job.digest, job.products):
            # Snakemake runs a job that is older than one before it, be it only by the file of what it took.
            for path in filter(Path.exists, (record, took)):
                path.touch()
            continue
        costs = _OnlyStored(Watch(study.limits))
        try:
            driver.run(job.stage.module, job.content, costs)
        except (_NotStoredError, DamagedError):
            left += 1
            continue
        took.unlink(missing_ok=True)  # of another run than this
        records.write(record, job.digest, job.products, **costs.summary())
    return left


def merge_text(merged: Merged, parts: Iterable[Path]) -> str:
    """Report of a merge."""
    lines = [f"{merged.folder}: {len([*parts])} parts, {merged.files} files, {merged.written} of them written"]
    if merged.missing:
        lines += ["still to be computed:", *(f"  {line}" for line in merged.missing)]
    return "\n".join(map(shown, lines))


# -- split -------------------------------------------------------------------------------------------------------------


def write_parts(study: "Study", count: int, by: str, folder: Path) -> "list[tuple[Study, float]]":
    """Write the files of all parts, or none; return each with its share of the study's expected time [1]."""
    if study.part:
        which = f"part {study.part.number} of {study.part.of}"
        raise StudyError(f"{study.path}: is {which} of a study already; split the whole one")
    digest, written = digest_of(study.text), []
    for number, (cost, share) in enumerate(dealt(study, count, by), 1):
        path = folder / f"{study.name}-{number}-of-{count}.yaml"
        if not NAME.fullmatch(path.stem):
            raise StudyError(f"{study.path}: '{path.stem}' cannot name a part; rename the study: {NAME_RULE}")
        if path.exists() and not is_part(path.read_text(errors="replace")):
            raise StudyError(f"{path}: is another study, and no part of one; rename it, or write to another folder")
        own = taken(replace(study, name=path.stem, path=path, part=Part(number, count, by, digest)), share)
        written.append((own, cost))
    beside = study.path.parent.resolve()
    named = named_files(study.text, study.path) if folder.resolve() != beside else ()
    for file in named:
        if not file.is_relative_to(beside):
            raise StudyError(f"{file}: the study names it, and it is not beside the study; copy it there, or write the "
                             "parts beside the study")  # fmt: skip
    copied = {folder / file.relative_to(beside): file.read_bytes() for file in named}
    for place, content in copied.items():
        atomic.write_bytes(place, content)
    for own, _ in written:
        if own.part:
            atomic.write_text(own.path, part_text(study.text, own.part))
    return written


def share_table(written: "Iterable[tuple[Study, float]]") -> list[list[object]]:
    """Table of the parts, with a head."""
    rows: list[list[object]] = [["part", "scenes", "curves", "of the cost", "besides"]]
    for own, share in written:
        besides = ", ".join(kind for kind, held in own.parts.items() if held and kind != "scenes")
        rows.append([str(own.path), len(own.scenes), len(own.curves), f"{100 * share:.0f} %", besides])
    return rows


# -- packs: the results of a stage as one object, with checksums ----------------------------------------------------

CONTENTS = "contents.json"
"""First file in a pack: checksums by name."""

ENDING = ".tar"

UNPACKED = "fetched"
"""Folder in which packs are unpacked."""


class PackError(Exception):
    """A damaged pack."""


def pack(folder: Path, done: Sequence[Path], output: Path) -> None:
    """Pack the products of jobs; the same results give the same bytes."""
    made: dict[str, list[object] | None] = {}
    for record in done:
        made |= checked_json.demand(record)["products"]
    files = {Path(name).relative_to(folder).as_posix(): known[2] for name, known in sorted(made.items()) if known}
    with atomic.replacing(output) as unfinished, tarfile.open(unfinished, "w", format=tarfile.PAX_FORMAT) as archive:
        _add(archive, CONTENTS, json.dumps(files, indent=1).encode())
        for name, checksum in files.items():
            if records.checksum(folder / name) != checksum:
                raise PackError(f"{folder / name}: is not what its job made; run the study, which makes it again")
            _add(archive, name, (folder / name).read_bytes())


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size, member.mode = len(content), 0o644
    archive.addfile(member, io.BytesIO(content))


def unpack(path: Path, folder: Path) -> list[Path]:
    """Unpack a pack."""
    remedy = "publish it again from where the study was run"
    try:
        with tarfile.open(path, "r:") as archive:
            members = {member.name: member for member in archive.getmembers()}
            files = json.loads(_content(archive, members[CONTENTS]))
            for name, checksum in files.items():
                if PurePosixPath(name).is_absolute() or ".." in PurePosixPath(name).parts:
                    raise PackError(f"{path}: names a file elsewhere, '{name}'; it is no pack of springtune")
                atomic.write_bytes(folder / name, _content(archive, members[name]))
                if records.checksum(folder / name) != checksum:
                    raise PackError(f"{path}: '{name}' is not what was packed; {remedy}")
    except (tarfile.TarError, EOFError, KeyError, ValueError) as error:
        raise PackError(f"{path}: is not whole: {error}; {remedy}") from None
    return [Path(name) for name in files]


def _content(archive: tarfile.TarFile, member: tarfile.TarInfo) -> bytes:
    file = archive.extractfile(member)
    return file.read() if file else b""


def fetch(config: str, packs: Sequence[Path]) -> str:
    """Add the results of packs to a study, and record finished jobs."""
    study = load_study(config)
    folder = Path("results", study.name)
    place = folder / UNPACKED
    shutil.rmtree(place, ignore_errors=True)
    try:
        names = [name for one in packs for name in unpack(one, place)]
        stored = {name: [place / name] for name in names if is_stored(name)}
        written = take_in(study, stored, folder)
        left = adopt(study, folder, 1)
    finally:
        shutil.rmtree(place, ignore_errors=True)
    rest = f"; {left} jobs are left for `springtune run {config}`" if left else "; all that it asks for is here"
    return f"{folder}: {len(packs)} packs, {len(stored)} files, {written} of them written{rest}"


def copy(output: Sequence[Path], files: Sequence[Path]) -> None:
    """Copy files to new names."""
    for path, file in zip(output, files, strict=True):
        with atomic.replacing(path) as unfinished:
            shutil.copyfile(file, unfinished)


def main(what: str, *arguments: str) -> None:
    """Run the command of a rule."""
    try:
        if what == "pack":
            folder, output, *done = map(Path, arguments)
            pack(folder, done, output)
        elif what == "fetch":
            print(fetch(arguments[0], [*map(Path, arguments[1:])]))
        else:
            half = len(arguments) // 2
            copy([*map(Path, arguments[:half])], [*map(Path, arguments[half:])])
    except (PackError, MergeError) as error:
        raise SystemExit(str(error)) from None


if __name__ == "__main__":
    main(*sys.argv[1:])
