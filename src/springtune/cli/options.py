"""Options that commands share: beams, shapes, meshes, materials."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ..problem.quantities import PLANES, nearest, positive
from ..problem.shapes import Beam
from ..safe_io import mesh_size_text, number_of
from ..studies.runs.source import is_source_tree
from . import PATH

if TYPE_CHECKING:
    from ..mesh.cells import Mesh
    from ..mesh.sheets import GroupedMesh
    from ..problem.materials import Material
    from ..problem.shapes import Shape
    from ..studies.config.model import Study
    from ..studies.kinds.bodies.shapes import Shapes


SPRING_FILES = ".csv, .json, .vtu (ParaView), .xml, .mjcf (MuJoCo), .py (SOFA), .newton.py (Newton), .xpbd.json (XPBD)"
"""Endings of files of springs, for the help."""

MATERIALS = {"steel": ("210 GPa", "0.3"), "aluminium": ("70 GPa", "0.33"), "rubber": ("1 MPa", "0.5")}
"""Young's modulus and Poisson's ratio of the paper's materials, and of aluminium."""

STUDY_EXAMPLE = "config/shapes.yaml:cook"
if not is_source_tree(Path()):
    STUDY_EXAMPLE = "shapes.yaml:cook, after `springtune new shapes --from shapes`"
"""Example of a study's shape, for messages."""

# -- options that exclude each other -----------------------------------------------------------------------------------

EXCLUDED_OPTIONS = {
    "study": ("beam", "thickness", "mesh", "unit", "young", "poisson", "plane", "force"),
    "material": ("young", "poisson"),
    "error": ("size", "engine"),
}
"""Options that another one replaces."""

REQUIRED_OPTIONS = {"scale": ("study", "engine"), "force": ("engine", "load")} | dict.fromkeys(
    ("dt", "substeps", "iterations", "precision", "definition"), ("engine",)
)
"""Options that need others, if a command has these."""


def check_option_pairs() -> None:
    """Refuse options that exclude or need other options."""
    context = click.get_current_context()
    known = {one.name or "": one.opts[0] for one in context.command.params}
    given = [name for name in known if context.get_parameter_source(name) is ParameterSource.COMMANDLINE]
    for name in given:
        option = f"{known[name]}: '{context.params[name]}'"
        for other in given:
            if name in EXCLUDED_OPTIONS.get(other, ()):
                beside = f"{known[other]} {context.params[other]}"
                raise ValueError(f"{option} cannot be combined with {beside}; leave one of the two out")
        for other in REQUIRED_OPTIONS.get(name, ()):
            if other in known and other not in given:
                raise ValueError(f"{option} needs {known[other]}; give {known[other]}, or leave it out")


MISSING_TEXTS = {
    "beam": f"beam: missing; give one such as 200x40, or --study such as {STUDY_EXAMPLE}",
    "size": "size: missing; give the length of an edge such as '2 mm'",
    "material": f"material: missing; give one of {', '.join(MATERIALS)}, or --young and --poisson",
    "density": "density: missing; give one such as '1000 kg/m^3'",
    "load": "load: missing; give the load to calibrate to, such as traction",
    "force": "force: missing; give the size of the force on the beam such as '0.2 N'",
}
"""Messages about missing options of a beam."""

FOR_ENGINE = ("density", "load", "force")  # options that an engine needs besides those of a beam


# -- beams and shapes --------------------------------------------------------------------------------------------------


def read_beam(text: str, thickness: str) -> Beam:
    """Beam of a text such as ``200x40``."""
    try:
        length, height = (1e-3 * float(side) for side in text.lower().split("x"))
    except ValueError:
        raise ValueError(f"beam: '{text}' is not length x height; give millimetres such as 200x40") from None
    return Beam(length, height, thickness, text)


def read_material(given: Mapping[str, Any]) -> "Material":
    """Material of a name, or of its constants."""
    from ..problem.materials import Material

    name = given["material"]
    if name and name not in MATERIALS:
        known = nearest(str(name), MATERIALS)
        raise ValueError(f"material: unknown material '{name}'; {known}; or give --young and --poisson")
    young, poisson = MATERIALS.get(name, (given["young"], given["poisson"]))
    if math.isnan(ratio := number_of(poisson)) and poisson != "nan":
        why = "has a comma: write a decimal point" if "," in poisson else "is not a number"
        raise ValueError(f"poisson: '{poisson}' {why}; give one such as 0.33")
    return Material(young, ratio, given["density"], name or "material", given["plane"] or "stress")


def shape_of_study(text: str) -> "tuple[Study, Shapes, Shape]":
    """Study, its shapes, and the shape of an option such as ``config/shapes.yaml:cook``."""
    from ..studies.kinds import load_study

    path, _, name = (text, "", "") if Path(text).is_file() else text.rpartition(":")
    if not Path(path).is_file() or Path(path).suffix not in (".yaml", ".yml"):
        raise ValueError(f"study: '{text}': there is no study {path or text}; give one such as {STUDY_EXAMPLE}")
    study = load_study(path)
    if not (shapes := study.shapes):
        raise ValueError(f"study: '{path}' has no shapes; give --beam, or a study such as {STUDY_EXAMPLE}")
    known = list(shapes.shape)
    name = known[0] if not name and len(known) == 1 else name
    if name not in known:
        raise ValueError(f"study: '{text}' names none of its shapes; give such as {path}:name; {nearest(name, known)}")
    return study, shapes, study.shape(name)


@dataclass(frozen=True)
class BodyOptions:
    """Beam or Shape of the options, its material, or a shape's by part, its load, and a mesh type and size [m]."""

    body: Any
    material: Any
    load: str | None
    mesh_type: str
    size: float | None
    make: Callable[..., Any]

    @property
    def is_beam(self) -> bool:
        """Whether the body is a beam."""
        return isinstance(self.body, Beam)

    @property
    def mesh_name(self) -> str:
        """Name of the mesh."""
        return Path(self.mesh_type).name if self.size is None else f"{self.mesh_type} {mesh_size_text(self.size)}"

    @cached_property
    def mesh(self) -> Any:
        """Mesh of a beam, or of a shape with its groups."""
        return self.make(self.mesh_type, self.size)


def read_body(
    given: Mapping[str, Any], load: str | None, sized: bool = True, further: Collection[str] = ()
) -> BodyOptions:
    """Read body, material, load and mesh from options; `sized`: a generated mesh needs a size; `further`: a beam's."""
    if given["study"]:
        return _read_shape_options(given, load, sized)
    from ..mesh.cells import MESH_TYPES

    mesh_type, size = given["mesh"] or "structured", None
    made = sized and mesh_type in MESH_TYPES
    if sized and not made and not Path(mesh_type).is_file():
        raise ValueError(f"mesh: '{mesh_type}' is neither a mesh type nor a file; known: {', '.join(MESH_TYPES)}")
    needed = {"beam", "material", *further, *(("size",) if made else ())}
    constants = None if None in (given["young"], given["poisson"]) else "of one's own"
    there = {**given, "material": given["material"] or constants}
    if missing := [text for name, text in MISSING_TEXTS.items() if name in needed and there[name] is None]:
        raise ValueError(*missing)  # each is a line
    material, beam = read_material(given), read_beam(given["beam"], given["thickness"])
    if made:
        size = positive(given["size"], "length", "size")
        if refusal := MESH_TYPES[mesh_type].refusal(beam.length, beam.height, size, f"beam '{beam.name}'"):
            raise ValueError(f"size: '{given['size']}' {refusal}")

    def make(mesh_type: str, size: float | None) -> "Mesh":
        from ..scene.single import make_mesh, read_mesh  # here, since it takes half a second

        if size is not None:
            return make_mesh(beam, mesh_type, size)
        unit = given["unit"] if given["unit"][:1].isdigit() else f"1 {given['unit']}"
        return read_mesh(mesh_type, beam, unit)

    return BodyOptions(beam, material, load, mesh_type, size, make)


def _read_shape_options(given: Mapping[str, Any], load: str | None, sized: bool) -> BodyOptions:
    """Shape of a study; load and material may be None if the study has only one for it."""
    study, shapes, shape = shape_of_study(given["study"])
    if load is None and len(shape.loads) > 1:
        raise ValueError(f"load: missing; shape '{shape.name}' has {', '.join(shape.loads)}; give one")
    load = next(iter(shape.loads)) if load is None else load
    if load not in shape.loads:
        raise ValueError(f"load: shape '{shape.name}' has no load '{load}'; {nearest(load, shape.loads)}")
    used = {one.material for one in shapes.scenes if one.shape == shape.name} or {*study.materials}
    if given["material"] is None and len(used) > 1:
        known = ", ".join(one for one in study.materials if one in used)
        raise ValueError(f"material: missing; the study has {known} for shape '{shape.name}'; give one")
    materials = study.materials_of(shape.name, given["material"] or used.pop())
    if (density := given["density"]) is not None:
        lacking = {one.name for one in materials.values() if one.density is None}
        if len(lacking) != 1:
            have = f"{len(lacking)} have none" if lacking else "each has its own"
            why = f"is for one material, and of those in the study {have}"
            raise ValueError(f"density: '{density}' {why}; give theirs there")
        materials |= {name: replace(one, density=density) for name, one in materials.items() if one.density is None}
    if given["size"] is None and sized and not shape.file:
        raise ValueError(MISSING_TEXTS["size"])
    size = None if given["size"] is None else positive(given["size"], "length", "size")
    files = shapes.files[shape.name]
    if shape.file and (size is not None or sized and len(files) > 1):
        chosen = [file for other, file in files.items() if size is not None and math.isclose(size, other)]
        if not chosen:
            sizes = ", ".join(map(mesh_size_text, filter(None, files)))
            which = f"files of {sizes}; give one" if sizes else "one mesh; leave --size out"
            raise ValueError(f"size: {given['size'] or 'missing'}; '{shape.name}' has {which}")
        shape, size = replace(shape, file=chosen[0]), None
    make = partial(_shape_mesh, shape, shapes.refined[shape.name])
    return BodyOptions(shape, materials, load, shape.file or "free", size, make)


def _shape_mesh(shape: "Shape", refined: Mapping[str, float], _: str, size: float | None) -> "GroupedMesh":
    """Make the mesh of a shape, refined as in its study."""
    from ..scene.single import mesh_shape, read_shape  # here, since studies are read without scipy

    if size is None:
        return read_shape(shape.file, shape.unit)
    try:
        return mesh_shape(shape, size, refined={where: share * size for where, share in refined.items()})
    except ValueError as error:
        raise ValueError(f"size: '{mesh_size_text(size)}': {str(error).removeprefix('mesh size: ')}") from None


AnyCommand = Callable[..., None]


def target_option(name: str, meaning: str, required: bool = False) -> Callable[[AnyCommand], AnyCommand]:
    """Decorator that adds an option for a file of springs; a wrong ending and a missing folder are refused."""

    def check(_: click.Context, __: click.Parameter, target: Path | None) -> Path | None:
        try:
            if target is not None:
                from ..handover import formats  # here: it takes a second

                formats.check_target(target)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
        return target

    meaning = f"{meaning}: {SPRING_FILES}."
    return click.option(name, "target", required=required, type=PATH, callback=check, help=meaning)


Options = dict[str, dict[str, Any]]  # options of a command by name, with keywords as click takes them

BODY_OPTIONS: Options = {
    "beam": {"help": "Length x height in mm, such as 200x40."},
    "study": {"help": f"A study's shape instead of a beam, such as {STUDY_EXAMPLE}; without a name its only one."},
    "thickness": {"default": "1 mm", "show_default": True, "help": "Thickness of a beam."},
}
"""Options of a body."""


def sheet_options(
    mesh_help: str, density_help: str, mesh_type: str | None = None
) -> Callable[[AnyCommand], AnyCommand]:
    """Decorator that adds options of a body, its mesh and its material to a command, which gets them in `sheet`."""
    each = BODY_OPTIONS | {
        "mesh": {"default": mesh_type, "show_default": True, "help": mesh_help},
        "size": {"help": "Length of an edge, such as '2 mm'. It also chooses among several mesh files of a shape."},
        "unit": {"default": "1 m", "show_default": True, "help": "Unit of the coordinates in a beam's mesh file."},
        "material": {"help": f"One of {', '.join(MATERIALS)}, or --young and --poisson; of a shape, one of its study."},
        "young": {"help": "Young's modulus, such as '210 GPa'."},
        "poisson": {"help": "Poisson's ratio, above -1 and at most 0.5."},
        "plane": {
            "type": click.Choice(PLANES),
            "help": "Plane stress of a thin sheet, the default, or plane strain of a slice of a long body.",
        },
        "density": {"help": f"Density, such as '7850 kg/m^3': {density_help}."},
    }

    def decorate(command: AnyCommand) -> AnyCommand:
        @wraps(command)
        def call(**given: Any) -> None:
            check_option_pairs()
            command({name: given.pop(name) for name in each}, **given)

        return add_options(each)(call)

    return decorate


def add_options(each: Options) -> Callable[[AnyCommand], AnyCommand]:
    """Decorator that adds options to a command, in their order."""
    return lambda command: reduce(
        lambda made, name: click.option(f"--{name}", **each[name])(made), reversed(each), command
    )
