"""Options of commands that take no study: a beam or a shape, its mesh and its material."""

from collections.abc import Callable
from functools import reduce

import click

from .completion import mesh_types
from .options import MATERIALS
from .shape_options import NAMED_SHAPE


def known_materials(context: click.Context, parameter: click.Parameter, begun: str) -> list[str]:
    """Materials whose names begin so, for a shell to complete."""
    return [name for name in MATERIALS if name.startswith(begun)]


Command = Callable[..., None]


def sheet_options(mesh_help: str, mesh_type: str | None = None) -> Callable[[Command], Command]:
    """Decorator that adds them to a command, with what its mesh may be, and is without the option."""
    each = (
        click.option("--beam", help="Length x height in mm, such as 200x40."),
        click.option(
            "--shape",
            help=f"A study's shape, such as {NAMED_SHAPE}, in the place of a beam; the name may be left out where "
            "there is one.",
        ),
        click.option("--thickness", default="1 mm", show_default=True, help="Thickness of the sheet."),
        click.option(
            "--mesh", "mesh_type", default=mesh_type, show_default=True, shell_complete=mesh_types, help=mesh_help
        ),
        click.option("--size", help="Length of an edge, such as '2 mm'; not for a mesh file."),
        click.option("--unit", default="1 m", show_default=True, help="Unit of the coordinates in a mesh file."),
        click.option(
            "--material",
            shell_complete=known_materials,
            help=f"One of {', '.join(MATERIALS)}; or give --young and --poisson; of a shape one of its study.",
        ),
        click.option("--young", help="Young's modulus, such as '210 GPa'."),
        click.option("--poisson", help="Poisson's ratio, from 0 to 0.5."),
    )
    return lambda command: reduce(lambda made, option: option(made), reversed(each), command)
