"""Stage `solve`: the mass-spring network of every scene, all scenes of a mesh together."""

import sys
import time
from pathlib import Path

import numpy as np

from ..boundary import clamped, end_weights
from ..materials import Material
from ..mesh import read_mesh
from ..network import Network
from ..springs import DEFINITIONS
from ..statics import StaticProblem
from . import files, store


def run(tasks, calibration, done):
    """Solve the scenes of a bundle that are not stored yet.

    A scene that fails is stored with its status and message; it never stops the others.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder``, ``meshes`` (folder) and ``families``, each with ``name``, ``length``, ``thickness`` and
        ``scenes``, and each of these with ``key, material, force, definition, kinematics`` and either ``stiffness`` or
        ``calibration``, the name of a group.
    calibration : str or Path
        JSON file of the stage `calibrate`.
    done : str or Path
        JSON file to write: how many scenes were solved.
    """
    tasks, calibration = files.read_json(tasks), files.read_json(calibration)
    solved = 0
    for family in tasks["families"]:
        path = Path(tasks["folder"]) / f"{family['name']}.h5"
        present = store.stored(path)
        scenes = {_stored_key(scene, calibration): scene for scene in family["scenes"]}
        missing = {name: scene for name, scene in scenes.items() if name not in present}
        if not missing:
            continue
        beam = Solver(read_mesh(Path(tasks["meshes"]) / f"{family['name']}.vtu"), family["length"], family["thickness"])
        store.add(path, {name: beam.solve(scene, calibration) for name, scene in missing.items()})
        solved += len(missing)
    files.write_json(done, {"solved": solved})


def _stored_key(scene, calibration):
    """Key of a scene's result; as `springtune.stages.tasks.solved_key`, from the task."""
    group = scene.get("calibration")
    return files.key(scene["key"], calibration[group]["stiffness"]) if group else scene["key"]


class Solver:
    """Solves scenes of one mesh; networks that differ in reference stiffness alone are assembled and factorised once.

    Parameters
    ----------
    mesh : Mesh
    length, thickness : float
        Of the beam [m].
    """

    def __init__(self, mesh, length, thickness):
        self.mesh, self.thickness = mesh, thickness
        self.held = clamped(mesh)
        self.weights = end_weights(mesh, length)
        self.problems = {}

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
            ``iterations``, ``residual``, ``negative_pivots``, ``seconds``, and ``displacements`` [m] of the particles.
        """
        begin = time.perf_counter()
        try:
            result = self._solve(scene, calibration)
        except Exception as error:  # the other scenes shall still arrive
            result = {"status": "failed", "message": f"{type(error).__name__}: {error}"}
        return result | {"seconds": time.perf_counter() - begin}

    def _solve(self, scene, calibration):
        definition = DEFINITIONS[scene["definition"]]
        stiffness = scene.get("stiffness")
        if "calibration" in scene:
            group = calibration[scene["calibration"]]
            if group["stiffness"] is None:
                return {"status": "failed", "message": group["message"]}
            stiffness = group["stiffness"]
        reference, relative = definition.springs(self.mesh, Material(**scene["material"]), self.thickness, stiffness)
        problem = self._problem(relative)
        s = scene["force"] / reference
        found = problem.linear(s) if scene["kinematics"] == "linear" else problem.nonlinear(s)
        result = {
            "iterations": found.iterations,
            "residual": found.residual,
            "stiffness": reference if definition.uniform else np.nan,
        }
        if not found.converged:
            message = f"{found.reason}; last residual {found.residual:.1e}"
            return result | {"status": "not_converged", "message": message}
        result["displacement"] = float(np.tensordot(found.displacements, self.weights, axes=2))
        result["negative_pivots"] = pivots = found.factor.negative_pivots
        if pivots:
            message = f"unstable equilibrium: the tangent has {pivots} negative pivot{'s' if pivots > 1 else ''}"
            result |= {"status": "unstable", "message": message}
        else:
            result |= {"status": "solved", "message": ""}
        return result | {"displacements": found.displacements}

    def _problem(self, relative):
        name = relative.tobytes()
        if name not in self.problems:
            self.problems[name] = StaticProblem(Network(self.mesh, self.held, relative), self.weights)
        return self.problems[name]


if __name__ == "__main__":
    run(*sys.argv[1:])
