"""Options that commands share: beams, shapes, meshes, materials, folders of studies, limits."""

import math
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import reduce, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ..problem.parameters import MOST_SCENES, MOST_SCENES_VARIABLE, PLANES
from ..studies.runs.source import CONFIG_FOLDER
from . import FAILED, WRONG

if TYPE_CHECKING:
    from ..mesh import Mesh
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


@contextmanager
def refusals(option: str, target: Path | None, named: Callable[[str], str] = str) -> Iterator[None]:
    """Context that prints an error in one line; the exit code is 2 if the line begins with an option.

    `option` is the one of the written file, `target`. `named` replaces arguments in messages by options.
    """
    try:
        yield
    except click.UsageError:
        raise
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else error
        click.echo(f"{option}: {target}: {why}; give a file that can be written", err=True)
        raise SystemExit(FAILED) from None
    except (click.ClickException, ValueError) as error:
        said = named(error.message if isinstance(error, click.ClickException) else str(error))
        click.echo(said, err=True)
        raise SystemExit(WRONG if said.startswith("--") and not isinstance(error, Unmet) else FAILED) from None


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

    sides = text.lower().split("x")
    try:
        length, height = (1e-3 * float(side) for side in sides)
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
    defaults = (None, None) if name is None else MATERIALS[name]
    young, poisson = young or defaults[0], poisson or defaults[1]
    if young is None or poisson is None:
        raise ValueError(f"--material: none; give one of {', '.join(MATERIALS)}, or --young and --poisson")
    try:
        ratio = float(poisson)
    except ValueError:
        ratio = float("nan")
    if not -1 < ratio <= 0.5:
        raise ValueError(f"--poisson: '{poisson}' is out of range; give a number above -1 and at most 0.5")
    heavy = None if density is None else asked_quantity("--density", density, "density")
    if plane == "strain" and ratio == 0.5:
        option, given = ("--poisson", f"'{poisson}'") if name is None else ("--material", f"nu of '{name}'")
        raise ValueError(f"{option}: {given} is 0.5, and plane strain needs less; give less, or --plane stress")
    return Material(asked_quantity("--young", young, "stress"), ratio, heavy, name or "material", plane or "stress")


NAMED_SHAPE = "config/shapes.yaml:cook"
"""Example of a shape's name, for messages."""

MESH_SIZE = re.compile("^mesh size: [^ ]+ ")
"""Begin of messages on a mesh size."""

OF_BEAMS = {
    "beam": "give one of the two",
    "thickness": "which has the one of its study; leave it out",
    "mesh_type": "whose mesh is made at --size, or that of the file that the study names; leave it out",
    "unit": "which has the one of its study; leave it out",
    "young": "whose materials are those of its study; give one of them by --material",
    "poisson": "whose materials are those of its study; give one of them by --material",
    "plane": "whose materials are those of its study, where 'plane' is a key of each; leave it out",
    "loads": "whose loads are those of its study; give one of them by --load",
    "force": "whose loads have their sizes; give --scale, such as 0.5, or leave it out",
}
"""Options of beams alone, by parameter, and the remedy if they are given beside a shape."""


def check_kind(shape: str | None, beam: str | None, of_shapes: tuple[str, ...]) -> None:
    """Refuse a call without beam and shape, or with options of the other one; `of_shapes` are parameters of shapes."""
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
    """A shape of a study with a load, materials and a length of an edge [m], None for a mesh file."""

    part: "Shapes"
    shape: "Shape"
    load: str
    materials: "Mapping[str, AnyMaterial]"
    size: float | None

    @property
    def size_text(self) -> str:
        """Size as the option takes it."""
        return f"{1e3 * (self.size or 0.0):.12g} mm"

    @property
    def mesh_name(self) -> str:
        """Name of the mesh."""
        return Path(self.shape.file).name if self.size is None else f"free {self.size_text}"

    def mesh(self) -> "GroupedMesh":
        """Mesh, refined as the study says."""
        from ..mesh.formats import read_shape  # here, since studies are read without scipy
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
    try:
        found = study.materials_of(shape.name, name)
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


AnyCommand = Callable[..., None]


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

    def asked_beam(self) -> "tuple[Beam, Material]":
        """Beam and its material; ValueError names the option."""
        material = asked_material(self.material, self.young, self.poisson, self.density, self.plane)
        return asked_beam(self.beam or "", self.thickness), material

    def asked_shape(self, load: str | None, sized: bool = True) -> "AskedShape":
        """Shape of an option such as ``config/shapes.yaml:cook``; ValueError names the option.

        Load and material may be None if the study has only one for the shape. `sized`: an outline needs a size.
        """
        study, part, shape = shape_of_study(self.shape or "")
        if load is None and len(shape.loads) > 1:
            raise ValueError(f"--load: missing; shape '{shape.name}' has {', '.join(shape.loads)}; give one")
        from ..problem.quantities import nearest

        load = next(iter(shape.loads)) if load is None else load
        if load not in shape.loads:
            raise ValueError(f"--load: shape '{shape.name}' has no load '{load}'; {nearest(load, shape.loads)}")
        materials = _materials(study, part, shape, self.material, self.density)
        if shape.file:
            files = part.files[shape.name]
            asked = None if self.size is None else asked_quantity("--size", self.size, "length")
            file = next((one for size, one in files.items() if asked is not None and math.isclose(size, asked)), None)
            if len(files) < 2 and asked is not None:
                raise ValueError(
                    f"--size: '{self.size}' is beside the mesh of {Path(shape.file).name}; leave --size out"
                )
            if len(files) > 1 and file is None and (sized or asked is not None):
                known = ", ".join(f"{1e3 * size:.12g} mm" for size in files)
                what = "missing" if asked is None else f"there is no file of '{self.size}'"
                raise ValueError(f"--size: {what}; '{shape.name}' has files of {known}; give one")
            return AskedShape(part, replace(shape, file=file or shape.file), load, materials, None)
        if self.size is None and sized:
            raise ValueError("--size: missing; give the length of an edge such as '2 mm'")
        edge = None if self.size is None else asked_quantity("--size", self.size, "length")
        (left, low), (right, top) = shape.extent
        most = min(right - left, top - low)
        if edge is not None and edge > most:
            raise ValueError(
                f"--size: '{self.size}' is larger than shape '{shape.name}'; give at most {1e3 * most:.4g} mm"
            )
        return AskedShape(part, shape, load, materials, edge)

    @property
    def mesh_or_file(self) -> str:
        """Mesh type, or mesh file."""
        return self.mesh_type or "structured"

    def edge(self, beam: "Beam") -> float | None:
        """Length of an edge [m], None for a mesh file; ValueError if the mesh would be too large."""
        from ..mesh import MESH_TYPES

        made = MESH_TYPES.get(self.mesh_or_file)
        if made is None:
            if not Path(self.mesh_or_file).is_file():
                known = ", ".join(MESH_TYPES)
                raise ValueError(f"--mesh: '{self.mesh_or_file}' is neither a mesh type nor a file; known: {known}")
            return None
        if self.size is None:
            raise ValueError("--size: missing; give the length of an edge such as '2 mm'")
        edge = asked_quantity("--size", self.size, "length")
        if refusal := made.refusal(beam.length, beam.height, edge, f"beam '{beam.name}'"):
            raise ValueError(f"--size: '{self.size}' {refusal}")
        return edge

    def mesh_name(self, edge: float | None) -> str:
        """Name of the mesh of a beam."""
        return Path(self.mesh_or_file).name if edge is None else f"{self.mesh_or_file} {self.size}"

    def mesh(self, beam: "Beam", edge: float | None) -> "Mesh":
        """Mesh with edges of a length [m]; without length the mesh of the file."""
        from ..mesh import MESH_TYPES, read_beam_mesh

        if edge is None:
            unit = self.unit if self.unit[:1].isdigit() else f"1 {self.unit}"
            return read_beam_mesh(self.mesh_or_file, beam.length, beam.height, asked_quantity("--unit", unit, "length"))
        made = MESH_TYPES[self.mesh_or_file]
        count = made.particles(beam.length, beam.height, edge)
        if count > SAID_FROM:
            click.echo(f"making a {made.name} mesh of some {count / 1e6:.1f} million particles ...", err=True)
        return made(beam.length, beam.height, edge)


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
            command(sheet, **given)

        return reduce(lambda made, option: option(made), reversed(each), call)

    return decorate


RESULTS_FOLDER = Path("results")

DATASET = "dataset.nc"


def loaded(path: Path, consequence: str = "") -> "Study":
    """Load a study; `consequence` follows the message on its mistakes."""
    from ..studies.config.messages import StudyError
    from ..studies.kinds import load_study

    try:
        return load_study(path)
    except StudyError as error:
        raise StudyError(*f"{error}{consequence}".splitlines()) from None


def studies(given: Path | None, consequence: str = "") -> "Iterator[tuple[Study, Path]]":
    """Studies and the folders of their results."""
    from ..studies.runs.locks import check_claim, claimed

    if given is not None and not given.is_dir():
        study = loaded(given, consequence)
        folder = RESULTS_FOLDER / study.name
        if not folder.is_dir():
            raise click.ClickException(f"{folder}: there is no such folder; run the study, or go to where it was run")
        check_claim(folder, given)
        yield study, folder
        return
    if given is None and not RESULTS_FOLDER.is_dir():
        raise click.ClickException(f"{RESULTS_FOLDER}: there is no such folder; go to where studies were run")
    folders = [given] if given else sorted(path for path in RESULTS_FOLDER.iterdir() if path.is_dir())
    for folder in folders:
        config = claimed(folder) or folder.parent.parent / CONFIG_FOLDER / f"{folder.name}.yaml"
        if config.is_file():
            yield loaded(config, consequence), folder
        elif given:
            raise click.ClickException(f"{folder}: there is no {config}; give the study's YAML file instead")
        else:
            click.echo(f"{folder}: left alone, there is no {config}; give the study's YAML file, or remove it by hand")


def idle(folder: Path) -> None:
    """Refuse a folder that a run uses."""
    from ..studies.runs.locks import LockedError, check_idle

    try:
        check_idle(folder)
    except LockedError as error:
        raise click.ClickException(f"{error}; nothing is removed") from None


def dataset_path(given: str) -> Path:
    """Path of the dataset of a study, folder or file."""
    from ..studies.runs.locks import check_claim

    path = Path(given)
    if path.suffix in (".yaml", ".yml"):
        config, path = path, RESULTS_FOLDER / path.stem
        check_claim(path, config)
    for file in (path, path / DATASET, RESULTS_FOLDER / path / DATASET):
        if file.is_file():
            return file
    known = sorted(file.parent.name for file in RESULTS_FOLDER.glob(f"*/{DATASET}"))
    there = f"here are {', '.join(known)}" if known else "none is in results/ here"
    raise ValueError(
        f"{given}: there is no such dataset; run the study, or give a dataset.nc, results/<study> or a study's name; "
        f"{there}"
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
