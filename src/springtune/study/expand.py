"""From the sections of a study to all that they ask for."""

from itertools import product

from ..kinds.benchmark.names import CURVE_COUNTS, RIVALS, method_names
from ..kinds.stability.names import AXES, EXPERIMENTS, ONCE
from ..linalg import SOLVERS
from ..mesh import MESH_TYPES
from ..problem.geometry import Beam, Strip, Trapezoid
from ..problem.loads import LOADINGS, LOADS, REFERENCE_SIZES
from ..problem.materials import Material
from ..springs import DEFINITIONS
from ..springs.lattice import COEFFICIENT
from .checks import check_files, mesh_type_names, stated_rows
from .model import (
    FURTHER_REFERENCES,
    KINEMATICS,
    OUTPUTS,
    Curve,
    Experiment,
    Grid,
    Laying,
    MeshSpec,
    Moduli,
    Race,
    Reference,
    Scene,
    Study,
)
from .printed import read_printed


def files_of_meshes(config, folder, problems):
    """Meshes from files by (mesh type, beam's name, mesh size)."""
    found = {}
    for name, rows in (config.mesh_files or {}).items():
        for number, row in enumerate(rows):
            path, label = folder / row.file, (name, row.beam, row.mesh_size)
            where = ("mesh_files", name, number)
            if not path.is_file():
                problems.add((*where, "file"), f"'{path}' is not a file; give its path relative to the study's folder")
            if label in found:
                problems.add(where, f"a second file for beam '{row.beam}' at this mesh size; remove one")
            beam = config.beams[row.beam]
            beam = Beam(row.beam, beam.length, beam.height, beam.thickness)
            found[label] = MeshSpec(beam, name, row.mesh_size, path, row.unit)
    problems.stop()
    return found


def _ranks(config):
    """Place of each label in the order of its dimension."""
    names = {
        "beam": config.beams,
        "mesh_type": mesh_type_names(config),
        "material": config.materials,
        "load": LOADS,
        "definition": DEFINITIONS,
        "kinematics": KINEMATICS,
    }
    return {dimension: {name: rank for rank, name in enumerate(labels)} for dimension, labels in names.items()}


def _order(ranks):
    """Sort key of meshes, scenes, curves and references."""

    def key(item):
        mesh = item if isinstance(item, MeshSpec) else getattr(item, "mesh", None)
        beam = (mesh or item).beam
        found = [ranks["beam"][beam.name]]
        if mesh:
            found += [ranks["mesh_type"][mesh.mesh_type], mesh.mesh_size]
        if mesh is not item:
            found += [ranks["material"][item.material.name], ranks["load"][item.load]]
            for label in ("definition", "kinematics"):
                if hasattr(item, label):
                    found.append(ranks[label][getattr(item, label)])
        return found

    return key


def expand(config, mesh_files, problems):
    """Grids with their scenes and curves, in canonical order."""
    order = _order(_ranks(config))
    beams = {name: Beam(name, beam.length, beam.height, beam.thickness) for name, beam in config.beams.items()}
    materials = _materials(config)
    forces, grids = {}, []
    for name, grid in config.grids.items():
        scenes, curves, absent = [], [], set()
        for beam, material, load in product(grid.beam, grid.material, grid.load):
            if grid.pressure is not None:
                magnitude = grid.pressure * beams[beam].length * beams[beam].thickness
            else:
                magnitude = grid.force[beam if beam in grid.force else None]
            other, other_grid = forces.setdefault((beam, material, load), (magnitude, name))
            if other != magnitude:
                problems.add(
                    ("grids", name, "force"),
                    f"{magnitude:g} N on beam '{beam}' of {material} in {load}, but grid '{other_grid}' has "
                    f"{other:g} N; give both the same force, or the other one a study of its own",
                )
            force = LOADS[load].sign * magnitude
            for mesh_type, size, kinematics in product(grid.mesh_type, grid.mesh_size, grid.kinematics):
                mesh = MeshSpec(beams[beam], mesh_type, size)
                if mesh_type not in MESH_TYPES:
                    mesh = mesh_files.get((mesh_type, beam, size))
                    if mesh is None:
                        absent.add((mesh_type, beam, f"{1e3 * size:g} mm"))
                        continue
                common = (mesh, materials[material], load, force)
                scenes += [Scene(*common, definition, kinematics) for definition in grid.definition]
                if grid.sensitivity and not LOADS[load].follower:  # k enters as F/k only where forces stay
                    curves.append(Curve(*common, kinematics))
        for mesh_type, beam, size in sorted(absent):
            row = f"{{file: <path>, beam: {beam}, mesh_size: {size}}}"
            problems.add(("grids", name, "mesh_size"), f"no file for {size}; add {row} to mesh_files.{mesh_type}")
        moduli = _moduli(grid, materials) if grid.moduli else ()
        grids.append(Grid(name, tuple(sorted(scenes, key=order)), tuple(sorted(curves, key=order)), moduli))
    problems.stop()
    return tuple(grids)


def _moduli(grid, materials):
    """Moduli that a grid asks for: of definitions that derive a stiffness."""
    derived = [name for name in grid.definition if DEFINITIONS[name].needs != "stiffness"]
    ratios = dict.fromkeys(materials[name].poisson_ratio for name in grid.material)
    return tuple(Moduli(*labels) for labels in product(derived, grid.mesh_type, grid.mesh_size, ratios))


def _calibrating(config, scenes, problems):
    """Curves that calibrate the scenes of the definition ``calibrated``."""
    calibration = config.definitions.calibrated
    if not calibration:
        return []
    cells = {
        (scene.mesh, scene.material, scene.load, scene.force): None
        for scene in scenes
        if (scene.mesh.beam.name, scene.load) == (calibration.beam, calibration.load)
    }
    needed = {
        (scene.mesh.mesh_type, scene.material, scene.kinematics): None
        for scene in scenes
        if scene.definition == "calibrated"
    }
    curves = []
    for mesh_type, material, kinematics in needed:
        found = [Curve(*cell, kinematics) for cell in cells if (cell[0].mesh_type, cell[1]) == (mesh_type, material)]
        if not found:
            problems.add(
                ("definitions", "calibrated"),
                f"no grid has beam '{calibration.beam}' in {calibration.load} on {mesh_type} meshes of {material.name}"
                ", but scenes there are 'calibrated'; add it to a grid, or calibrate on another beam or load",
            )
        curves += found
    return curves


def _laying(config, materials):
    """Strips to lay, and their references."""
    asked = config.laying
    if not asked:
        return (), ()
    beam, base = config.beams[asked.strip], asked.trapezoid
    parts = {
        "strip": Strip(beam.length, beam.height, beam.thickness),
        "trapezoid": Trapezoid(base.lower_base, base.upper_base, base.height),
        "material": materials[asked.material],
        "support": materials[asked.support],
        "pressure": asked.pressure,
    }
    labels = list(product(asked.loading, asked.friction))
    strips = [
        Laying(**parts, definition=definition, mesh_size=size, loading=loading, friction=friction)
        for definition in DEFINITIONS
        if definition in asked.definition
        for size in sorted(asked.mesh_size)
        for loading, friction in labels
    ]
    references = [
        Laying(**parts, definition="delingette", mesh_size=size, loading=loading, friction=friction)
        for loading, friction in labels
        for size in (ratio * asked.reference_size for ratio in REFERENCE_SIZES)
    ]
    return tuple(strips), tuple(references)


def _stability(config, materials):
    """Experiments on stability: one a definition, or one in all."""
    asked = config.stability
    if not asked:
        return ()
    beam = config.beams[asked.beam]
    beam = Beam(asked.beam, beam.length, beam.height, beam.thickness)
    return tuple(
        Experiment(
            name, beam, materials[asked.material], asked.force, definition, asked.mesh_type,
            tuple(sorted(asked.mesh_size)),
        )
        for name in EXPERIMENTS
        if name in asked.experiment
        for definition in (asked.definition[:1] if name in ONCE else asked.definition)
    )  # fmt: skip


def _benchmark(config, materials):
    """Scenes of the benchmark."""
    asked = config.benchmark
    races = []

    def beam(name):
        one = config.beams[name]
        return Beam(name, one.length, one.height, one.thickness)

    for name, scene in asked.scenes.items() if asked else ():
        races.append(
            Race(
                name, beam(scene.beam), materials[scene.material],
                scene.load, LOADS[scene.load].sign * scene.force,
                method_names([one for one in DEFINITIONS if one in asked.definition], asked.mesh_type,
                             [one for one in RIVALS if one in asked.method]),
                tuple(sorted(asked.mesh_size)), asked.most_seconds, asked.most_thorough, tuple(asked.thorough),
                beam(asked.second_beam) if asked.second_beam else None,
            )
        )  # fmt: skip
    return tuple(races)


def _materials(config):
    return {
        name: Material(name, material.young_modulus, material.poisson_ratio, material.density)
        for name, material in config.materials.items()
    }


def build(config, grids, problems, about):
    """Study of a config and its grids."""
    ranks = _ranks(config)
    order = _order(ranks)

    def in_order(items):
        return tuple(sorted(dict.fromkeys(items), key=order))

    scenes = in_order(scene for grid in grids for scene in grid.scenes)
    curves = [curve for grid in grids for curve in grid.curves] + _calibrating(config, scenes, problems)
    meshes = in_order(scene.mesh for scene in scenes)
    references = in_order(Reference(scene.mesh.beam, scene.material, scene.load, scene.force) for scene in scenes)
    check_files(meshes, scenes, references, problems)
    problems.stop()
    used = {name: {getattr(scene, name) for scene in scenes} for name in ("load", "definition", "kinematics")}
    used["beam"] = {mesh.beam.name for mesh in meshes}
    used["mesh_type"] = {mesh.mesh_type for mesh in meshes}
    used["material"] = {scene.material.name for scene in scenes}
    axes = {name: tuple(label for label in ranks[name] if label in used[name]) for name in ranks}
    axes["mesh_size"] = tuple(sorted({mesh.mesh_size for mesh in meshes}))
    moduli = tuple(dict.fromkeys(one for grid in grids for one in grid.moduli))
    axes["poisson_ratio"] = tuple(sorted({one.poisson_ratio for one in moduli}))
    outputs = tuple(name for name in OUTPUTS if name in config.outputs)
    laying, laying_references = _laying(config, _materials(config))
    stability = _stability(config, _materials(config))
    # Groups of a dataset share their dimensions with its root.
    others = {one.definition for one in (*laying, *stability)}
    axes["definition"] = tuple(name for name in DEFINITIONS if name in others or name in axes["definition"])
    benchmark = _benchmark(config, _materials(config))
    if benchmark:
        axes |= {"scene": tuple(race.name for race in benchmark), "method": benchmark[0].methods}
        axes |= {"curve_count": CURVE_COUNTS, "linear_solver": SOLVERS}
    further = {one.mesh_size for one in laying}
    further |= {size for one in (*stability, *benchmark) for size in one.mesh_sizes}
    axes["mesh_size"] = tuple(sorted({*axes["mesh_size"], *further}))
    axes |= AXES if stability else {}
    axes["loading"] = tuple(name for name in LOADINGS if any(one.loading == name for one in laying))
    axes["friction"] = tuple(sorted({one.friction for one in laying}))
    shown = {
        "laying": (laying, "shows laid strips and the study has none; add a section 'laying'"),
        "benchmark": (benchmark, "shows races and the study has none; add a section 'benchmark'"),
        "stability": (stability, "shows experiments and the study has none; add a section 'stability'"),
        "block": (
            [scene for scene in scenes if LOADS[scene.load].kind == "face"],
            "shows scenes under pressure and no grid has them; add load 'pressure'",
        ),
        "definitions": (moduli, "compares moduli and no grid has them; add 'moduli: true' to a grid"),
    }
    for name, (there, lack) in shown.items():
        if name in outputs and not there:
            problems.add(("outputs",), f"'{name}' {lack}")
    problems.stop()
    first, last, points = config.sensitivity.start, config.sensitivity.stop, config.sensitivity.points
    steps = [first + (last - first) * step / (points - 1) for step in range(points)]
    calibrated = config.definitions.calibrated
    return Study(
        title=config.title,
        meshes=meshes,
        scenes=scenes,
        curves=in_order(curves),
        references=references,
        moduli=moduli,
        patch=Beam("patch", config.patch.length, config.patch.height, 1.0) if moduli else None,
        outputs=outputs,
        further_references=tuple(name for name in FURTHER_REFERENCES if name in config.further_references),
        laying=laying,
        laying_references=laying_references,
        stability=stability,
        benchmark=benchmark,
        grids=grids,
        stiffness_ratios=tuple(COEFFICIENT * step for step in steps),
        stiffness_table={(row.mesh_type, row.material): row.value for row in stated_rows(config)},
        calibration=(calibrated.beam, calibrated.load) if calibrated else None,
        printed=read_printed(about["printed_path"], mesh_type_names(config), problems) if about["printed_path"] else (),
        axes=axes,
        **about,
    )
