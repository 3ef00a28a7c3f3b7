"""An archive of a study, checked, and computed again by what is in it; see `springtune.studies.archive.archive`."""

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
from ..runs import rerun
from . import environment
from .contents import CODE, METADATA, MOST_FILES, MOST_TEXT, OF_RESULTS, SUMS

if TYPE_CHECKING:
    from ..output.comparison import Comparison

MADE_BY = "https://w3id.org/ro/wfrun/provenance/0.5"
"""Profile by which an archive is told from other zip files."""

OF_MACHINE = "/benchmark"
"""Group whose cases end by a machine's speed and programs: `most_seconds`, CalculiX, CHOLMOD."""

UNZIPPED = 2**20
"""Bytes that are read at once."""

MOST_RATIO = 100
"""So many times as large as packed an archive may be; those of studies are some times as large."""

LONGEST_MEMBER = 1000
"""Characters of a file's name in an archive."""


class ReproductionError(ValueError):
    """An archive that could not be computed again: why, and what to do about it."""


@dataclass
class Checked:
    """What an archive is.

    Attributes
    ----------
    title, study, config, dataset : str
        Of the study: its title, its name, and the names of its file and of its dataset in the archive.
    seconds : float
        That all jobs took together [s].
    machine : dict of str to str
        That it was computed on, as far as it is told.
    """

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
    """Compare all files of an archive with their checksums, and with what its metadata lists."""
    why = fault(path)
    if why:
        raise ReproductionError(f"{path}: cannot be read ({why}); give an archive")
    with open(path, "rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    with _Bounded(FileIO(path)) as file:
        try:
            archive = zipfile.ZipFile(file)
        except UNREADABLE as error:
            raise ReproductionError(f"{path}: is no whole zip file ({error}); get it again") from None
        return _checked(Checked(path, digest), archive)


UNREADABLE = (
    zipfile.BadZipFile, zlib.error, struct.error, OSError, EOFError, ValueError, RuntimeError, OverflowError
)  # fmt: skip
"""What zipfile raises where a zip file is damaged; RuntimeError where it is encrypted or of another version."""


class _Bounded(BufferedReader):
    """A file of which zipfile cannot read more at once than the texts of an archive may have: it reads lists whole."""

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
"""A line of `SUMS`."""


def _check_sizes(path: Path, infos: list[zipfile.ZipInfo]) -> None:
    """Refuse an archive that would take memory or time, by the sizes that it states; no more is unpacked of a file."""
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
    """What about a file is not as in any archive; empty where there is nothing."""
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
    """SHA-256 of a file; None where it cannot be unpacked."""
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
    """Checksums in the metadata, by file; and what it tells of the study."""
    try:
        graph = {_text(one["@id"]): one for one in json.loads(text)["@graph"]}
        root, workflow = graph["./"], graph[f"{CODE}/Snakefile"]
        profiles = [one["@id"] for one in _several(root["conformsTo"])]
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
    """A value that is to be a text; half of a character is none."""
    if not isinstance(value, str):
        raise TypeError(value)
    value.encode()
    return value


def _several(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [value]


# -- computed again ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reproduced:
    """What came out when an archive was computed again.

    Attributes
    ----------
    exact, near : Comparison
        What differs bit by bit, and beyond the usual tolerance; the archive is before.
    others : dict of str to tuple of str
        What the numbers depend on and what is another one: versions, processor. As it was, and as it is.
    ended_otherwise : int
        Cases of the benchmark that one of the machines did and the other did not; with any, its group is not compared.
    """

    exact: "Comparison"
    near: "Comparison"
    others: dict[str, tuple[str, str]]
    ended_otherwise: int = 0

    @property
    def same(self) -> bool:
        """Whether it came out the same: all bits, or all within the tolerance where software or machine differ."""
        return not self.exact.different or (bool(self.others) and not self.near.different)


def own_environment(lock: Path, python: str) -> dict[str, tuple[str, str]]:
    """What of this program's environment is not what an archive asks for."""
    found = environment.departures(lock)
    here, wanted = (environment.minor(version) for version in (sys.version.split()[0], python))
    return found | ({"python": (wanted, here)} if wanted != here else {})


def reproduce(found: Checked, folder: Path, fresh: bool, say: Callable[[str], None]) -> Reproduced:
    """Compute the study of an archive again by the program in it, and compare the datasets."""
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
"""Of the surroundings of this process, what is not to reach the one that computes."""


def _unpack(archive: zipfile.ZipFile, folder: Path, without: str, but: str) -> None:
    """Unpack files with their leave to run, results apart: these are computed."""
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
    """The Python to run a checkout by: this one where it is the same, else that of an environment of its own."""
    others = own_environment(code / environment.LOCK_FILES[0], python)
    if not others and not fresh:
        say("environment: this one, whose packages are those of the archive's lock file")
        return Path(sys.executable)
    why = (
        "as asked"
        if not others
        else "since here "
        + ", ".join(f"{name} is {here}, not {wanted}" for name, (wanted, here) in list(others.items())[:5])
    )
    say(f"environment: a new one from the archive's lock file, {why}; this downloads packages")
    around = {name: value for name, value in os.environ.items() if name not in UNWANTED}
    done = subprocess.run(["sh", "tools/setup.sh", "run"], cwd=code, env=around, stdout=sys.stderr)
    if done.returncode:
        raise ReproductionError(
            f"the environment could not be set up (exit code {done.returncode}), see above: it needs Python "
            f"{environment.minor(python)} as python3, and a package registry"
        )
    return code / ".venv/bin/python"


def compared(kept: Path, made: Path, machine: dict[str, str]) -> Reproduced:
    """Compare the dataset of an archive with one that was computed here."""
    from ..output.comparison import Tolerance, compare

    with reading.open(kept) as before, reading.open(made) as after:
        exact = compare(before, after, Tolerance(0.0, 0.0))
        groups: list[str] = []
        flags = [one for group in exact.groups if group.name == OF_MACHINE for one in group.flags]
        ended_otherwise = sum(one.changed for one in flags)
        if ended_otherwise:
            groups = sorted({node.path for tree in (before, after) for node in tree.subtree} - {OF_MACHINE})
            exact = compare(before, after, Tolerance(0.0, 0.0), groups)
        near = compare(before, after, groups=groups) if exact.different else exact
        versions = [json.loads(tree.attrs["software"]) for tree in (before, after)]
    here = environment.machine()
    pairs = {name: (versions[0].get(name, "none"), versions[1].get(name, "none")) for name in versions[0] | versions[1]}
    pairs |= {
        name: (machine.get(name, "not told"), here.get(name, "not told")) for name in ("architecture", "processor")
    }
    others = {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}
    return Reproduced(exact, near, others, ended_otherwise)
