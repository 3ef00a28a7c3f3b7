"""A sample through Snakemake: made, and doubled."""

import pytest
import xarray as xr

STUDY = """
title: A small sample
beams: {{beam: {{length: 100 mm, height: 40 mm}}}}
materials: {{steel: {{young_modulus: 210 GPa, poisson_ratio: 0.3}}}}
outputs: tables
samples:
  size: {size}
  load: traction
  definition: lattice
  parameters:
    length: {{from: 100 mm, to: 104 mm}}
    height: 40 mm
    mesh_size: {{from: 10 mm, to: 20 mm}}
    young_modulus: 1 GPa
    poisson_ratio: 0.3
    force: {{from: 1 N, to: 2 N}}
grids:
  one: {{beam: beam, mesh_type: structured, mesh_size: 20 mm, material: steel, load: traction, force: 1 kN,
        definition: lattice, kinematics: linear, sensitivity: false}}
"""


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
