"""Notes that jobs and runs leave for each other: JSON files with a checksum.

Whoever reads one gets what was written, or nothing: a note that was cut short, changed or emptied is as good as none,
and all of them can be made again.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

from springtune.safe_io import atomic

from .damage import DamagedError

PREFIX, BETWEEN, SUFFIX = b'{"seal": "', b'",\n"content": ', b"\n}\n"
"""What stands around the checksum and the content."""


def write(path: str | Path, content: Any) -> None:
    """Write a note; it appears whole or not at all.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(Path(folder) / "note.json", {"seconds": 0.25})
    ...     read(Path(folder) / "note.json")
    {'seconds': 0.25}
    """
    text = json.dumps(content, indent=1).encode()
    atomic.write_bytes(path, b"".join([PREFIX, _seal(text), BETWEEN, text, SUFFIX]))


def read(path: str | Path, **parts: type) -> Any:
    """Content of a note.

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
    """Content of a note that a job has written."""
    content = read(path)
    if content is None:
        raise DamagedError(path, "its checksum is not that of its content" if Path(path).exists() else "it is missing")
    return content


def _seal(text: bytes) -> bytes:
    return hashlib.sha256(text).hexdigest().encode()
