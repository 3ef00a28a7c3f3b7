"""The section `stability` of a study, and its stage."""

import pytest

from springtune.mechanics.integrators import BEHAVIOURS
from springtune.problem.geometry import Beam
from springtune.problem.materials import Material
from springtune.studies.kinds.collect import group_of
from springtune.studies.kinds.stability import AXES, EXPERIMENTS, ONCE
from springtune.studies.kinds.stability import solve as stability
from springtune.studies.kinds.stability.kind import KIND
from springtune.studies.output.dataset import DIMENSIONS
from springtune.studies.runs import attempts, store
from springtune.studies.runs import keys as code

from tables import STUDIES

STABILITY = group_of(KIND)


def test_experiments_are_one_a_definition_or_one_in_all(load):
    found = load(STUDIES["stability"])
    names = [name for name, _ in found.parts["stability"]]
    assert all(names.count(name) == (1 if name in ONCE else 2) for name in EXPERIMENTS)
    first = next(iter(found.parts["stability"].values()))
    assert first["mesh_sizes"] == [2.5e-3, 5e-3] and first["material"]["density"] == 7850.0
    assert set(found.axes["definition"]) == {"uniform", "lattice", "delingette"}


def test_output_without_experiments_is_refused(refusal):
    head, _, rest = STUDIES["stability"].partition("stability:")
    assert "add a section 'stability'" in refusal(f"{head}outputs: stability\n{rest[rest.index('grids:') :]}")


def test_every_variable_has_its_dimensions_described():
    own = {name for dimensions, *_ in STABILITY.variables.values() for name in dimensions}
    assert own <= set(DIMENSIONS) | set(STABILITY.dimensions)
    assert own - {"definition", "mesh_size", "experiment"} == set(AXES)
    assert STABILITY.flags["behaviour"] == BEHAVIOURS


@pytest.mark.parametrize("name", ["contrast", "slivers", "perturbation", "poisson", "strains", "buckling"])
def test_rows_have_the_names_and_labels_of_the_dataset(name):
    setup = stability.Setup(
        Beam(0.06, 0.02, 1e-3, "b"), Material(210e9, 0.3, 7850.0, "steel"), 2e4, "lattice", "structured", (5e-3,)
    )
    rows = [{"definition": "lattice", "experiment": name} | row for row in stability.RUN[name](setup)]
    names = {variable for row in rows for variable in row} & {*STABILITY.variables}
    found = STABILITY.of_rows(AXES | {"definition": ["lattice"], "mesh_size": [5e-3]}, rows, names)
    assert {key for row in rows for key in row} <= {*found.variables, "definition", "experiment"}
    for variable in names - {one for one in names if one.endswith(("_error", "displacement", "message"))}:
        assert found[variable].notnull().any(), variable


def test_a_failing_experiment_is_stored_with_its_message(tmp_path):
    """`axis-exact` needs rows of triangles, and a free mesh has none."""
    setup = {"beam": {"name": "", "length": 0.1, "height": 0.02, "thickness": 1e-3}, "force": 1.0,
             "material": {"name": "", "young_modulus": 1e6, "poisson_ratio": 0.3, "density": 1e3},
             "definition": "axis-exact", "mesh_type": "free", "mesh_sizes": [5e-3]}  # fmt: skip
    tasks = [{"key": "one", "name": "contrast"} | setup]
    content = {"folder": str(tmp_path), "files": [{"name": "one", "tasks": tasks}]}
    attempts.do("studies.kinds.stability.solve", content)
    assert store.read(tmp_path / "one.h5", ["one"])["one"]["experiment_message"]


def test_static_stages_know_no_dynamics():
    """A static scene assembles no masses: its stage does not even import them, and density is in none of its keys."""
    for stage in (
        "studies.kinds.bodies.solve",
        "studies.kinds.bodies.sensitivity",
        "studies.kinds.moduli.solve",
        "studies.kinds.laying.solve",
    ):
        assert not {"dynamics.py", "kernels.py"} & {file.name for file in code.closure(stage).files}
    assert "dynamics.py" in {file.name for file in code.closure("studies.kinds.stability.solve").files}
