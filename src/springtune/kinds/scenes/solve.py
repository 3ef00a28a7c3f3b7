"""Stage `solve`: the mass-spring network of every scene, all scenes of a mesh together."""

import hashlib
import sys
import time
from functools import lru_cache
from pathlib import Path

import numpy as np

from ...jobs import atomic, store
from ...jobs.keys import hash_of
from ...jobs.spent import Spent
from ...mechanics.moduli import lateral_forces
from ...mechanics.network import Network
from ...mechanics.statics import FollowerPressure, StaticProblem
from ...mesh import read_mesh
from ...problem.boundary import FACE_POSITIONS, held, loaded_edges, measured, weights
from ...problem.loads import LOAD_KINDS
from ...problem.materials import Material
from ...reference.field import field_error, interpolate
from ...springs import DEFINITIONS, DefinitionError
from ...springs.identification import Case
from . import stored_reference as references

NETWORKS = 6
"""Factorised networks of a mesh that are kept: scenes come in an order in which few are enough."""


def run(tasks, done):
    """Solve the scenes of a bundle that are not stored yet.

    A scene that fails is stored with its status and message; it never stops the others.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder``, ``meshes`` and ``references`` (folders), ``calibration`` (file of the stage `calibrate`,
        or nothing) and ``families``, each with ``name``,
        ``thickness``, ``keep_fields`` and ``scenes``, and each of these with ``key, material, kind, force, definition,
        kinematics``, ``reference`` (see `springtune.kinds.scenes.stored_reference.read`) and either ``stiffness``, or
        ``calibration``, the name of a group, and ``thickness_ratio``.
    done : str or Path
        JSON file to write: what was spent.
    """
    tasks, spent = atomic.read_json(tasks), Spent()
    calibration = atomic.read_json(tasks["calibration"]) if tasks["calibration"] else {}
    for family in tasks["families"]:
        path = Path(tasks["folder"]) / f"{family['name']}.h5"
        present = store.stored(path)
        scenes = {_stored_key(scene, calibration): scene for scene in family["scenes"]}
        missing = {name: scene for name, scene in scenes.items() if name not in present}
        if not missing:
            continue
        mesh = read_mesh(Path(tasks["meshes"]) / f"{family['name']}.vtu")
        fields = References(tasks["references"], mesh)
        solver = Solver(mesh, family["thickness"], fields, family["keep_fields"])
        order = sorted(missing, key=lambda name: _turn(missing[name]))
        results = {}
        for name in order:
            scene = missing[name]
            results[name] = result = solver.solve(scene, calibration)
            spent.add(scene["kinematics"], len(mesh.points), result["seconds"])
            spent.add(scene["definition"], len(mesh.points), solver.deriving)
        store.add(path, results)
    atomic.write_json(done, spent.summary())


def _stored_key(scene, calibration):
    """Key of a scene's result; as `springtune.campaign.plan.solved_key`, from the task."""
    group = scene.get("calibration")
    return hash_of(scene["key"], calibration[group]["stiffness"]) if group else scene["key"]


def _turn(scene):
    """Order in which scenes of one network follow each other."""
    uniform = DEFINITIONS[scene["definition"]].uniform
    return ("" if uniform else scene["definition"], scene["material"]["poisson_ratio"], LOAD_KINDS[scene["kind"]].held)


class References:
    """Fields of references at the particles of a mesh, read when first asked for.

    Parameters
    ----------
    folder : str or Path
        Where the references are stored.
    mesh : Mesh
    """

    def __init__(self, folder, mesh):
        self.folder, self.mesh, self.fields = folder, mesh, {}

    def field(self, reference):
        """Displacements for 1 N [m], shape (n_points, 2); None where the reference has none."""
        key = reference["key"]
        if key not in self.fields:  # for 1 N, of whichever material asks first
            labels = ("x", "y", "displacements")
            found = references.read(self.folder, reference | {"displacement": 1.0}, labels)
            grid = [found.get(label) for label in labels]
            self.fields[key] = None if grid[0] is None else interpolate(*grid, self.mesh.points)
        field = self.fields[key]
        return None if field is None else reference["displacement"] * field


class Solver:
    """Solves scenes of one mesh; networks that differ in reference stiffness alone are assembled and factorised once.

    Parameters
    ----------
    mesh : Mesh
    thickness : float
        Of the beam [m].
    references : References
    keep_fields : bool
        Whether displacements of all particles are part of the results.
    """

    def __init__(self, mesh, thickness, references, keep_fields):
        self.mesh, self.thickness = mesh, thickness
        self.references, self.keep_fields = references, keep_fields
        self.patterns, self.networks, self.found = {}, {}, {}
        self.deriving = 0.0  # seconds that the last scene spent on its springs; none where it shares them
        self.held = lru_cache(lambda kind: held(mesh, kind))
        self.weights = lru_cache(lambda kind: weights(mesh, kind))
        self.measured = lru_cache(lambda kind: measured(mesh, kind))

    def solve(self, scene, calibration):
        """Result of a scene, ready to be stored.

        Parameters
        ----------
        scene : dict
        calibration : dict
            Calibrated stiffnesses by group.

        Returns
        -------
        dict
            ``status`` (a flag meaning of the dataset), ``message``, ``displacement`` [m], ``stiffness`` [N/m],
            ``field_error``, ``iterations``, ``residual``, ``negative_pivots``, ``seconds``, those of the definition:
            ``definition_seconds``, ``definition_evaluations``, ``spring_ratio``, and ``displacements`` [m] of the
            particles where they are kept.
        """
        begin, self.deriving = time.perf_counter(), 0.0
        try:
            result = self._solve(scene, calibration)
        except DefinitionError as error:
            result = {"status": "failed", "message": f"{scene['definition']}: {error}"}
        except Exception as error:  # the other scenes shall still arrive
            result = {"status": "failed", "message": f"{type(error).__name__}: {error}"}
        return result | {"seconds": time.perf_counter() - begin - self.deriving}

    def _solve(self, scene, calibration):
        definition = DEFINITIONS[scene["definition"]]
        stiffness = scene.get("stiffness")
        if "calibration" in scene:
            group = calibration[scene["calibration"]]
            if group["stiffness"] is None:
                return {"status": "failed", "message": group["message"]}
            stiffness = group["stiffness"] * scene["thickness_ratio"]
        reference = self.references.field(scene["reference"])
        springs, seconds = self._springs(scene, stiffness, reference)
        kind = LOAD_KINDS[scene["kind"]]
        problem = self._problem(springs, kind, scene["follower"])
        s = scene["force"] / springs.reference
        found = problem.linear(s) if scene["kinematics"] == "linear" else problem.nonlinear(s)
        result = {
            "iterations": found.iterations,
            "residual": found.residual,
            "stiffness": springs.reference if definition.uniform else np.nan,
            "definition_seconds": seconds,
            "definition_evaluations": springs.evaluations,
            "spring_ratio": springs.spring_ratio,
            "solver": found.factor.name if found.factor else "",
            "load_share": found.load_share if scene["kinematics"] == "nonlinear" else np.nan,
        }
        status, message, pivots = problem.judge(s, found)
        result |= {"status": status, "message": message}
        if not found.converged:
            if found.last is not None:
                result["last_displacement"] = float(np.tensordot(found.last, self.measured(kind), axes=2))
            return result
        result["displacement"] = float(np.tensordot(found.displacements, self.measured(kind), axes=2))
        if kind.pressed:
            result |= self._face(found.displacements, kind)
        if reference is not None:
            result["field_error"] = field_error(self.mesh, found.displacements, scene["force"] * reference)
        result["negative_pivots"] = pivots
        return result | ({"displacements": found.displacements} if self.keep_fields else {})

    def _springs(self, scene, stiffness, reference):
        """Springs of a scene and the seconds that they took; the last ones are kept for the scene's other loads."""
        definition = DEFINITIONS[scene["definition"]]
        material = Material(**scene["material"])
        name, given = (definition.name, material, stiffness), stiffness
        if definition.needs == "cases":
            if reference is None:
                raise DefinitionError("needs the reference's displacements, and there are none")
            force, kind = scene["force"], LOAD_KINDS[scene["kind"]]
            given = [Case(self.held(kind), force * self.weights(kind), force * reference)]
            name += (scene["kind"], force)
        if self.found.get("name") != name:
            begin = time.perf_counter()
            springs = definition.springs(self.mesh, material, self.thickness, given)
            self.deriving = time.perf_counter() - begin
            self.found = {"name": name, "springs": springs, "seconds": self.deriving}
        return self.found["springs"], self.found["seconds"]

    def _face(self, displacements, kind):
        """Mean displacement of a pressed face and its profile, along the force [m]."""
        face = np.flatnonzero(self.weights(kind)[:, kind.axis] > 0)
        x, moved = self.mesh.points[face, kind.along], displacements[face, kind.axis]
        order = np.argsort(x)
        profile = np.interp(FACE_POSITIONS * np.ptp(x), x[order], moved[order])
        return {"face_mean": float((self.weights(kind) * displacements).sum()), "face_profile": profile}

    def _problem(self, springs, kind, follower=False):
        directions = self.held(kind)
        parts = [directions, springs.relative, *(energy.key for energy in springs.energies)]
        name = hashlib.sha256(b"".join(bytes(memoryview(part).cast("B")) for part in parts)).digest()
        network, problems = self.networks.pop(name, (None, {}))
        if network is None:
            like = self.patterns.get(directions.tobytes())
            network = Network(self.mesh, directions, springs.relative, springs.energies, like)
            self.patterns.setdefault(directions.tobytes(), network)
        while len(self.networks) >= NETWORKS:
            self.networks.pop(next(iter(self.networks)))
        self.networks[name] = network, problems  # the last one used is the last one to go
        label = (kind, springs.lateral, follower)
        if label not in problems:
            pattern = self.weights(kind)
            if springs.lateral:
                pattern = pattern + springs.lateral / np.ptp(self.mesh.points[:, 1]) * lateral_forces(self.mesh)
            turning = FollowerPressure(self.mesh, *loaded_edges(self.mesh, kind)) if follower else None
            problems[label] = StaticProblem(network, pattern, turning)
        return problems[label]


if __name__ == "__main__":
    run(*sys.argv[1:])
