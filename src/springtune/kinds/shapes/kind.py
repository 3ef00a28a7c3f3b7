"""Shapes: a study's sections ``shapes`` and ``shape_grids``, one scene each combination of a grid."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from ...problem.loads import KINEMATICS
from ...problem.materials import Material
from ...problem.quantities import nearest
from ...problem.shapes import Hole, LoadCase, Pressure, Quantity, Segment, Shape, Support, Traction
from ...springs import DEFINITIONS
from ...study.checks import FEWER, check_for_triangles, check_known, check_particles
from ...study.expand import file_fault
from ...study.fields import Named
from ..base import Kind
from .names import OUTLINED, OWN_FILE, OWN_SIZE
from .outputs import OUTPUTS, stems
from .plan import STAGES
from .sections import ShapeConfig, ShapeGridConfig

if TYPE_CHECKING:
    from ...mesh import GroupedMesh

MOST_SHAPE_SCENES = 100_000
"""Most scenes of shapes of a study."""

READ_AT_ONCE = 1_000_000
"""Size of a mesh file up to which its groups are looked at as a study is read [B]."""


@dataclass(frozen=True)
class ShapeScene:
    """A scene of a shape that a study asks for.

    Attributes
    ----------
    shape : str
        Its name.
    mesh_type : str
        Key of `springtune.kinds.shapes.names.OUTLINED`, or ``"file"``.
    mesh_size : float
        Asked length of an edge [m]; 0 where the mesh is that of a file.
    material : str
        Name of the material of the main part.
    load : str
        Name of a load of the shape.
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    kinematics : str
        One of `springtune.problem.loads.KINEMATICS`.
    """

    shape: str
    mesh_type: str
    mesh_size: float
    material: str
    load: str
    definition: str
    kinematics: str


@dataclass(frozen=True)
class Shapes:
    """What a study asks of shapes.

    Attributes
    ----------
    declared : dict of str to Shape
        All of the study, by name.
    shapes : tuple of Shape
        Those that have scenes.
    materials : tuple of Material
        Those that they are of.
    parts : dict of str to dict of str to str
        Name of the material of each part, by shape and part.
    scenes : tuple of ShapeScene
        Free of duplicates, in a canonical order.
    referred : tuple of tuple of str
        Shape, material and load of each reference.
    refined : dict of str to dict of str to float
        Mesh size over that of the rest, by shape and group, point or part [1].
    """

    declared: dict[str, Shape]
    shapes: tuple[Shape, ...]
    materials: tuple[Material, ...]
    parts: dict[str, dict[str, str]]
    scenes: tuple[ShapeScene, ...]
    referred: tuple[tuple[str, str, str], ...]
    refined: dict[str, dict[str, float]]

    @cached_property
    def shape(self) -> dict[str, Shape]:
        """Shapes by name."""
        return {one.name: one for one in self.shapes}

    @cached_property
    def material(self) -> dict[str, Material]:
        """Materials by name."""
        return {one.name: one for one in self.materials}

    def mesh(self, name: str, size: float | None = None) -> "GroupedMesh":
        """Mesh of a shape, finer where the study says so; of one from a file that of the file.

        Parameters
        ----------
        name : str
            Of a shape that is declared.
        size : float, optional
            Length of an edge [m]; none where the mesh is that of a file.

        Returns
        -------
        GroupedMesh

        Raises
        ------
        ValueError
            If the shape cannot be meshed so.
        MeshError
            If the file cannot be read.
        """
        from ...mesh import mesh_shape, read_shape  # here, since studies are read without scipy

        shape = self.declared[name]
        if shape.file:
            return read_shape(shape.file, shape.unit)
        assert size is not None
        refined = {where: share * size for where, share in self.refined[name].items()}
        return mesh_shape(shape, size, refined=refined)

    def materials_of(self, shape: str, material: str) -> dict[str, Material]:
        """Material of each part of a shape, that of the main part under ``""``."""
        own = {part: self.material[name] for part, name in self.parts[shape].items()}
        return {"": self.material[material]} | own


# -- checks ------------------------------------------------------------------------------------------------------------


def _check(config, problems):
    if bool(config.shapes) != bool(config.shape_grids):
        here, lacking = ("shapes", "shape_grids") if config.shapes else ("shape_grids", "shapes")
        problems.add((here,), f"'{lacking}' is missing; add it: shape_grids say what is computed of the shapes")
        return
    for name, shape in (config.shapes or {}).items():
        path = "shapes", name
        for part, material in shape.parts.items():
            check_known(problems, (*path, "parts", part), "material", material, config.materials)
        if shape.file is not None:
            fault = file_fault(problems.folder / shape.file)
            if fault:
                problems.add((*path, "file"), f"'{problems.folder / shape.file}' {fault}")
            elif problems.nothing:
                _check_file(name, shape, path, problems)
            continue
        _check_outlines(shape, path, problems)
        _check_names(shape, path, problems)
        if problems.nothing:
            try:
                made = _shape(name, shape, problems.folder)
            except ValueError as error:  # what sides do to each other
                problems.add(path, str(error).removeprefix(f"shape '{name}': "))
            else:
                _check_held(made, path, problems)
    for name, grid in (config.shape_grids or {}).items() if problems.nothing else ():
        _check_grid(config, grid, ("shape_grids", name), problems)


def _check_file(name, shape, path, problems):
    """Groups of a mesh file, if it is small: of a large one the stages say what is wrong, scene by scene."""
    file = problems.folder / shape.file
    if file.stat().st_size > READ_AT_ONCE:
        return
    # Here, since few studies have files, and reading one takes scipy.
    from ...mesh import MeshError
    from ...mesh.group_files import read_shape
    from ...problem.cases import check_case

    try:
        grouped = read_shape(file, shape.unit)
    except MeshError as error:
        problems.add((*path, "file"), str(error))
        return
    for part in sorted(set(grouped.parts) - set(shape.parts)):
        problems.add(
            (*path, "parts"), f"part '{part}' of {file} has no material; add it, such as {{{part}: <material>}}"
        )
    for part in sorted(set(shape.parts) - set(grouped.parts)):
        there = nearest(part, grouped.parts) if grouped.parts else "the file has none"
        problems.add((*path, "parts", part), f"unknown part '{part}'; {there}")
    try:
        made = _shape(name, shape, problems.folder)
    except ValueError as error:
        problems.add(path, str(error).removeprefix(f"shape '{name}': "))
        return
    for label, case in made.loads.items():
        try:
            check_case(grouped, case)
        except ValueError as error:
            problems.add((*path, "loads", label), str(error).removeprefix(f"load '{label}', "))


def _check_held(shape, path, problems):
    """Whether supports hold a body against all rigid motions, by the corners of what they hold."""
    (left, low), (right, top) = shape.extent
    size = max(right - left, top - low)
    for name, case in shape.loads.items():
        rows = []
        for support in case.supports:
            places = [shape.points[support.group]] if support.group in shape.points else []
            sides = [side for one in shape.rounds for side in one.sides if side.group == support.group]
            places += [side.at(share) for side in sides for share in (0.0, 0.5, 1.0)]
            for x, y in places:
                x, y = (x - left) / size, (y - low) / size
                rows += [(1.0, 0.0, -y)] * (support.x is not None) + [(0.0, 1.0, x)] * (support.y is not None)
        if _rank(rows) < 3:
            message = "leave the body free to move, or to turn; hold it against both, such as {left: fixed}"
            problems.add((*path, "loads", name, "supports"), message)


def _rank(rows):
    """Rank of rows of three numbers of the size of one."""
    found, rows = 0, [list(row) for row in rows]
    for column in range(3):
        pivot = max(rows, key=lambda row: abs(row[column]), default=None)
        if pivot is None or abs(pivot[column]) < 1e-9:
            continue
        rows.remove(pivot)
        rows = [[a - b * row[column] / pivot[column] for a, b in zip(row, pivot)] for row in rows]
        found += 1
    return found


def _check_outlines(shape, path, problems):
    """Numbers of sides, and parts."""
    rounds = [((*path, "outline"), shape.outline)]
    rounds += [
        ((*path, "holes", number, "outline"), hole.outline) for number, hole in enumerate(shape.holes) if hole.outline
    ]
    for place, segments in rounds:
        if len(segments) < (2 if any(one.centre for one in segments) else 3):
            problems.add(place, f"{len(segments)} sides are no outline; give three or more, or two with an arc")
    parts = {hole.part for hole in shape.holes if hole.part}
    for part in sorted(parts - set(shape.parts)):
        problems.add((*path, "holes"), f"part '{part}' has no material; add it under 'parts'")
    for part in sorted(set(shape.parts) - parts):
        what = f"{nearest(part, parts)}; or give it to what fills a hole" if parts else "no hole has a 'part'; add it"
        problems.add((*path, "parts", part), f"unknown part '{part}'; {what}")


def _groups(shape):
    """Names of the groups of sides of a shape with an outline: of the body's, not of what fills its holes."""
    sides = [*shape.outline]
    found = [hole.group for hole in shape.holes if hole.circle and not hole.part]
    for hole in shape.holes:
        sides += hole.outline if hole.outline and not hole.part else []
    return list(dict.fromkeys(filter(None, [*(side.group for side in sides), *found])))


def _check_names(shape, path, problems):
    """Groups and points that supports, loads and quantities name."""
    groups, points = _groups(shape), list(shape.points)
    for number, hole in enumerate(shape.holes):
        if hole.part and (hole.group or any(side.group for side in hole.outline or ())):
            message = f"part '{hole.part}' is inside of the body, and groups are of its outline; leave the group out"
            problems.add((*path, "holes", number), message)
    for point in points:
        if point in groups:
            problems.add((*path, "points", point), f"'{point}' is a group of sides, too; rename one")

    def check(place, what, name, known):
        if name in known:
            return
        if known:
            why = f"unknown {what} '{name}'; {nearest(name, known)}"
        else:
            why = f"unknown {what} '{name}', and the shape has none; give one a name by 'group', or under 'points'"
        problems.add((*path, *place), why)

    for name in shape.refined:
        check(("refined", name), "group, point or part", name, [*groups, *points, *shape.parts])
    for load, case in shape.loads.items():
        place = "loads", load
        for key, what, known in (
            ("supports", "group or point", [*groups, *points]),
            ("forces", "group or point", [*groups, *points]),
            ("pressures", "group", groups),
        ):
            for name in getattr(case, key):
                check((*place, key, name), what, name, known)
        for name, quantity in case.quantities.items():
            if quantity.at is not None:
                check((*place, "quantities", name, "at"), "point", quantity.at, points)
            if quantity.of is not None:
                held = [one for one in case.supports if one in groups or one in points]
                known, what = (held, "support") if quantity.reaction else (groups, "group")
                check((*place, "quantities", name, "of"), what, quantity.of, known)


def _check_grid(config, grid, path, problems):
    for material in grid.material:
        check_known(problems, (*path, "material"), "material", material, config.materials)
    check_for_triangles(grid.definition, (*path, "definition"), problems)
    for name in grid.definition:
        if DEFINITIONS[name].uniaxial:
            problems.add((*path, "definition"), f"'{name}' is for beams that are stretched alone; choose another one")
    shapes = {}
    for name in grid.shape:
        check_known(problems, (*path, "shape"), "shape", name, config.shapes)
        if name in config.shapes:
            shapes[name] = config.shapes[name]
    for name, shape in shapes.items():
        for load in grid.load or ():
            if load not in shape.loads:
                problems.add((*path, "load"), f"shape '{name}' has no load '{load}'; {nearest(load, shape.loads)}")
    made = {name: shape for name, shape in shapes.items() if shape.file is None}
    if made and grid.mesh_size is None:
        problems.add((*path, "mesh_size"), "'mesh_size' is missing; give a length such as '5 mm', a list, or a range")
    elif made and problems.nothing:
        for name, shape in made.items():
            (left, low), (right, top) = _shape(name, shape, Path()).extent
            wide, high = right - left, top - low
            if max(grid.mesh_size) > min(wide, high) > 0:
                most = f"{1e3 * min(wide, high):.4g} mm"
                problems.add((*path, "mesh_size"), f"is larger than shape '{name}'; give at most {most}")
            check_particles(problems, (*path, "mesh_size"), grid.mesh_size, wide, high)
    for name in shapes.keys() - made.keys() if grid.mesh_size or grid.mesh_type else ():
        key = "mesh_size" if grid.mesh_size else "mesh_type"
        problems.add((*path, key), f"shape '{name}' is a mesh file, which has its own; remove it, or give '{name}' a "
                     "grid of its own")  # fmt: skip
    count = len(grid.definition) * len(grid.kinematics) * len(grid.material) * len(grid.mesh_size or "1")
    count *= sum(len(grid.load or shape.loads) for shape in shapes.values())
    if count > MOST_SHAPE_SCENES:
        problems.add(path, f"{count} scenes; a study has at most {MOST_SHAPE_SCENES} of shapes: {FEWER}")


# -- expansion ---------------------------------------------------------------------------------------------------------


def _segments(sides):
    return tuple(Segment(side.start, side.centre, side.group or "") for side in sides)


def _hole(hole):
    """A hole of a config."""
    if hole.circle is None:
        return Hole(_segments(hole.outline), hole.part or "")
    return Hole.circle(hole.circle.centre, hole.circle.radius, hole.group or "", hole.part or "")


def _load(name, case):
    supports = tuple(Support(group, one.x, one.y) for group, one in case.supports.items())
    forces = tuple(Traction(group, force) for group, force in case.forces.items())
    pressures = tuple(Pressure(group, one.pressure, one.follower) for group, one in case.pressures.items())
    quantities = tuple(
        Quantity(label, one.kind, one.at or one.of or "", one.component, one.expected_value, one.source or "")
        for label, one in case.quantities.items()
    )
    return LoadCase(name, supports, forces, pressures, case.gravity, quantities)


def _shape(name, shape, folder):
    return Shape(
        name,
        shape.thickness,
        _segments(shape.outline or ()),
        tuple(map(_hole, shape.holes)),
        dict(shape.points),
        {label: _load(label, case) for label, case in shape.loads.items()},
        "" if shape.file is None else str(folder / shape.file),
        shape.unit,
    )


def _scenes(config):
    """Scenes of all grids, and which of them have a reference."""
    found, referred = {}, {}
    for grid in config.shape_grids.values():
        for name in grid.shape:
            shape = config.shapes[name]
            meshes = (
                [(OWN_FILE, OWN_SIZE)]
                if shape.file is not None
                else product(grid.mesh_type or OUTLINED, grid.mesh_size)
            )
            for mesh, material, load in product(list(meshes), grid.material, grid.load or shape.loads):
                if grid.reference:
                    referred[name, material, load] = None
                for definition, kinematics in product(grid.definition, grid.kinematics):
                    found[ShapeScene(name, *mesh, material, load, definition, kinematics)] = None
    return found, referred


def _expand(config, declared):
    if not config.shape_grids:
        return ()
    found, referred = _scenes(config)
    ranks = [
        {name: rank for rank, name in enumerate(names)}
        for names in (config.shapes, (*OUTLINED, OWN_FILE), config.materials, DEFINITIONS, KINEMATICS)
    ]

    def order(one):
        shape, mesh_type, material, definition, kinematics = (
            rank[label]
            for rank, label in zip(
                ranks, (one.shape, one.mesh_type, one.material, one.definition, one.kinematics), strict=True
            )
        )
        load = list(config.shapes[one.shape].loads).index(one.load)
        return shape, mesh_type, one.mesh_size, material, load, definition, kinematics

    scenes = sorted(found, key=order)
    names = dict.fromkeys(one.shape for one in scenes)
    parts = {name: dict(one.parts) for name, one in config.shapes.items()}
    used = {one.material for one in scenes} | {other for name in names for other in parts[name].values()}
    all_shapes = {name: _shape(name, one, declared.folder) for name, one in config.shapes.items()}
    return Shapes(
        all_shapes,
        tuple(all_shapes[name] for name in names),
        tuple(material for name, material in declared.materials.items() if name in used),
        parts,
        tuple(scenes),
        tuple(dict.fromkeys(key for one in scenes for key in [(one.shape, one.material, one.load)] if key in referred)),
        {name: dict(one.refined) for name, one in config.shapes.items()},
    )


def _axes(part):
    labels = {
        name: tuple(dict.fromkeys(getattr(one, name) for one in part.scenes))
        for name in ("shape", "mesh_type", "mesh_size", "material", "load", "definition", "kinematics")
    }
    pairs = dict.fromkeys((one.shape, one.load) for one in part.scenes)
    asked = [one.name for shape, load in pairs for one in part.shape[shape].loads[load].quantities]
    return labels | {"quantity": tuple(dict.fromkeys(asked))}


def _summary(part):
    meshes = {(one.shape, one.mesh_type, one.mesh_size) for one in part.scenes}
    cases = {(one.shape, one.load) for one in part.scenes}
    quantities = sum(len(part.shape[shape].loads[load].quantities) for shape, load in cases)
    shapes = f"{len(part.shapes)} shape{'s' * (len(part.shapes) > 1)}"
    rows = [["shape scenes", len(part.scenes), f"of {shapes} on {len(meshes)} meshes, {quantities} quantities"]]
    if part.referred:
        rows.append(["shape references", len(part.referred), "finite elements on the shapes themselves"])
    return rows


def _files(part):
    return [Path(shape.file) for shape in part.shapes if shape.file] if part else []


KIND = Kind(
    "shapes",
    __package__,
    study_fields={
        "shapes": (
            Annotated[dict[str, ShapeConfig], Named("shape")] | None,
            Field(None, description="Shapes: bodies of any outline, or those of mesh files, and their loads."),
        ),
        "shape_grids": (
            Annotated[dict[str, ShapeGridConfig], Named("grid", for_files=False)] | None,
            Field(
                None,
                description="What is to be computed of the shapes; it makes the group `/shapes`. A study that has it "
                "needs neither beams nor grids.",
            ),
        ),
    },
    alone=("shape_grids",),
    files=_files,
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=_summary,
    stages=STAGES,
    outputs=OUTPUTS,
    tables=stems,
    costs={"shape_mesh": (2e-2, 2.5e-5), "shape_reference": (2.0, 0.0), "shape_scene": (5e-3, 2e-5)},
)
