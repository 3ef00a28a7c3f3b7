"""What writes scenes and results: the room that hands springs over, above this one, found when something is written."""

from importlib import import_module
from typing import Any


def writer() -> Any:
    """Module `springtune.handover.written`, by name, for the reason that `springtune.scene.drawing` gives."""
    return import_module("springtune.handover.written")
