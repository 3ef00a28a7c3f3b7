"""Files that appear whole or not at all."""

import json
import os
from pathlib import Path
from typing import Any


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a file; folders are made where they are missing.

    Parameters
    ----------
    path : str or Path
    content : bytes
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".unfinished")
    unfinished.write_bytes(content)
    os.replace(unfinished, path)


def write_text(path: str | Path, text: str) -> None:
    """Write a text in UTF-8; folders are made where they are missing.

    Parameters
    ----------
    path : str or Path
    text : str

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_text(Path(folder) / "deep/note.txt", "all of it")
    ...     (Path(folder) / "deep/note.txt").read_text()
    'all of it'
    """
    write_bytes(path, text.encode())


def write_json(path: str | Path, content: Any) -> None:
    """Write JSON; the file appears whole or not at all.

    Parameters
    ----------
    path : str or Path
    content : object
        Dicts, lists, numbers and texts.
    """
    write_text(path, json.dumps(content, indent=1) + "\n")


def read_json(path: str | Path) -> Any:
    """Content of a JSON file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    object

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_json(Path(folder) / "note.json", {"seconds": 0.25})
    ...     read_json(Path(folder) / "note.json")
    {'seconds': 0.25}
    """
    return json.loads(Path(path).read_text())
