"""Check an archive and compute its study again."""

import hashlib
import json
import os
import re
import shutil
import stat
import struct
import subprocess
import sys
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from io import BufferedReader, FileIO
from math import isfinite
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from springtune.safe_io.inputs import fault

from ..output import reading
from ..runs import records, rerun
from . import contents
from .contents import CODE, METADATA, MOST_FILES, MOST_TEXT, OF_RESULTS, SUMS, several

if TYPE_CHECKING:
    from ..output.comparison import Comparison

MADE_BY = "https://w3id.org/ro/wfrun/provenance/0.5"
"""Profile that identifies an archive."""

OF_MACHINE = {"/benchmark", "/engines", "/engine_curves"}
"""Groups whose cases depend on the machine: `most_seconds`, CalculiX, CHOLMOD; engines that are installed."""

UNZIPPED = 2**20

MOST_RATIO = 100
"""Limit of unpacked over packed size; studies stay far below."""

LONGEST_MEMBER = 1000


class ReproductionError(ValueError):
    """An archive cannot be reproduced; the message names the reason and the remedy."""


@dataclass
class Checked:
    """A checked archive: names in it, the jobs' total `seconds` and the `machine` as far as stated."""

    path: Path
    sha256: str
    files: int = 0
    faults: dict[str, str] = field(default_factory=dict)
    title: str = ""
    study: str = ""
    config: str = ""
    dataset: str = ""
    version: str = ""
    seconds: float = 0.0
    machine: dict[str, str] = field(default_factory=dict)


def check(path: Path) -> Checked:
    """Compare an archive's files with checksums and metadata."""
    why = fault(path)
    if why:
        raise ReproductionError(f"{path}: cannot be read ({why}); give an archive")
    digest = records.checksum(path)
    with _Bounded(FileIO(path)) as file:
        try:
            archive = zipfile.ZipFile(file)
        except UNREADABLE as error:
            raise ReproductionError(f"{path}: is no whole zip file ({error}); get it again") from None
        return _checked(Checked(path, digest), archive)


UNREADABLE = (
    zipfile.BadZipFile, zlib.error, struct.error, OSError, EOFError, ValueError, RuntimeError, OverflowError
)  # fmt: skip
"""Errors of zipfile on damaged files; RuntimeError on encrypted ones."""


class _Bounded(BufferedReader):
    """File with bounded reads: zipfile reads lists at once."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > MOST_TEXT:
            raise zipfile.BadZipFile(f"more than {MOST_TEXT} bytes at once")
        return super().read(size)


def _checked(found: Checked, archive: zipfile.ZipFile) -> Checked:
    infos = archive.infolist()
    _check_sizes(found.path, infos)
    names = [info.filename for info in infos if not info.filename.endswith("/")]
    found.faults |= {name: "is there twice" for name, count in Counter(names).items() if count > 1}
    ordered = sorted(name.replace("/", "\0") for name in names)  # what is below a name comes next
    pairs = zip(ordered, ordered[1:])
    above = {one.replace("\0", "/") for one, after in pairs if after.startswith(f"{one}\0")}
    found.faults |= dict.fromkeys(above, "is a file and a folder")
    found.faults |= {info.filename: why for info in infos if (why := _unusual(info))}
    if METADATA not in names:
        raise ReproductionError(f"{found.path}: is no archive of a study, it has no {METADATA}; see springtune archive")
    sums, listed = {}, {}
    made = {name: _digest(archive, name) for name in dict.fromkeys(names)}
    if made[METADATA]:
        listed = _listed(found, archive.read(METADATA))
        found.faults |= {name: "is missing" for name in (found.config, found.dataset) if name not in made}
    if made.get(SUMS):
        sums = {name: digest for digest, name in re.findall(SUM, archive.read(SUMS).decode(errors="replace"))}
    else:
        found.faults[SUMS] = "is damaged" if SUMS in names else "is missing"
    for name, digest in made.items():
        told = [given[name] for given in (sums, listed) if name in given]
        if digest is None or any(one != digest for one in told):
            found.faults.setdefault(name, "is damaged: its checksum is another one")
        elif not told and name not in (SUMS, METADATA):
            found.faults.setdefault(name, "was not packed: it is listed nowhere")
        found.files += 1
    for name in (sums.keys() | listed.keys()) - made.keys():
        found.faults[name] = "is missing"
    return found


SUM = re.compile("^([0-9a-f]{64})  (.+)$", re.MULTILINE)


def _check_sizes(path: Path, infos: list[zipfile.ZipInfo]) -> None:
    """Refuse archives whose stated sizes exceed memory or time; unpacking stops at them."""
    if len(infos) > MOST_FILES:
        raise ReproductionError(f"{path}: has {len(infos)} files, and at most {MOST_FILES} are read; get it again")
    texts = [(info.filename, info.file_size) for info in infos if info.filename in (METADATA, SUMS)]
    whole = ("all of it", sum(info.file_size for info in infos))
    limits = [(*text, MOST_TEXT) for text in texts] + [(*whole, MOST_RATIO * path.stat().st_size)]
    for name, size, most in limits:
        if size > most:
            raise ReproductionError(
                f"{path}: {name} has {size} bytes unpacked, and at most {most} are read; get it again"
            )


def _unusual(info: zipfile.ZipInfo) -> str:
    """Return what is unusual about a file, or an empty string."""
    name, place = info.filename.removesuffix("/"), PurePosixPath(info.filename)
    if place.is_absolute() or ".." in place.parts or "\\" in name:
        return "leads out of the archive"
    if str(place) != name or len(name) > LONGEST_MEMBER:
        return "is no plain name"
    if stat.S_IFMT(info.external_attr >> 16) not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is a link or a device"
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        return "is packed by another method"
    return ""


def _digest(archive: zipfile.ZipFile, name: str) -> str | None:
    """SHA-256 of a file; None if it cannot be unpacked."""
    made, info, size = hashlib.sha256(), archive.getinfo(name), 0
    if _unusual(info):  # other methods unpack without a bound
        return None
    try:
        with archive.open(name) as file:
            while part := file.read(UNZIPPED):
                made.update(part)
                size += len(part)
    except UNREADABLE:
        return None
    return made.hexdigest() if size == info.file_size else None


def _listed(found: Checked, text: bytes) -> dict[str, str]:
    """Checksums by file in the metadata; also sets facts of the study."""
    try:
        graph = {_text(one["@id"]): one for one in json.loads(text)["@graph"]}
        root, workflow = graph["./"], graph[f"{CODE}/Snakefile"]
        profiles = [one["@id"] for one in several(root["conformsTo"])]
        if MADE_BY not in profiles:
            raise ValueError(MADE_BY)
        found.title, found.version = _text(root["name"]), _text(root["version"])
        found.config, found.dataset = (
            unquote(_text(graph[workflow[key]["@id"]]["workExample"]["@id"])) for key in ("input", "output")
        )
        folder, found.study, name = PurePosixPath(found.dataset).parts
        if (folder, name) != (OF_RESULTS, rerun.DATASET) or ".." in PurePosixPath(found.config).parts:
            raise ValueError(found.dataset)
        for name, one in graph.items():
            if name.startswith("#machine-"):
                found.machine[_text(one["name"])] = _text(one["value"])
            if one.get("@type") == "PropertyValue" and name.endswith("-s"):
                found.seconds += float(one.get("value", 0))
        if not isfinite(found.seconds):
            raise ValueError(found.seconds)
        return {unquote(name): _text(one["sha256"]) for name, one in graph.items() if "sha256" in one}
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise ReproductionError(
            f"{found.path}: is no archive of a study of springtune, or its {METADATA} is damaged; get it again"
        ) from None


def _text(value: Any) -> str:
    """Return a valid text; unpaired surrogates are refused."""
    if not isinstance(value, str):
        raise TypeError(value)
    value.encode()
    return value


# -- computed again ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reproduced:
    """Outcome of a reproduction.

    `exact` and `near` list differences in bits and beyond the tolerance. `others` are changed versions and processor,
    before and after. Groups of `OF_MACHINE` with cases that `ended_otherwise` are not compared.
    """

    exact: "Comparison"
    near: "Comparison"
    others: dict[str, tuple[str, str]]
    ended_otherwise: int = 0

    @property
    def same(self) -> bool:
        """Whether results agree: to the bit, or within the tolerance if software or machine differ."""
        return not self.exact.different or (bool(self.others) and not self.near.different)


def own_environment(lock: Path, python: str) -> dict[str, tuple[str, str]]:
    """Installed versions that differ from the archive's."""
    found = contents.departures(lock)
    here, wanted = (contents.minor(version) for version in (sys.version.split()[0], python))
    return found | ({"python": (wanted, here)} if wanted != here else {})


def reproduce(found: Checked, folder: Path, fresh: bool, say: Callable[[str], None]) -> Reproduced:
    """Compute an archived study again by its own program, and compare."""
    with zipfile.ZipFile(found.path) as archive:
        _unpack(archive, folder, without=str(PurePosixPath(found.dataset).parent) + "/", but=found.dataset)
    kept, code = folder / found.dataset, folder / CODE
    with reading.open(kept) as tree:
        python = json.loads(tree.attrs["software"])["python"]
    program = _python(code, python, fresh, say)
    config = os.path.relpath(folder / found.config, code)
    target = f"results/{found.study}/{rerun.DATASET}"
    say(f"running: snakemake --configfile {config} {target}")
    around = {name: value for name, value in os.environ.items() if name not in UNWANTED}
    around |= {"PYTHONPATH": str(code / "src"), "PYTHONNOUSERSITE": "1"}
    around["PATH"] = os.pathsep.join([str(program.parent), around.get("PATH", os.defpath)])
    command = [str(program), "-m", "snakemake", target, f"--configfile={config}"]
    done = subprocess.run(command, cwd=code, env=around, stdout=sys.stderr)
    if done.returncode or not (code / target).is_file():
        raise ReproductionError(
            f"the study could not be run (exit code {done.returncode}); what went wrong stands above"
        )
    return compared(kept, code / target, found.machine)


UNWANTED = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "SNAKEMAKE_PROFILE", "SPRINGTUNE_SOLVER")
"""Environment variables that must not reach the reproducing process."""


def _unpack(archive: zipfile.ZipFile, folder: Path, without: str, but: str) -> None:
    """Unpack files with their permissions, without results."""
    for info in archive.infolist():
        if info.is_dir() or (info.filename.startswith(without) and info.filename != but):
            continue
        path = folder / info.filename
        path.parent.mkdir(parents=True, exist_ok=True)
        with archive.open(info) as packed, open(path, "wb") as file:
            shutil.copyfileobj(packed, file, UNZIPPED)
        if info.external_attr >> 16 & 0o100:
            path.chmod(0o755)


def _python(code: Path, python: str, fresh: bool, say: Callable[[str], None]) -> Path:
    """Python to run a checkout with: this one if it matches, else of a new contents."""
    others = own_environment(code / contents.LOCK_FILES[0], python)
    if not others and not fresh:
        say("environment: this one, whose packages are those of the archive's lock file")
        return Path(sys.executable)
    told = ", ".join(f"{name} is {here}, not {wanted}" for name, (wanted, here) in list(others.items())[:5])
    why = f"since here {told}" if others else "as asked"
    say(f"environment: a new one from the archive's lock file, {why}; this downloads packages")
    around = {name: value for name, value in os.environ.items() if name not in UNWANTED}
    done = subprocess.run(["sh", "tools/setup.sh", "run"], cwd=code, env=around, stdout=sys.stderr)
    if done.returncode:
        raise ReproductionError(
            f"the environment could not be set up (exit code {done.returncode}), see above: it needs Python "
            f"{contents.minor(python)} as python3, and a package registry"
        )
    return code / ".venv/bin/python"


def compared(kept: Path, made: Path, machine: dict[str, str]) -> Reproduced:
    """Compare the archived dataset with a new one."""
    from ..output.comparison import Tolerance, compare

    with reading.open(kept) as before, reading.open(made) as after:
        exact = compare(before, after, Tolerance(0.0, 0.0))
        groups: list[str] = []
        changed = {
            group.name: sum(one.changed for one in group.flags) for group in exact.groups if group.name in OF_MACHINE
        }
        ended_otherwise = sum(changed.values())
        if ended_otherwise:
            elsewise = {name for name, count in changed.items() if count}
            groups = sorted({node.path for tree in (before, after) for node in tree.subtree} - elsewise)
            exact = compare(before, after, Tolerance(0.0, 0.0), groups)
        near = compare(before, after, groups=groups) if exact.different else exact
        versions = [json.loads(tree.attrs["software"]) for tree in (before, after)]
    here = contents.machine()
    pairs = {name: (versions[0].get(name, "none"), versions[1].get(name, "none")) for name in versions[0] | versions[1]}
    pairs |= {
        name: (machine.get(name, "not told"), here.get(name, "not told")) for name in ("architecture", "processor")
    }
    others = {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}
    return Reproduced(exact, near, others, ended_otherwise)
