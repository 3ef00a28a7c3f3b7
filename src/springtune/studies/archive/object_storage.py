"""Packs: the results of a stage as one object for object storage, with checksums."""

import io
import json
import shutil
import sys
import tarfile
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from springtune.safe_io import atomic

from ..kinds import load_study
from ..runs import checked_json, records
from .parts import MergeError, adopt, is_stored, take_in

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
