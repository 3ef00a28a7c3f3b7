"""The section `stability` of a study, and its stage."""

from springtune.studies.runs import attempts, store

from tables import STUDIES


def test_output_without_experiments_is_refused(refusal):
    head, _, rest = STUDIES["stability"].partition("stability:")
    assert "add a section 'stability'" in refusal(f"{head}outputs: stability\n{rest[rest.index('grids:') :]}")


def test_a_failing_experiment_is_stored_with_its_message(tmp_path):
    """`axis-exact` needs rows of triangles, and a free mesh has none."""
    setup = {"beam": {"name": "", "length": 0.1, "height": 0.02, "thickness": 1e-3}, "force": 1.0,
             "material": {"name": "", "young_modulus": 1e6, "poisson_ratio": 0.3, "density": 1e3},
             "definition": "axis-exact", "mesh_type": "free", "mesh_sizes": [5e-3]}  # fmt: skip
    tasks = [{"key": "one", "name": "contrast"} | setup]
    content = {"folder": str(tmp_path), "files": [{"name": "one", "tasks": tasks}]}
    attempts.do_tasks("studies.kinds.stability.solve", content)
    assert store.read(tmp_path / "one.h5", ["one"])["one"]["experiment_message"]
