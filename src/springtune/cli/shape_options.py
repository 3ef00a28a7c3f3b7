"""What options say of a shape: one that a study declares, with its loads and materials by name."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from .options import asked_quantity

if TYPE_CHECKING:
    from ..mesh.groups import GroupedMesh
    from ..problem.materials import AnyMaterial
    from ..problem.shapes import Shape
    from ..studies.config.model import Study
    from ..studies.kinds.shapes.expand import Shapes

NAMED_SHAPE = "config/shapes.yaml:cook"
"""How a shape is named, for messages."""

MESH_SIZE = re.compile("^mesh size: [^ ]+ ")
"""How messages of a mesh size begin."""

OF_BEAMS = {
    "beam": "give one of the two",
    "thickness": "which has the one of its study; leave it out",
    "mesh_type": "whose mesh is made at --size, or that of the file that the study names; leave it out",
    "unit": "which has the one of its study; leave it out",
    "young": "whose materials are those of its study; give one of them by --material",
    "poisson": "whose materials are those of its study; give one of them by --material",
    "loads": "whose loads are those of its study; give one of them by --load",
    "force": "whose loads have their sizes; give --scale, such as 0.5, or leave it out",
}
"""Options that are of beams alone, by parameter, and what to do about them beside a shape."""


def check_kind(shape: str | None, beam: str | None, of_shapes: tuple[str, ...]) -> None:
    """Refuse a call that names neither a beam nor a shape, or gives options of the other one.

    Parameters
    ----------
    of_shapes : tuple of str
        Parameters that are of shapes alone.
    """
    context = click.get_current_context()
    if shape is None and beam is None:
        raise click.UsageError(f"Missing option '--beam' such as 200x40, or '--shape' such as {NAMED_SHAPE}.", context)
    options = {one.name: one.opts[0] for one in context.command.params if isinstance(one, click.Option)}
    given = {
        name: option
        for name, option in options.items()
        if name and context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    }
    if shape is not None:
        for name, why in OF_BEAMS.items():
            if name in given:
                raise ValueError(f"{given[name]}: '{context.params[name]}' is beside --shape {shape}, {why}")
        return
    for name in of_shapes:
        if name in given:
            raise ValueError(
                f"{given[name]}: '{context.params[name]}' is of shapes alone; give --shape, or leave it out"
            )


@dataclass(frozen=True)
class AskedShape:
    """A shape of a study, and what is asked of it.

    Attributes
    ----------
    part : Shapes
        What the study has of shapes.
    shape : Shape
    size : float or None
        Length of an edge [m]; None where the mesh is that of a file.
    """

    part: "Shapes"
    shape: "Shape"
    load: str
    materials: "Mapping[str, AnyMaterial]"
    size: float | None

    @property
    def size_text(self) -> str:
        """The size as the option takes it."""
        return f"{1e3 * (self.size or 0.0):.12g} mm"

    @property
    def mesh_name(self) -> str:
        """What the mesh is called."""
        return Path(self.shape.file).name if self.size is None else f"free {self.size_text}"

    def mesh(self) -> "GroupedMesh":
        """The mesh, finer where the study says so."""
        from ..mesh.group_files import read_shape  # here, since studies are read without scipy
        from ..mesh.outlines import mesh_shape

        if self.size is None:
            return read_shape(self.shape.file, self.shape.unit)
        refined = {where: share * self.size for where, share in self.part.refined[self.shape.name].items()}
        try:
            return mesh_shape(self.shape, self.size, refined=refined)
        except ValueError as error:
            said = MESH_SIZE.sub("", str(error))
            between = " " if said != str(error) else ": "
            raise ValueError(f"--size: '{self.size_text}'{between}{said}") from None


def asked_shape(
    text: str, load: str | None, material: str | None, density: str | None, size: str | None, *, sized: bool = True
) -> AskedShape:
    """Shape of a study of an option such as ``config/shapes.yaml:cook``.

    Parameters
    ----------
    load, material, density, size : str or None
        Of the options; a load or material may be left out where the study has but one for the shape.
    sized : bool, optional
        Whether a shape of an outline needs a size.
    """
    study, part, shape = _shape(text)
    if load is None and len(shape.loads) > 1:
        raise ValueError(f"--load: missing; shape '{shape.name}' has {', '.join(shape.loads)}; give one")
    from ..problem.quantities import nearest

    load = next(iter(shape.loads)) if load is None else load
    if load not in shape.loads:
        raise ValueError(f"--load: shape '{shape.name}' has no load '{load}'; {nearest(load, shape.loads)}")
    materials = _materials(study, part, shape, material, density)
    if shape.file:
        if size is not None:
            raise ValueError(f"--size: '{size}' is beside the mesh of {Path(shape.file).name}; leave --size out")
        return AskedShape(part, shape, load, materials, None)
    if size is None and sized:
        raise ValueError("--size: missing; give the length of an edge such as '2 mm'")
    edge = None if size is None else asked_quantity("--size", size, "length")
    (left, low), (right, top) = shape.extent
    most = min(right - left, top - low)
    if edge is not None and edge > most:
        raise ValueError(f"--size: '{size}' is larger than shape '{shape.name}'; give at most {1e3 * most:.4g} mm")
    return AskedShape(part, shape, load, materials, edge)


def _shape(text: str) -> "tuple[Study, Shapes, Shape]":
    """Study, what it has of shapes, and the shape."""
    from ..problem.quantities import nearest
    from ..studies.kinds import load_study

    path, colon, name = (text, "", "") if Path(text).is_file() else text.rpartition(":")
    if not Path(path).is_file():
        raise ValueError(f"--shape: '{text}': there is no study {path or text}; give one such as {NAMED_SHAPE}")
    if Path(path).suffix not in (".yaml", ".yml"):
        raise ValueError(
            f"--shape: '{text}' is no study, which has the supports and loads; write one with 'file: "
            f"{Path(path).name}' (springtune new mine --shape), and give such as mine.yaml:plate"
        )
    study = load_study(path)
    part = study.parts["shapes"]
    if not part:
        raise ValueError(f"--shape: study {path} has no shapes; add 'shapes' and 'shape_grids', or give --beam")
    if not name and (colon or len(part.declared) > 1):
        raise ValueError(
            f"--shape: '{text}' names no shape; give such as {path}:<name>; known: {', '.join(part.declared)}"
        )
    name = name or next(iter(part.declared))
    if name not in part.declared:
        raise ValueError(f"--shape: study {path} has no shape '{name}'; {nearest(name, part.declared)}")
    return study, part, study.shape(name)


def _materials(
    study: "Study", part: "Shapes", shape: "Shape", name: str | None, density: str | None
) -> "dict[str, AnyMaterial]":
    """Materials by part, that of the main one by the option."""
    if name is None:
        used = {one.material for one in part.scenes if one.shape == shape.name} or set(study.materials)
        if len(used) > 1:
            known = ", ".join(one for one in study.materials if one in used)
            raise ValueError(f"--material: missing; the study has {known} for shape '{shape.name}'; give one")
        (name,) = used
    try:
        found = {"": study.material(name)} | {
            one: study.material(other) for one, other in part.parts[shape.name].items()
        }
    except ValueError as error:
        raise ValueError(f"--{error}") from None
    if density is None:
        return found
    heavy = asked_quantity("--density", density, "density")
    lacking = {one.name for one in found.values() if one.density is None}
    if not lacking:
        have = ", ".join(f"'{one}'" for one in dict.fromkeys(one.name for one in found.values()))
        raise ValueError(
            f"--density: '{density}' is beside material {have}, which has its own in the study; leave it out"
        )
    if len(lacking) > 1:
        raise ValueError(
            f"--density: '{density}' is of one material, and {', '.join(sorted(lacking))} have none; give them theirs "
            "in the study"
        )
    return {one: replace(other, density=heavy) if other.density is None else other for one, other in found.items()}
