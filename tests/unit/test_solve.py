"""The stage that solves scenes."""

import time
from dataclasses import asdict

import pytest

from springtune.kinds.scenes import solve
from springtune.mesh import MESH_TYPES
from springtune.problem.materials import Material
from springtune.springs import DEFINITIONS

STEEL = asdict(Material("steel", 210e9, 0.3))


class NoReferences:
    def field(self, reference):
        return None


def scene(definition, kinematics):
    return {"key": definition + kinematics, "material": STEEL, "kind": "axial", "follower": False, "force": 1e3,
            "definition": definition, "kinematics": kinematics, "reference": {}}  # fmt: skip


def test_the_time_of_a_definition_is_taken_off_the_scene_that_spent_it_alone(monkeypatch):
    """Scenes that share springs used to lose seconds that none of them had spent, down to below zero."""
    lattice = DEFINITIONS["lattice"]
    patient = DEFINITIONS | {"lattice": Patient(lattice)}
    monkeypatch.setattr(solve, "DEFINITIONS", patient)
    solver = solve.Solver(MESH_TYPES["structured"](0.05, 0.02, 5e-3), 1e-3, NoReferences(), False)
    results, deriving = [], []
    for kinematics in ("linear", "nonlinear", "linear"):
        begin = time.perf_counter()
        results.append(solver.solve(scene("lattice", kinematics), {}))
        deriving.append(solver.deriving)
        assert results[-1]["status"] == "solved"
        assert results[-1]["seconds"] + solver.deriving == pytest.approx(time.perf_counter() - begin, abs=1e-3)
    assert deriving[0] >= Patient.SECONDS and deriving[1:] == [0.0, 0.0]
    assert all(0 < result["seconds"] < Patient.SECONDS for result in results)
    assert len({result["definition_seconds"] for result in results}) == 1  # what they cost, whoever paid


class Patient:
    """A definition that takes its time."""

    SECONDS = 0.3

    def __init__(self, definition):
        self.definition = definition

    def __getattr__(self, name):
        return getattr(self.definition, name)

    def springs(self, *arguments):
        time.sleep(self.SECONDS)
        return self.definition.springs(*arguments)
