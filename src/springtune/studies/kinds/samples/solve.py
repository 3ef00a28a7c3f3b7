"""Stage `sample`: the networks of sampled scenes.

A scene's network is that of E t = 1 under a force over E t: in linear kinematics thickness, modulus and force only
scale an answer, and rows that differ in these alone are solved once. Meshes of as many cells and rows follow each
other, since their networks share numbering, sparsity and symbolic factorization.
"""

import time
from functools import partial
from pathlib import Path

import numpy as np

from springtune.mesh import MESH_TYPES
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import Material
from springtune.problem.status import Status
from springtune.scene.sheet import Sheet
from springtune.springs import DefinitionError

from ...runs import store
from .designs import draw

DRAWN = "drawn"
"""Name of the parameters among the results of a task."""

GONE_NETWORK = "lost "
"""Beginning of the names of networks that went beyond the limits."""

TOGETHER = {"linear": 32, "nonlinear": 4}
"""Tasks whose meshes are sorted together: of more of them more share cells."""

PART = "_part"
"""End of the stem of the file of a task that is not done yet."""

SCALES = 1e-7
"""Largest relative difference of an answer that was scaled from one that was not: they differ by rounding alone."""


def run(content, costs, kept_back=store.KEPT_BACK):
    """Solve the scenes of a bundle that are not stored yet."""
    waiting = []
    for block in content["files"]:
        path = Path(content["folder"]) / f"{block['name']}.h5"
        present = store.stored(path, costs.limits)
        missing = {key: scene for key, scene in content["results"].items() if key not in present}
        if missing or DRAWN not in present:
            lost = {name for name in present if name.startswith(GONE_NETWORK)}
            reasons = store.read(path, lost) if lost else {}
            reasons = {name: reasons[name]["message"] for name in lost}
            waiting.append(_Block(content, block, path, missing, DRAWN not in present, reasons))
            waiting[-1].take_up(costs.limits)
    count = TOGETHER[content["kinematics"]]
    for begin in range(0, len(waiting), count):
        _solve_together(content, waiting[begin : begin + count], costs, kept_back)


def gone(content, key, why, limits):
    """Store that a network went beyond its limits: its block is solved again without it."""
    name = key.partition(" ")[0]
    store.add(Path(content["folder"]) / f"{name}.h5", {f"{GONE_NETWORK}{key}": {"message": why, store.LIMITS: limits}})


class _Block:
    """Rows of some base samples, and what is known of their scenes."""

    def __init__(self, tasks, block, path, missing, new, lost):
        self.key, self.path, self.missing, self.new, self.lost = block["key"], path, missing, new, lost
        self.drawn = draw(tasks["design"], tasks["seed"], tasks["parameters"], block["first"], block["last"])
        rows = len(self.drawn["length"])
        self.particles = np.zeros(rows, dtype=np.int64)
        self.displacement = {key: np.full(rows, np.nan) for key in missing}
        self.status = {key: np.full(rows, Status.FAILED, dtype=np.int8) for key in missing}
        self.messages = {key: {} for key in missing}
        self.limited = dict.fromkeys(missing, "")
        self.done = np.zeros(rows, dtype=bool)
        self.part, self.kept, self.solved, self.seconds = path.with_stem(f"{path.stem}{PART}"), True, 0, 0.0

    def take_up(self, limits):
        """Go on where a process that ended before the block was done had got to, within the same limits."""
        if not set(self.missing) <= store.stored(self.part, limits):
            return
        found = store.read(self.part, self.missing, ("displacement", "status", "particles", "done"))
        for key, result in found.items():
            self.displacement[key], self.status[key] = result["displacement"], result["status"]
            self.messages[key], self.limited[key] = result["messages"], result["limited"]
            self.particles = result["particles"]
        self.done = np.all([result["done"] for result in found.values()], axis=0)

    def keep_part(self):
        """Store what is known of a block that is not done."""
        if not self.kept:
            results = {key: one for key, one in self.results().items() if key != DRAWN}
            more = {key: {"done": self.done, "limited": self.limited[key]} for key in results}
            store.add(self.part, {key: one | more[key] for key, one in results.items()})
            self.kept = True

    def keep_whole(self):
        """Store the results of a block."""
        store.add(self.path, self.results())
        self.part.unlink(missing_ok=True)

    def meshes(self):
        """Rows of each distinct mesh that are not done, by its length, height and mesh size [m]."""
        found = {}
        boxes = zip(*(self.drawn[name].tolist() for name in ("length", "height", "mesh_size")))
        for row, box in enumerate(boxes):
            if not self.done[row]:
                found.setdefault(box, []).append(row)
        return found

    def keep(self, key, rows, scale, result):
        """Note what became of the scenes of some rows, a result over a scale each."""
        self.displacement[key][rows] = result["displacement"] * scale
        self.status[key][rows] = result["status"]
        if result["message"]:
            self.messages[key] |= dict.fromkeys(map(str, rows), result["message"])
        self.limited[key] = self.limited[key] or result.get(store.LIMITS, "")

    def results(self):
        """What to store."""
        found = {DRAWN: self.drawn} if self.new else {}
        for key in self.missing:
            found[key] = {
                "displacement": self.displacement[key],
                "status": self.status[key],
                "messages": self.messages[key],
                "particles": self.particles,  # of the mesh type, which parameters say nothing of
            }
            if self.limited[key]:
                found[key][store.LIMITS] = self.limited[key]
        return found


def _solve_together(tasks, blocks, costs, kept_back):
    """Solve blocks: mesh after mesh, those of as many cells after each other."""
    meshes = [(box, block, rows) for block in blocks for box, rows in block.meshes().items()]
    meshes.sort(key=lambda one: [round(side / one[0][2]) for side in one[0][:2]])
    like, scaling, since = None, {}, time.perf_counter()
    for box, block, rows in meshes:
        begin = time.process_time()  # which a busy machine does not change: bundles are made by it
        like = _solve_mesh(tasks, block, box, np.array(rows), like, scaling, costs) or like
        block.seconds += time.process_time() - begin
        if costs.broken:
            continue
        block.done[rows], block.kept, block.solved = True, False, block.solved + len(rows)
        if time.perf_counter() > since + kept_back:
            for one in blocks:
                one.keep_part()
            since = time.perf_counter()
    for block in blocks:
        if not costs.broken:
            block.keep_whole()
            costs.add("sampled", block.solved * len(block.missing), block.seconds)


def _solve_mesh(tasks, block, box, rows, like, scaling, costs):
    """Solve the scenes of some rows of a block that share a mesh; the meshed sheet, if there is one."""

    def attempt(name, function):
        key = f"{block.key} {rows[0]} {name}"
        if f"{GONE_NETWORK}{key}" in block.lost:
            return _failed(block.lost[f"{GONE_NETWORK}{key}"], **{store.LIMITS: costs.limits})
        return costs.attempt(key, function, _failed)

    # One network at a time: what the one before has left, the next one's symbolic factor is.
    sheet = attempt(tasks["meshed"], lambda: Sheet(MESH_TYPES[tasks["mesh_type"]](*box), 1.0, networks=1, like=like))
    if not isinstance(sheet, Sheet):
        for key in block.missing if sheet else ():
            block.keep(key, rows, 1.0, sheet)
        return None
    block.particles[rows] = len(sheet.mesh.points)
    drawn, linear = block.drawn, tasks["kinematics"] == "linear"
    ratios = drawn["poisson_ratio"][rows]
    # What deforms a network of E t = 1 as the row's force does the row's.
    loads = drawn["force"][rows] / (drawn["young_modulus"][rows] * drawn["thickness"][rows])
    for key, scene in block.missing.items():
        definition = scene["definition"]
        if definition not in scaling:
            objection = attempt(f"{key} scales", partial(_objection, sheet, scene, drawn, rows[0]))
            # A sample without an answer objects to nothing: the next one is asked.
            if isinstance(objection, str):
                scaling[definition] = objection
        if scaling.get(definition):
            block.keep(key, rows, 1.0, _failed(scaling[definition]))
            continue
        for ratio in np.unique(ratios):
            alike, name = ratios == ratio, f"{key} {float(ratio)!r}"
            if linear:
                found = attempt(name, partial(_solved, sheet, scene, ratio, 1.0, "linear"))
                if found:
                    block.keep(key, rows[alike], loads[alike], found)
                continue
            for load in np.unique(loads[alike]):
                solved = partial(_solved, sheet, scene, ratio, scene["sign"] * load, "nonlinear", scene["follower"])
                found = attempt(f"{name} {float(load)!r}", solved)
                if found:
                    block.keep(key, rows[alike & (loads == load)], 1.0, found)
    return sheet


def _failed(why, **limits):
    return limits | {"displacement": np.nan, "status": Status.FAILED, "message": why}


def _objection(sheet, scene, drawn, row):
    """Why answers of a definition do not scale on the mesh of a row, or an empty string; None without an answer."""
    ratio, modulus, thickness = (float(drawn[name][row]) for name in ("poisson_ratio", "young_modulus", "thickness"))
    own, load = Sheet(sheet.mesh, thickness, like=sheet), 1.0 / (modulus * thickness)
    answers = [_solved(sheet, scene, ratio, load, "linear"), _solved(own, scene, ratio, 1.0, "linear", modulus=modulus)]
    unit, answer = (one["displacement"] for one in answers)
    if not np.isfinite([unit, answer]).all():
        return None
    if abs(unit - answer) <= SCALES * abs(answer):
        return ""
    return (
        f"{scene['definition']}: answers are not in proportion to force over Young's modulus and thickness, as those "
        "of samples have to be; put it into a grid instead"
    )


def _solved(sheet, scene, ratio, load, kinematics, follower=False, modulus=1.0):
    """Result of a network under a force: without a modulus one of E t = 1, and the force is over E t [m]."""
    kind = LOAD_KINDS[scene["kind"]]
    try:
        springs, _ = sheet.derive(scene["definition"], Material(modulus, float(ratio)))
    except DefinitionError as error:
        return _failed(f"{scene['definition']}: {error}")
    found = sheet.solve(kind, springs, load, kinematics, follower)
    return {"displacement": found.displacement, "status": found.status, "message": found.message}
