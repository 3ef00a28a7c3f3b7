"""A cluster for all tests of this folder, and copies of the repository to run studies in."""

import pytest
from cluster import CannotError, cluster
from studies import ENVIRONMENT, copied


@pytest.fixture(scope="session")
def copies(tmp_path_factory):
    """Function that makes a copy of the repository."""
    if not (ENVIRONMENT / "python").exists():
        pytest.skip("make test-slurm installs what is needed")
    return lambda name: copied(tmp_path_factory.mktemp(name))


@pytest.fixture(scope="session")
def slurm(tmp_path_factory):
    """A cluster of two nodes."""
    try:
        with cluster(tmp_path_factory.mktemp("cluster") / "slurm"):
            yield
    except CannotError as error:
        pytest.skip(str(error))
