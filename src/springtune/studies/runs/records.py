"""Records of jobs: what each did, and size, time and checksum of its products.

A job is done if its record matches the current request and its products are unchanged.
"""

import hashlib
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from . import checked_json

MISSING, DAMAGED = " is missing", " is damaged"
"""Endings of faults, after the file's name."""


def checksum(path: str | Path) -> str:
    """SHA-256 of a file."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write(path: str | Path, digest: str, products: Iterable[str | Path], **more: Any) -> None:
    """Write the record of a finished job."""
    made: dict[str, list[Any] | None] = {}
    for product in map(Path, products):
        made[str(product)] = None
        if product.exists():
            state = product.stat()
            made[str(product)] = [state.st_size, state.st_mtime_ns, checksum(product)]
    checked_json.write(path, {"digest": digest, "products": made} | more)


def fault(path: str | Path, digest: str, products: Iterable[str | Path], wholly: bool = False) -> str:
    """Return why a job must run, or an empty string."""
    return next(faults(path, digest, products, wholly), "")


def faults(path: str | Path, digest: str, products: Iterable[str | Path], wholly: bool = False) -> Iterator[str]:
    """All reasons why a job must run."""
    path = Path(path)
    if not path.exists():
        yield "not done yet"
        return
    record = checked_json.read(path, digest=str, products=dict)
    if record is None:
        yield f"{path}{DAMAGED}"
        return
    if record["digest"] != digest:
        yield "something else is asked for"
        return
    # A job may make more than it is known to before it runs.
    for product in map(Path, dict.fromkeys([*map(str, products), *record["products"]])):
        known = record["products"].get(str(product))
        try:
            state = product.stat()
        except OSError:
            if known is not None:
                yield f"{product}{MISSING}"
            continue
        if known is None:
            yield f"{product} is not what this job made"
            continue
        size, time, content = known
        if (wholly or state.st_mtime_ns != time or state.st_size != size) and (
            state.st_size != size or checksum(product) != content
        ):
            yield f"{product}{DAMAGED}"
