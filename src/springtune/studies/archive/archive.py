"""An archive of a finished study: all that another machine needs to check it, and to compute it again.

It is a zip file that is an RO-Crate (`springtune.studies.archive.crate`):

    ro-crate-metadata.json, README.md, SHA256SUMS
    code/               package, rules, lock files and what builds them, as in the checkout; the study
    code.diff           what of package, rules and study differs from the commit
    inputs/             the study and its files, where they are outside of the checkout
    results/<study>/    dataset, page, figures, tables, summary; what each job made, and how long it took
"""

import shutil
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.safe_io import atomic

from ..runs import records
from . import crate
from .contents import CITATION, METADATA, MOST_FILES, MOST_TEXT, SUMS, ArchiveError, gather, of_text

if TYPE_CHECKING:
    from ..config.model import Study
    from .contents import Contents, Packed

PACKED_AT = (1980, 1, 1, 0, 0, 0)
"""Time of every archived file, zip's earliest, so that the same study gives the same bytes."""


def write(
    study: "Study",
    folder: Path,
    target: Path,
    store: bool = False,
    untracked: bool = False,
    chosen: Mapping[str, bool] | None = None,
    tell: "Callable[[Contents], None] | None" = None,
) -> str:
    """Write the archive of a study atomically."""
    try:
        atomic.check_folder(target)
    except ValueError as error:
        raise ArchiveError(str(error)) from None
    with tempfile.TemporaryDirectory() as scratch:
        found = gather(study, folder, Path(scratch), store, untracked, chosen)
        cited = crate.citation(Path(CITATION))
        if tell:
            tell(found)
        packed = dict(found.files)
        packed |= {METADATA: of_text(METADATA, crate.metadata(found, cited))}
        sums = "".join(f"{one.sha256}  {name}\n" for name, one in sorted(packed.items()))
        packed |= {SUMS: of_text(SUMS, sums)}
        check_limits(packed)
        _zip(target, packed.values())
    return records.checksum(target)


def check_limits(packed: "Mapping[str, Packed]") -> None:
    """Refuse archives that `springtune verify` would refuse."""
    texts = max(packed[name].size for name in (METADATA, SUMS))
    if len(packed) > MOST_FILES or texts > MOST_TEXT:
        raise ArchiveError(
            f"{len(packed)} files, and an archive holds at most {MOST_FILES}, with {MOST_TEXT} bytes of metadata; "
            "leave out --with-store, or archive parts of the study"
        )


def _zip(target: Path, packed: "Iterable[Packed]") -> None:
    """Write a zip file without time and place of writing."""
    with (
        atomic.replacing(target, synced=True) as unfinished,
        zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive,
    ):
        for one in sorted(packed, key=lambda one: (one.name != METADATA, one.name)):
            info = zipfile.ZipInfo(one.name, PACKED_AT)
            info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 3  # Unix, whatever this system is
            info.external_attr = (0o100755 if one.runs else 0o100644) << 16
            info.file_size = one.size
            source = BytesIO(one.source) if isinstance(one.source, bytes) else open(one.source, "rb")  # noqa: SIM115
            with source, archive.open(info, "w", force_zip64=one.size > zipfile.ZIP64_LIMIT) as written:
                shutil.copyfileobj(source, written)
