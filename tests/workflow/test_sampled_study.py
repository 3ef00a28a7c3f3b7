"""A sample through Snakemake: made, and doubled."""

import pytest
import xarray as xr

from tables import STUDIES

STUDY = STUDIES["sampled_study"]


# Its jobs are doubled in one process by tests/unit/test_samples.py; the quick study has a sample through Snakemake.
@pytest.mark.slow
def test_a_sample_is_made_and_doubled(run):
    run.write("sample.yaml", STUDY.format(size=8))
    code, output = run.snakemake("sample.yaml")
    assert code == 0, output
    before = run.times("results/sample/samples/*.h5")
    assert "lattice,length," in (run.folder / "results/sample/tables/sobol.csv").read_text()
    run.write("sample.yaml", STUDY.format(size=16))
    code, output = run.snakemake("sample.yaml")
    assert code == 0, output
    assert "sample 1 of 2" in output and "interpolate" not in output.rpartition("new ")[2]
    after = run.times("results/sample/samples/*.h5")
    assert len(after) == len(before) + 1 and {path: after[path] for path in before} == before
    with xr.open_datatree(run.folder / "results/sample/dataset.nc", engine="h5netcdf") as tree:
        assert tree["samples"].sizes["sample"] == 16 * 5
