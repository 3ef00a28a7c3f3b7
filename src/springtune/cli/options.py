"""Options that commands share: beams, shapes, meshes, materials, datasets, limits."""

import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial, reduce, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ..problem.parameters import MOST_SCENES, MOST_SCENES_VARIABLE, PLANES
from ..safe_io.tables import mesh_size_text

if TYPE_CHECKING:
    from ..mesh.cells import Mesh
    from ..mesh.groups import GroupedMesh
    from ..problem.geometry import Beam
    from ..problem.materials import AnyMaterial, Material
    from ..problem.shapes import Shape
    from ..studies.config.model import Study
    from ..studies.kinds.shapes.expand import Shapes

SAID_FROM = 1_000_000
"""Number of particles above which a message says that the mesh is being made, which takes seconds."""


class Unmet(ValueError):
    """The options are right, but the request cannot be met."""

    wrong_call = False


@contextmanager
def writing(option: str, target: Path) -> Iterator[None]:
    """Context of writing the file of an option, whose errors name both."""
    try:
        yield
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else error
        raise Unmet(f"{option}: {target}: {why}; give a file that can be written") from None


def check_target(option: str, target: Path) -> None:
    """Refuse a file of unknown ending or in a missing folder; ValueError names the option."""
    from ..handover import formats

    try:
        formats.check_target(target)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None


SPRING_FILES = (
    ".csv, .json, .vtu (ParaView), .xml or .mjcf (MuJoCo), .scn or .py (SOFA), .newton.py (Newton), "
    "or .xpbd.json (XPBD)"
)
"""Endings of files of springs, for the help."""

MATERIALS = {"steel": ("210 GPa", "0.3"), "rubber": ("1 MPa", "0.5")}
"""Young's modulus and Poisson's ratio of the paper's materials."""


def asked_quantity(option: str, text: str, kind: str) -> float:
    """Value of an option in SI units, above zero; ValueError names the option."""
    from ..problem.quantities import quantity

    number = quantity(text, kind, option)
    if not number > 0:
        raise ValueError(f"{option}: '{text}' is not above zero; give a size above zero")
    return number


def asked_beam(text: str, thickness: str) -> "Beam":
    """Beam of a text such as ``200x40``; ValueError names the option."""
    from ..problem.geometry import Beam

    try:
        length, height = (1e-3 * float(side) for side in text.lower().split("x"))
    except ValueError:
        raise ValueError(f"--beam: '{text}' is not length x height; give millimetres such as 200x40") from None
    if not (length > 0 and height > 0):
        raise ValueError(f"--beam: '{text}' has a side that is not above zero; give millimetres such as 200x40")
    thick = asked_quantity("--thickness", thickness, "length")
    try:
        return Beam(length, height, thick, text)
    except ValueError as error:
        raise ValueError(f"--beam: {error}") from None


def asked_material(
    name: str | None, young: str | None, poisson: str | None, density: str | None = None, plane: str | None = None
) -> "Material":
    """Material of a name, or of its constants; ValueError names the option."""
    from ..problem.materials import Material

    if name is not None and name not in MATERIALS:
        raise ValueError(
            f"--material: unknown material '{name}'; known: {', '.join(MATERIALS)}; or give --young and --poisson"
        )
    if name is not None and (young or poisson):
        other = "--young" if young else "--poisson"
        raise ValueError(
            f"{other}: '{young or poisson}' is beside --material {name}, which has its own; leave --material out, and "
            "give --young and --poisson"
        )
    young, poisson = (young, poisson) if name is None else MATERIALS[name]
    if young is None or poisson is None:
        raise ValueError(f"--material: none; give one of {', '.join(MATERIALS)}, or --young and --poisson")
    try:
        ratio = float(poisson)
    except ValueError:
        ratio = math.nan
    if not -1 < ratio <= 0.5:
        raise ValueError(f"--poisson: '{poisson}' is out of range; give a number above -1 and at most 0.5")
    heavy = None if density is None else asked_quantity("--density", density, "density")
    if plane == "strain" and ratio == 0.5:
        given = "--poisson: '0.5'" if name is None else f"--material: nu of '{name}'"
        raise ValueError(f"{given} is 0.5, and plane strain needs less; give less, or --plane stress")
    return Material(asked_quantity("--young", young, "stress"), ratio, heavy, name or "material", plane or "stress")


NAMED_SHAPE = "config/shapes.yaml:cook"
"""Example of a shape's name, for messages."""

OF_BEAMS = ("beam", "thickness", "mesh_type", "unit", "young", "poisson", "plane", "loads", "force")
OF_SHAPES = ("scale",)
"""Options of beams alone and of shapes alone, by parameter."""


def shape_of_study(text: str) -> "tuple[Study, Shapes, Shape]":
    """Study, its part of shapes, and the shape."""
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
    """Materials by part; the option names the main one."""
    if name is None:
        used = {one.material for one in part.scenes if one.shape == shape.name} or set(study.materials)
        if len(used) > 1:
            known = ", ".join(one for one in study.materials if one in used)
            raise ValueError(f"--material: missing; the study has {known} for shape '{shape.name}'; give one")
        (name,) = used
    found = study.materials_of(shape.name, name)
    if density is None:
        return found
    heavy = asked_quantity("--density", density, "density")
    lacking = {one.name for one in found.values() if one.density is None}
    if len(lacking) != 1:
        have = ", ".join(f"'{one}'" for one in dict.fromkeys(one.name for one in found.values()))
        why = f"beside material {have}, which has its own in the study; leave it out"
        if lacking:
            why = f"of one material, and {', '.join(sorted(lacking))} have none; give them theirs in the study"
        raise ValueError(f"--density: '{density}' is {why}")
    return {one: replace(other, density=heavy) if other.density is None else other for one, other in found.items()}


@dataclass(frozen=True)
class Asked:
    """Body of the options, its material and load, and the mesh of a type and size [m]; a mesh file has no size.

    `body` is a Beam or a Shape, whose `material` is a mapping of parts; `make` makes a mesh of a type and a size.
    """

    body: Any
    material: Any
    load: str | None
    mesh_type: str
    size: float | None
    make: Callable[..., Any]

    @property
    def is_beam(self) -> bool:
        """Whether the body is a beam."""
        from ..problem.geometry import Beam

        return isinstance(self.body, Beam)

    @property
    def mesh_name(self) -> str:
        """Name of the mesh."""
        return Path(self.mesh_type).name if self.size is None else f"{self.mesh_type} {mesh_size_text(self.size)}"

    @cached_property
    def mesh(self) -> Any:
        """Mesh of a beam, or of a shape with its groups."""
        return self.make(self.mesh_type, self.size)


def _beam_mesh(beam: "Beam", unit: str, mesh_type: str, size: float | None) -> "Mesh":
    from ..mesh.formats import read_beam_mesh
    from ..mesh.types import MESH_TYPES

    if size is None:
        scale = asked_quantity("--unit", unit if unit[:1].isdigit() else f"1 {unit}", "length")
        return read_beam_mesh(mesh_type, beam.length, beam.height, scale)
    made = MESH_TYPES[mesh_type]
    count = made.particles(beam.length, beam.height, size)
    if count > SAID_FROM:
        click.echo(f"making a {made.name} mesh of some {count / 1e6:.1f} million particles ...", err=True)
    return made(beam.length, beam.height, size)


def _shape_mesh(part: "Shapes", shape: "Shape", _: str, size: float | None) -> "GroupedMesh":
    """Mesh, refined as the study says."""
    from ..mesh.formats import read_shape  # here, since studies are read without scipy
    from ..mesh.outlines import mesh_shape

    if size is None:
        return read_shape(shape.file, shape.unit)
    refined = {where: share * size for where, share in part.refined[shape.name].items()}
    try:
        return mesh_shape(shape, size, refined=refined)
    except ValueError as error:
        raise ValueError(f"--size: '{mesh_size_text(size)}': {str(error).removeprefix('mesh size: ')}") from None


@dataclass(frozen=True)
class SheetOptions:
    """Options of a sheet, its mesh and its material, which several commands share."""

    beam: str | None
    shape: str | None
    thickness: str
    mesh_type: str | None
    size: str | None
    unit: str
    material: str | None
    young: str | None
    poisson: str | None
    plane: str | None
    density: str | None

    def check(self) -> None:
        """Refuse a call without beam and shape, or with options of the other one."""
        context = click.get_current_context()
        if self.shape is None and self.beam is None:
            missing = f"Missing option '--beam' such as 200x40, or '--shape' such as {NAMED_SHAPE}."
            raise click.UsageError(missing, context)
        why = "is of shapes alone; give --shape, or leave it out"
        if self.shape is not None:
            why = f"is beside --shape {self.shape}, which has its own in the study; leave one of the two out"
        for one in context.command.params:
            name = one.name or ""
            if (
                name in (OF_SHAPES if self.shape is None else OF_BEAMS)
                and context.get_parameter_source(name) is ParameterSource.COMMANDLINE
            ):
                raise ValueError(f"{one.opts[0]}: '{context.params[name]}' {why}")

    def asked(self, load: str | None, sized: bool = True) -> Asked:
        """Body, material, load and mesh; ValueError names the option. `sized`: a mesh that is made needs a size."""
        return self._asked_beam(load, sized) if self.shape is None else self._asked_shape(load, sized)

    def _edge(self, sized: bool) -> float | None:
        if self.size is None and sized:
            raise ValueError("--size: missing; give the length of an edge such as '2 mm'")
        return None if self.size is None else asked_quantity("--size", self.size, "length")

    def _asked_beam(self, load: str | None, sized: bool) -> Asked:
        from ..mesh.types import MESH_TYPES

        material = asked_material(self.material, self.young, self.poisson, self.density, self.plane)
        beam, mesh_type, edge = asked_beam(self.beam or "", self.thickness), self.mesh_type or "structured", None
        if sized and mesh_type in MESH_TYPES:
            edge = self._edge(sized=True)
            assert edge is not None
            if refusal := MESH_TYPES[mesh_type].refusal(beam.length, beam.height, edge, f"beam '{beam.name}'"):
                raise ValueError(f"--size: '{self.size}' {refusal}")
        elif sized and not Path(mesh_type).is_file():
            raise ValueError(f"--mesh: '{mesh_type}' is neither a mesh type nor a file; known: {', '.join(MESH_TYPES)}")
        return Asked(beam, material, load, mesh_type, edge, partial(_beam_mesh, beam, self.unit))

    def _asked_shape(self, load: str | None, sized: bool) -> Asked:
        """Shape of an option such as ``config/shapes.yaml:cook``.

        Load and material may be None if the study has only one for the shape.
        """
        from ..problem.quantities import nearest

        study, part, shape = shape_of_study(self.shape or "")
        if load is None and len(shape.loads) > 1:
            raise ValueError(f"--load: missing; shape '{shape.name}' has {', '.join(shape.loads)}; give one")
        load = next(iter(shape.loads)) if load is None else load
        if load not in shape.loads:
            raise ValueError(f"--load: shape '{shape.name}' has no load '{load}'; {nearest(load, shape.loads)}")
        materials = _materials(study, part, shape, self.material, self.density)
        edge = self._edge(sized and not shape.file)
        if shape.file:
            files = part.files[shape.name]
            chosen = [file for size, file in files.items() if edge is not None and math.isclose(size, edge)]
            if len(files) < 2 and edge is not None:
                raise ValueError(
                    f"--size: '{self.size}' is beside the mesh of {Path(shape.file).name}; leave --size out"
                )
            if len(files) > 1 and not chosen and (sized or edge is not None):
                known = ", ".join(map(mesh_size_text, files))
                what = "missing" if edge is None else f"there is no file of '{self.size}'"
                raise ValueError(f"--size: {what}; '{shape.name}' has files of {known}; give one")
            shape, edge = replace(shape, file=chosen[0] if chosen else shape.file), None
        mesh_type = shape.file or "free"
        return Asked(shape, materials, load, mesh_type, edge, partial(_shape_mesh, part, shape))


AnyCommand = Callable[..., None]


def sheet_options(
    mesh_help: str, density_help: str, mesh_type: str | None = None
) -> Callable[[AnyCommand], AnyCommand]:
    """Decorator that adds these options to a command, which gets them as `SheetOptions`."""
    each = (
        click.option("--beam", help="Length x height in mm, such as 200x40."),
        click.option(
            "--shape",
            help=f"A study's shape, such as {NAMED_SHAPE}, in the place of a beam; the name may be left out where "
            "there is one.",
        ),
        click.option("--thickness", default="1 mm", show_default=True, help="Thickness of the sheet."),
        click.option("--mesh", "mesh_type", default=mesh_type, show_default=True, help=mesh_help),
        click.option("--size", help="Length of an edge, such as '2 mm'; of mesh files only if a shape has several."),
        click.option("--unit", default="1 m", show_default=True, help="Unit of the coordinates in a mesh file."),
        click.option(
            "--material",
            help=f"One of {', '.join(MATERIALS)}; or give --young and --poisson; of a shape one of its study.",
        ),
        click.option("--young", help="Young's modulus, such as '210 GPa'."),
        click.option("--poisson", help="Poisson's ratio, above -1 and at most 0.5."),
        click.option(
            "--plane",
            type=click.Choice(PLANES),
            help="Plane stress of a thin sheet, the default, or plane strain of a slice of a long body.",
        ),
        click.option("--density", help=f"Density, such as '7850 kg/m^3': {density_help}."),
    )

    def decorate(command: AnyCommand) -> AnyCommand:
        @wraps(command)
        def call(**given: Any) -> None:
            sheet = SheetOptions(**{one.name: given.pop(one.name) for one in fields(SheetOptions)})
            sheet.check()
            command(sheet, **given)

        return reduce(lambda made, option: option(made), reversed(each), call)

    return decorate


RESULTS_FOLDER, DATASET = Path("results"), "dataset.nc"


def dataset_path(given: str) -> Path:
    """Path of the dataset of a study's name, folder or file."""
    for file in (Path(given), Path(given, DATASET), RESULTS_FOLDER / given / DATASET):
        if file.is_file():
            return file
    known = ", ".join(sorted(file.parent.name for file in RESULTS_FOLDER.glob(f"*/{DATASET}"))) or "none"
    raise ValueError(
        f"{given}: there is no such dataset; run the study, or give a dataset.nc, results/<study> or a study's name; "
        f"in results/ here: {known}"
    )


max_scenes = click.option(
    "--max-scenes",
    "most",
    type=click.IntRange(min=1),
    help=f"A study of more scenes is refused before anything is made of it; {MOST_SCENES} without.",
)
"""Option of a command that reads a study: argument ``most``, for `allow`."""


def allow(most: int | None) -> None:
    """Let this process and those that it starts read studies of so many scenes."""
    if most is not None:
        os.environ[MOST_SCENES_VARIABLE] = str(most)
