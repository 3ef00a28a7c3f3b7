"""Text files that appear whole or not at all."""

import json
import os
from pathlib import Path


def write_text(path, text):
    """Write a text in UTF-8; folders are made where they are missing."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    os.replace(unfinished, path)


def write_json(path, content):
    """Write JSON; the file appears whole or not at all."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def read_json(path):
    """Content of a JSON file."""
    return json.loads(Path(path).read_text())
