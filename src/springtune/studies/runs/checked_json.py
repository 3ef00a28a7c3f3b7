"""Hashes, and JSON notes between jobs with a checksum: a damaged note reads as missing."""

import hashlib
import json
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from springtune.safe_io import atomic

_ENCODER = json.JSONEncoder(sort_keys=True, separators=(",", ":"))


def hash_of(*parts: Any) -> str:
    """Hash values, independent of the order of keys.

    Examples
    --------
    >>> hash_of({"a": 1.0, "b": [2]}) == hash_of({"b": [2], "a": 1.0})
    True
    """
    return hashlib.sha256(_ENCODER.encode(parts).encode()).hexdigest()[:24]


ASIDE = ".damaged"


class DamagedError(Exception):
    """A stored file is damaged or missing."""

    def __init__(self, path: str | Path, why: str, whole: bool = False) -> None:
        super().__init__(f"{path}: {why}")
        self.path, self.whole = Path(path), whole


def rename(path: Path) -> Path:
    """Rename a damaged file so that it is kept."""
    aside = path.with_name(path.name + ASIDE)
    with suppress(FileNotFoundError):  # another job was quicker
        path.replace(aside)
    return aside


def set_aside(error: DamagedError) -> None:
    """Rename a damaged file and report it; a whole file that lacks results keeps its name."""
    told = "computed again"
    if error.path.exists() and not error.whole:
        told = f"set aside as {rename(error.path).name}, and computed again"
    print(f"{error}; {told}", file=sys.stderr)


PREFIX, BETWEEN, SUFFIX = b'{"seal": "', b'",\n"content": ', b"\n}\n"


def write(path: str | Path, content: Any) -> None:
    """Write a note atomically.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(Path(folder) / "note.json", {"seconds": 0.25})
    ...     read(Path(folder) / "note.json")
    {'seconds': 0.25}
    """
    text = json.dumps(content).encode()  # with indents it takes ten times as long
    atomic.write_bytes(path, b"".join([PREFIX, _seal(text), BETWEEN, text, SUFFIX]))


def read(path: str | Path, **parts: type) -> Any:
    """Content of a note, or None if it is damaged.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     note = Path(folder) / "note.json"
    ...     write(note, {"seconds": 0.25})
    ...     _ = note.write_text(note.read_text().replace("0.25", "0.26"))
    ...     print(read(note))
    None
    """
    try:
        text = Path(path).read_bytes()
    except OSError:
        return None
    seal, between, rest = text.removeprefix(PREFIX).partition(BETWEEN)
    content = rest.removesuffix(SUFFIX)
    sound = text.startswith(PREFIX) and between and rest.endswith(SUFFIX) and seal == _seal(content)
    found = json.loads(content) if sound else None
    lacks = parts and not (isinstance(found, dict) and all(isinstance(found.get(name), parts[name]) for name in parts))
    return None if lacks else found


def demand(path: str | Path) -> Any:
    """Content of a note that must exist."""
    content = read(path)
    if content is None:
        raise DamagedError(path, "its checksum is not that of its content" if Path(path).exists() else "it is missing")
    return content


def _seal(text: bytes) -> bytes:
    return hashlib.sha256(text).hexdigest().encode()
