"""Write the files of a study's parts for several sites."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.registry import NAME, NAME_RULE
from springtune.safe_io import atomic

from ..config.load import digest_of, is_part, named_files, part_text
from ..config.messages import StudyError
from ..config.model import Part
from ..kinds.division import dealt, taken

if TYPE_CHECKING:
    from ..config.model import Study


@dataclass(frozen=True)
class Written:
    """A written part, with its share of the study's expected time [1]."""

    path: Path
    study: "Study"
    share: float


def write_parts(study: "Study", count: int, by: str, folder: Path) -> list[Written]:
    """Write the files of all parts, or none."""
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
        written.append(Written(path, own, cost))
    copied = _named_files(study, folder)
    for place, content in copied.items():
        atomic.write_bytes(place, content)
    for one in written:
        if one.study.part:
            atomic.write_text(one.path, part_text(study.text, one.study.part))
    return written


def _named_files(study: "Study", folder: Path) -> dict[Path, bytes]:
    """Copies that parts in a folder need of a study's named files."""
    beside = study.path.parent.resolve()
    if folder.resolve() == beside:
        return {}
    files = named_files(study.text, study.path)
    for file in files:
        if not file.is_relative_to(beside):
            raise StudyError(f"{file}: the study names it, and it is not beside the study; copy it there, or write the "
                             "parts beside the study")  # fmt: skip
    return {folder / file.relative_to(beside): file.read_bytes() for file in files}


def told(written: Iterable[Written]) -> list[list[object]]:
    """Table of the parts, with a head."""
    rows: list[list[object]] = [["part", "scenes", "curves", "of the cost", "besides"]]
    for one in written:
        besides = ", ".join(kind for kind, held in one.study.parts.items() if held and kind != "scenes")
        share = f"{100 * one.share:.0f} %"
        rows.append([str(one.path), len(one.study.scenes), len(one.study.curves), share, besides])
    return rows
