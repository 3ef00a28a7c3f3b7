"""Keys of results, and JSON files that appear whole or not at all."""

import hashlib
import json
from pathlib import Path

from ..whole import write_text


def key(*parts):
    """Hash of what a result depends on: nested dicts, lists, texts and numbers."""
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def write_json(path, content):
    """Write JSON; the file appears whole or not at all."""
    write_text(path, json.dumps(content, indent=1) + "\n")


def read_json(path):
    """Content of a JSON file."""
    return json.loads(Path(path).read_text())
