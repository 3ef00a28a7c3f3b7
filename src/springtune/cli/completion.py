"""What a shell completes: values that click cannot know."""

from pathlib import Path

import click
from click.shell_completion import CompletionItem


def studies_here(context: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """Studies in ``config/``, or files where something else is begun."""
    found = [path.as_posix() for path in sorted(Path("config").glob("*.yaml"))]
    chosen = [CompletionItem(path) for path in found if path.startswith(begun)]
    return chosen or [CompletionItem(begun, type="file")]


def mesh_types(context: click.Context, parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """Mesh types, or files where something else is begun."""
    from ..mesh import MESH_TYPES  # here: it is not needed but to complete them

    chosen = [CompletionItem(name) for name in MESH_TYPES if name.startswith(begun)]
    return chosen or [CompletionItem(begun, type="file")]
