"""A study on a cluster: the same values as on one machine."""

import pytest
from cluster import NODES
from studies import jobs

pytestmark = pytest.mark.slow


def test_the_quick_study_is_the_same_there(copies, slurm):
    here, there = copies("here"), copies("there")
    here.springtune("run", "config/quick.yaml")
    on_cluster = ("run", "config/quick.yaml", "--workflow-profile", "slurm")
    output = there.springtune(*on_cluster)
    assert "exit" not in output
    there.springtune("diff", here.folder / "results/quick/dataset.nc", "results/quick/dataset.nc")
    # Each job ran once, and on both nodes.
    assert {state for state, _ in jobs()} == {"COMPLETED"} and {node for _, node in jobs()} == {*NODES}
    # What was made there is not made again here, although bundles would be others.
    for words in (on_cluster[:2], on_cluster):
        assert "Nothing to be done" in there.springtune(*words)
