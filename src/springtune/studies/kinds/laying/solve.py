r"""Stage `laying`: a strip laid on a trapezoid that stands on a rigid floor, the paper's section 4.2.

::

        v v v v v v v v v v v v v v      pressure that follows the upper face, or weight, or ends drawn down
       +----------------------------+
       +------+--------------+------+    strip, free but for its middle, which stays on the axis
             /                \
            /    trapezoid     \
    -------+--------------------+-------  floor

A trapezoid far stiffer than the strip is rigid: it has no unknowns, like the floor.
"""

import time
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from springtune.mechanics.contact import Body, Contact, ContactError, Obstacle
from springtune.mechanics.network import FollowerPressure
from springtune.mesh.cells import MESH_TYPES, Mesh
from springtune.problem.materials import material_of
from springtune.problem.quantities import Status
from springtune.problem.shapes import Beam
from springtune.scene.mesh_cache import MeshCache
from springtune.springs.base import DefinitionError

RIGID_MODULUS_RATIO = 1e4  # ratio of Young's moduli above which the trapezoid is rigid


class Trapezoid(NamedTuple):
    """Symmetric trapezoid on its lower base; lengths in m."""

    lower_base: float
    upper_base: float
    height: float

    @property
    def area(self) -> float:
        """Area [m2]."""
        return 0.5 * (self.lower_base + self.upper_base) * self.height

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Corners, counter-clockwise, the axis at x = 0: pairs of x and y [m]."""
        low, high = 0.5 * self.lower_base, 0.5 * self.upper_base
        return [(-low, 0.0), (low, 0.0), (high, self.height), (-high, self.height)]


def solve(task):
    """Rows of a strip; a reference has several meshes and an error band."""
    trapezoid = Trapezoid(**task["trapezoid"])
    found = [_strip_result(task, trapezoid, size) for size in task["mesh_sizes"]]
    first, is_reference = found[0], len(found) > 1
    points, name = first.pop("outline", np.empty((0, 2))).tolist(), "reference" if is_reference else "strip"
    rows = [{"outline_point": place, f"{name}_x": x, f"{name}_y": y} for place, (x, y) in enumerate(points)]
    rows += [{"corner": place, "trapezoid_x": x, "trapezoid_y": y} for place, (x, y) in enumerate(trapezoid.corners)]
    if is_reference and first["status"] != Status.SOLVED:
        return {"rows": rows[len(points) :]}
    compared = {"reference_area": "area_under_strip", "reference_elongation": "elongation"} if is_reference else {}
    for variable, name in compared.items():
        values = [one.get(name, np.nan) for one in found]
        first |= {variable: values[0], f"{variable}_error_estimate": band(values)}
    return {"rows": [first, *rows]}


def _strip_result(task, trapezoid, size):
    material, support = (material_of(task[name]).in_plane for name in ("material", "support"))
    options = {name: task[name] for name in ("definition", "loading", "pressure", "friction")}
    try:
        found = lay(Beam(**task["strip"]), trapezoid, material, support, size=size, **options)
    except DefinitionError as error:
        return {"status": int(Status.FAILED), "message": f"{task['definition']}: {error}"}
    if found.message:
        del found.area_under_strip, found.elongation, found.contact_force_error
        return vars(found) | {"status": int(Status.NOT_CONVERGED)}
    area_error = found.area_under_strip / trapezoid.area - 1
    return vars(found) | {"status": int(Status.SOLVED), "area_error": area_error}


def lay(strip, trapezoid, material, support, definition, size, *, loading="pressure", pressure=0.02e6, friction=0.0,
        rigid=RIGID_MODULUS_RATIO):  # fmt: skip
    """Lay a strip on a trapezoid [m, Pa], rigid from a ratio of moduli on; return results by dataset names."""
    begin = time.perf_counter()
    body, mesh = _strip_body(strip, trapezoid, material, definition, size, loading, pressure)
    skipped = ["unknowns of the floor"]
    if support.young_modulus >= rigid * material.young_modulus:
        contact = Contact([body], [Obstacle(np.array(trapezoid.corners))], floor=True, size=size, friction=friction)
        skipped.append("the trapezoid's deformation: it is rigid beside the strip")
    else:
        below = _trapezoid_body(strip, trapezoid, support, size)
        contact = Contact([body, below], floor=True, size=size, friction=friction)
    message = ""
    try:
        contact.solve(first=1e-3)
    except ContactError as error:
        message = str(error)
    low = np.flatnonzero(mesh.points[:, 1] <= trapezoid.height * (1 + 1e-9))
    fibre = body.points[low[np.argsort(mesh.points[low, 0])]]
    lengths = np.linalg.norm(np.diff(fibre, axis=0), axis=1)
    load = pressure * strip.length * strip.thickness
    if loading == "pressure":  # its part that still acts downwards
        load = -float(contact.share * body.force * body.pressure.forces(body.displacements)[:, 1].sum())
    outline = body.outline[:, 0]
    around = [0]
    while len(around) < len(outline):
        around.append(int(body.neighbours[0][around[-1]]))
    return SimpleNamespace(
        area_under_strip=float(np.sum(0.5 * (fibre[1:, 1] + fibre[:-1, 1]) * np.diff(fibre[:, 0]))),
        elongation=float(lengths.sum() / strip.length - 1),
        penetration=contact.penetration / size,
        contact_force_error=float("nan") if loading == "ends" else float(contact.contact_force()[1] / abs(load) - 1),
        load_share=contact.share,
        message=message,
        iterations=contact.iterations,
        laying_seconds=time.perf_counter() - begin,
        skipped="; ".join(skipped),
        outline=body.points[outline[around]],
    )


def _strip_body(strip, trapezoid, material, definition, size, loading, pressure):
    """Make the strip, loaded and held in its middle, and its mesh."""
    made = MESH_TYPES["structured"](strip.length, strip.height, size)
    mesh = Mesh(made.points + [-0.5 * strip.length, trapezoid.height], made.triangles, made.quads)
    cache = MeshCache(mesh, strip.thickness)
    springs, _ = cache.derive(definition, material)
    held = np.zeros(mesh.points.shape, dtype=bool)
    # Without friction the strip would slide off to one side.
    held[np.abs(mesh.points[:, 0]) <= 1e-9 * strip.length, 0] = True
    arguments, total = {}, pressure * strip.length * strip.thickness
    if loading == "pressure":
        top = mesh.outline_edges(1, mesh.points[:, 1].max())
        arguments = {"pressure": FollowerPressure.of_side(mesh, top, 0), "force": -total}
    elif loading == "gravity":
        weights = -total * mesh.particle_areas / mesh.area
        arguments = {"forces": np.stack([np.zeros(len(weights)), weights], axis=1)}
    else:
        low = np.abs(mesh.points[:, 1] - trapezoid.height) <= 1e-9 * trapezoid.height
        ends = low & (np.abs(np.abs(mesh.points[:, 0]) - 0.5 * strip.length) <= 1e-9 * strip.length)
        held[ends, 1] = True
        arguments = {"prescribed": np.where(ends[:, None], [0.0, -trapezoid.height], 0.0)}
    return Body(cache.network(held, springs), springs.reference, **arguments), mesh


def _trapezoid_body(strip, trapezoid, material, size):
    """Make the trapezoid of linear triangles (`delingette`): a negative area modulus fails at its corners."""
    mean = 0.5 * (trapezoid.lower_base + trapezoid.upper_base)
    made = MESH_TYPES["structured"](mean, trapezoid.height, size)
    y = made.points[:, 1]
    width = trapezoid.lower_base + (trapezoid.upper_base - trapezoid.lower_base) * y / trapezoid.height
    mesh = Mesh(np.stack([(made.points[:, 0] / mean - 0.5) * width, y], axis=1), made.triangles)
    cache = MeshCache(mesh, strip.thickness)
    springs, _ = cache.derive("delingette", material)
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[np.lexsort((np.abs(mesh.points[:, 0]), y))[0], 0] = True
    return Body(cache.network(held, springs), springs.reference, moves_little=True)


def band(values):
    """Return the half-width of the band of a value that scatters from mesh to mesh: twice its largest difference."""
    known = [value for value in values if np.isfinite(value)]
    return 2 * (max(known) - min(known)) if len(known) > 1 else float("nan")
