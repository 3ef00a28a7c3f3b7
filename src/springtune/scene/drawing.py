"""What draws scenes and curves: the room of the figures, above this one, found when something is drawn."""

from importlib import import_module
from typing import Any


def drawer() -> Any:
    """Module `springtune.output.drawing`.

    By name, since what solves depends on the modules that it imports: an edit of a colour would solve all again.
    """
    return import_module("springtune.output.drawing")
