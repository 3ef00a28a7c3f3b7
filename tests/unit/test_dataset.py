"""The dataset's form: dimensions, units, holes, and what a reader finds."""

import numpy as np
import xarray as xr

from springtune.kinds.scenes.variables import ROOT, SENSITIVITY
from springtune.output import dataset

AXES = {
    "beam": ("a", "b"),
    "mesh_type": ("structured",),
    "mesh_size": (1e-3, 2e-3),
    "material": ("steel",),
    "load": ("traction",),
    "definition": ("paper",),
    "kinematics": ("linear",),
    "stiffness_ratio": (0.5, 1.0),
}


def test_empty_dataset_is_all_holes_with_units():
    data = ROOT.empty(AXES)
    assert data.sizes["mesh_size"] == 2
    assert (data.status == 0).all() and data.displacement.isnull().all()
    assert (data.message == "").all()
    for name, variable in data.variables.items():
        assert variable.attrs["units"] and variable.attrs["long_name"], name
    assert data.status.attrs["flag_meanings"].split()[1] == "solved"


def test_written_dataset_opens_as_a_tree(tmp_path):
    path = tmp_path / "dataset.nc"
    root = ROOT.empty(AXES)
    root["displacement"].loc[{"beam": "b", "mesh_size": 2e-3}] = 1.5e-3
    root["message"].loc[{"beam": "a"}] = "why"
    curves = SENSITIVITY.empty(AXES)
    dataset.write(path, {"/": root, "/sensitivity": curves}, {"title": "t", "Conventions": "CF-1.11"})
    with xr.open_datatree(path, engine="h5netcdf") as tree:
        assert tree.attrs["title"] == "t"
        assert float(tree.displacement.sel(beam="b", mesh_size=2e-3).max()) == 1.5e-3
        assert np.isnan(tree.displacement.sel(beam="a")).all()
        assert tree.message.sel(beam="a").values.ravel()[0] == "why"
        assert "best_stiffness" in tree["sensitivity"]
    assert [file.name for file in tmp_path.iterdir()] == ["dataset.nc"]
