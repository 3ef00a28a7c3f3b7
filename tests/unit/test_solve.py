"""The stage that solves scenes."""

import time
from dataclasses import asdict

from springtune.mesh import MESH_TYPES
from springtune.problem.materials import Material
from springtune.problem.status import Status
from springtune.scene.sheet import Sheet
from springtune.studies.kinds.scenes.solve import solved

STEEL = asdict(Material(210e9, 0.3, name="steel"))


def scene(definition, kinematics):
    return {"key": "", "material": STEEL, "kind": "axial", "follower": False, "force": 1e3, "definition": definition,
            "kinematics": kinematics, "reference": {}}  # fmt: skip


def test_the_time_of_a_definition_is_taken_off_the_scene_that_spent_it_alone():
    """Scenes that share springs used to lose seconds that none of them had spent, down to below zero."""
    sheet = Sheet(MESH_TYPES["structured"](0.05, 0.02, 5e-3), 1e-3)
    results, deriving = [], []
    for kinematics in ("linear", "nonlinear", "linear"):
        before, begin = sheet.deriving, time.perf_counter()
        results.append(solved(sheet, scene("adjoint", kinematics)))
        elapsed = time.perf_counter() - begin
        deriving.append(sheet.deriving - before)
        assert results[-1]["status"] == Status.SOLVED
        # However busy the machine is, parts take no longer than all of it, and counting one twice would.
        assert 0 < results[-1]["seconds"] <= elapsed - deriving[-1]
    assert deriving[0] > 0 and deriving[1:] == [0.0, 0.0]
    assert [result["definition_seconds"] for result in results] == 3 * deriving[:1]  # what they cost, whoever paid
