"""Scenes of shapes that a study asks for."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

from springtune.problem.loads import KINEMATICS
from springtune.problem.materials import Material
from springtune.problem.shapes import Hole, LoadCase, Pressure, Quantity, Segment, Shape, Support, Traction
from springtune.springs import DEFINITIONS

from .plan import OWN_FILE, mesh_name
from .sections import OUTLINED


@dataclass(frozen=True)
class ShapeScene:
    """A scene of a shape; ``mesh_size`` is 0 and ``mesh_type`` ``"file"`` where the mesh is that of a file."""

    shape: str
    mesh_type: str
    mesh_size: float
    material: str
    load: str
    definition: str
    kinematics: str

    @property
    def name(self) -> str:
        """Readable name, unique in the study, such as ``"cook_free_4mm_third_shear_lattice_linear"``."""
        return "_".join((mesh_name(self), self.material, self.load, self.definition, self.kinematics))


@dataclass(frozen=True)
class Shapes:
    """Shapes of a study, their scenes, the materials of parts, and refinements."""

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

    def materials_of(self, shape: str, material: str) -> dict[str, Material]:
        """Material of each part of a shape, that of the main part under ``""``."""
        own = {part: self.material[name] for part, name in self.parts[shape].items()}
        return {"": self.material[material]} | own


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


def shape_of_config(name, shape, folder):
    """Shape from its section; files are relative to a folder."""
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
    """Scenes of all grids, and the cases that have a reference."""
    found, referred = {}, {}
    for grid in config.shape_grids.values():
        for name in grid.shape:
            shape = config.shapes[name]
            meshes = (
                [(OWN_FILE, 0.0)] if shape.file is not None else product(grid.mesh_type or OUTLINED, grid.mesh_size)
            )
            for mesh, material, load in product(list(meshes), grid.material, grid.load or shape.loads):
                if grid.reference:
                    referred[name, material, load] = None
                for definition, kinematics in product(grid.definition, grid.kinematics):
                    found[ShapeScene(name, *mesh, material, load, definition, kinematics)] = None
    return found, referred


def expand(config, declared):
    """Shapes of a study that has any, see `springtune.studies.config.kind.Kind`."""
    found, referred = _scenes(config)
    ranks = {
        name: {label: rank for rank, label in enumerate(labels)}
        for name, labels in (
            ("shape", config.shapes),
            ("mesh_type", (*OUTLINED, OWN_FILE)),
            ("material", config.materials),
            ("definition", DEFINITIONS),
            ("kinematics", KINEMATICS),
        )
    }

    def order(one):
        shape, mesh_type, material, *rest = (known[getattr(one, name)] for name, known in ranks.items())
        load = list(config.shapes[one.shape].loads).index(one.load)
        return shape, mesh_type, one.mesh_size, material, load, *rest

    scenes = sorted(found, key=order)
    names = dict.fromkeys(one.shape for one in scenes)
    parts = {name: dict(one.parts) for name, one in config.shapes.items()}
    used = {one.material for one in scenes} | {other for name in names for other in parts[name].values()}
    all_shapes = {name: shape_of_config(name, one, declared.folder) for name, one in config.shapes.items()}
    return Shapes(
        all_shapes,
        tuple(all_shapes[name] for name in names),
        tuple(material for name, material in declared.materials.items() if name in used),
        parts,
        tuple(scenes),
        tuple(dict.fromkeys(key for one in scenes for key in [(one.shape, one.material, one.load)] if key in referred)),
        {name: dict(one.refined) for name, one in config.shapes.items()},
    )
