"""Stage `sample`: the networks of sampled scenes, in linear kinematics, with E t = 1 and 1 m of force over E t.

Rows that differ in thickness, modulus and force alone are solved once. Meshes with as many cells along x and y follow
each other: they share numbering, sparsity and symbolic factorization.
"""

from functools import partial
from pathlib import Path

import numpy as np

from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import Material
from springtune.problem.quantities import Status
from springtune.scene.mesh_cache import MeshCache
from springtune.springs.base import DefinitionError

from ...runs import store
from . import draw

DRAWN_KEY = "drawn"  # key of the drawn parameters among the results of a task

TASKS_TOGETHER = 32  # tasks whose meshes are sorted together, so that more of them share a pattern

SCALING_TOLERANCE = 1e-7  # largest relative difference between a scaled and a solved result, for rounding


def run(content, attempts):
    """Solve the scenes of a bundle that are not stored."""
    waiting = []
    for file in content["files"]:
        path = Path(content["folder"]) / f"{file['name']}.h5"
        present = store.stored_keys(path)
        if not {DRAWN_KEY, *file["results"]} <= present:
            waiting.append(_Block(file, path, present))
    for begin in range(0, len(waiting), TASKS_TOGETHER):
        _solve_together(waiting[begin : begin + TASKS_TOGETHER], attempts)


class _Block:
    """Rows of some base samples, and the results of their scenes so far."""

    def __init__(self, file, path, present):
        (task,) = file["tasks"]
        self.file, self.path = file, path
        self.missing = {key: scene for key, scene in file["results"].items() if key not in present}
        self.is_new = DRAWN_KEY not in present
        self.drawn = draw(file["design"], file["seed"], file["parameters"], task["first"], task["last"])
        rows = len(self.drawn["length"])
        self.found = {
            key: {
                "displacement": np.full(rows, np.nan),
                "status": np.full(rows, Status.FAILED, dtype=np.int8),
                "particles": np.zeros(rows, dtype=np.int64),  # of the mesh type, which parameters do not say
                "messages": {},
            }
            for key in self.missing
        }

    def meshes(self):
        """Rows of each distinct mesh, by its length, height and mesh size [m]."""
        found = {}
        boxes = zip(*(self.drawn[name].tolist() for name in ("length", "height", "mesh_size")))
        for row, box in enumerate(boxes):
            found.setdefault(box, []).append(row)
        return found

    def keep(self, key, rows, scale, result):
        """Store a result for some rows, each times its scale."""
        found = self.found[key]
        found["displacement"][rows] = result["displacement"] * scale
        found["status"][rows] = result["status"]
        if result["message"]:
            found["messages"] |= dict.fromkeys(map(str, rows), result["message"])


def _solve_together(blocks, attempts):
    """Solve blocks mesh by mesh; meshes with equal numbers of cells follow each other."""
    meshes = [(box, block, rows) for block in blocks for box, rows in block.meshes().items()]
    meshes.sort(key=lambda one: [round(side / one[0][2]) for side in one[0][:2]])
    like, scaling = None, {}
    for box, block, rows in meshes:
        like = _solve_mesh(block, box, np.array(rows), like, scaling, attempts) or like
    for block in () if attempts.broken else blocks:
        store.add(block.path, block.found | ({DRAWN_KEY: block.drawn} if block.is_new else {}))
        attempts.computed += 1


def _solve_mesh(block, box, rows, like, scaling, attempts):
    """Solve the rows of a block that share a mesh; return its cache, or None."""

    def attempt(name, function):
        return attempts.attempt(f"{block.file['name']} {rows[0]} {name}", function, _failed)

    # One network at a time: the next one takes over the symbolic factor.
    mesh_type = MESH_TYPES[block.file["mesh_type"]]
    cache = attempt(block.file["meshed"], lambda: MeshCache(mesh_type(*box), 1.0, networks=1, like=like))
    if not isinstance(cache, MeshCache):
        for key in block.missing if cache else ():
            block.keep(key, rows, 1.0, cache)
        return None
    for found in block.found.values():
        found["particles"][rows] = len(cache.mesh.points)
    drawn, ratios = block.drawn, block.drawn["poisson_ratio"][rows]
    # This force deforms a network of E t = 1 as the row's force deforms the row's.
    loads = drawn["force"][rows] / (drawn["young_modulus"][rows] * drawn["thickness"][rows])
    for key, scene in block.missing.items():
        definition = scene["definition"]
        if definition not in scaling:
            objection = attempt(f"{key} scales", partial(_scaling_objection, cache, scene, drawn, rows[0]))
            # Without an answer the next mesh is tried.
            if isinstance(objection, str):
                scaling[definition] = objection
        if scaling.get(definition):
            block.keep(key, rows, 1.0, _failed(scaling[definition]))
            continue
        for ratio in np.unique(ratios):
            alike = ratios == ratio
            found = attempt(f"{key} {float(ratio)!r}", partial(_solve_network, cache, scene, ratio, 1.0))
            if found:
                block.keep(key, rows[alike], loads[alike], found)
    return cache


def _failed(why):
    return {"displacement": np.nan, "status": Status.FAILED, "message": why}


def _scaling_objection(cache, scene, drawn, row):
    """Return why results of a definition do not scale, an empty string if they do, or None without a result."""
    ratio, modulus, thickness = (float(drawn[name][row]) for name in ("poisson_ratio", "young_modulus", "thickness"))
    own, load = MeshCache(cache.mesh, thickness, like=cache), 1.0 / (modulus * thickness)
    answers = [_solve_network(cache, scene, ratio, load), _solve_network(own, scene, ratio, 1.0, modulus)]
    unit, answer = (one["displacement"] for one in answers)
    if not np.isfinite([unit, answer]).all():
        return None
    if abs(unit - answer) <= SCALING_TOLERANCE * abs(answer):
        return ""
    return (
        f"{scene['definition']}: answers are not in proportion to force over Young's modulus and thickness, as those "
        "of samples have to be; put it into a grid instead"
    )


def _solve_network(cache, scene, ratio, load, modulus=1.0):
    """Solve a network of E t = 1 under a force over E t [m], or of another modulus."""
    kind = LOAD_KINDS[scene["kind"]]
    try:
        springs, _ = cache.derive(scene["definition"], Material(modulus, float(ratio)))
    except DefinitionError as error:
        return _failed(f"{scene['definition']}: {error}")
    found = cache.solve(kind, springs, load, "linear")
    return {"displacement": found.displacement, "status": found.status, "message": found.message}
