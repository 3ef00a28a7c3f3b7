"""A dataset with every group, of which each number is told from the others; for tests and examples of figures."""

from functools import cache, partial
from pathlib import Path

import numpy as np
import xarray as xr
import yaml

import springtune as st
from springtune.studies.kinds.bodies.collect import ROOT, SENSITIVITY
from springtune.studies.output import dataset as stored

GIVEN = yaml.load(Path(__file__).with_suffix(".yaml").read_text(), yaml.CSafeLoader)
LABELS = GIVEN["labels"]
BEAMS, TYPES, SIZES, DEFINITIONS = (LABELS[name] for name in ("beam", "mesh_type", "mesh_size", "definition"))


def made(name):
    """Group of distinct numbers over dimensions: each variable counts on where the one before it ended."""
    told, start = GIVEN[name], 1
    data = xr.Dataset(coords=told["labels"])
    for variable, dims in told["variables"].items():
        shape = [data.sizes[dim] for dim in dims.split()]
        count = int(np.prod(shape))
        data[variable] = dims.split(), 1e-3 * np.arange(start, start + count).reshape(shape)
        start += count
    for variable, like in told.get("flags", {}).items():
        data[variable] = xr.ones_like(data[like], dtype=np.int8)
    for variable, like in told.get("texts", {}).items():
        data[variable] = xr.full_like(data[like], "", dtype=object)
    for variable, (dims, values) in told.get("given", {}).items():
        values = np.array(values, dtype=float if np.array(values).dtype.kind == "f" else object)
        data[variable] = dims.split(), np.broadcast_to(values, [data.sizes[dim] for dim in dims.split()]).copy()
    return data.assign_attrs(told.get("attributes", {}))


def sensitivity():
    data = made("sensitivity")
    data["stiffness"] = 1e3 * data.stiffness_ratio.broadcast_like(data.displacement)
    data["best_stiffness"] = data.stiffness.isel(stiffness_ratio=0, drop=True) + 300
    return data.assign(predicted_stiffness=data.best_stiffness + 50)


def fields():
    data = made("fields")
    ends = xr.DataArray([[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]], dims=("end", "spring"))
    shape = data.x.isel(particle=0, drop=True) * 0
    topology = {"cf_role": "mesh_topology", "topology_dimension": 2, "node_coordinates": "x y"}
    topology |= {"edge_node_connectivity": "spring_nodes", "face_node_connectivity": "cell_nodes"}
    corners = xr.DataArray([[0.0, 1.0, 2.0], [1.0, 3.0, 2.0]], dims=("cell", "cell_corner"))
    return data.assign(
        mesh=xr.DataArray(0, attrs=topology),
        spring_nodes=(shape + ends).transpose(*shape.dims, "spring", "end").rename(end="spring_end"),
        cell_nodes=shape + corners,
    )


def stability():
    data = made("stability")
    data.buckling_message[0, 1] = "nothing bifurcates"
    done = ["limits", "maps", "drift", "rest", "slivers", "strains", "buckling"]
    return data.assign_coords(experiment=done)


def engine_curves():
    data = made("engine_curves")
    best = 1 + data.error.isel(stiffness_factor=0, drop=True)
    return data.assign(best_factor=best, best_factor_message=xr.full_like(best, "", dtype=object))


def samples():
    """Rows of four base samples of two parameters."""
    return made("samples").set_coords(["height", "force"])


def sobol():
    data = made("sobol")
    counted = xr.full_like(data.first_order.isel(parameter=0, drop=True), 4, dtype=int)
    return data.assign(base_samples=counted, base_samples_without=0 * counted)


def shapes():
    """Two shapes under one load: of each two quantities, one of which others have computed."""
    data = made("shapes")
    data["particles"] = 1e3 * data.particles.max() - 1e3 * data.particles
    data["status"] = xr.zeros_like(data.solve_seconds, dtype=np.int8)
    data.status.loc[{"load": "traction"}] = 1
    other = dict.fromkeys(("mesh_type", "mesh_size", "definition"), 0)
    return data.assign(reference_applies=xr.ones_like(data.status.isel(other, drop=True)))


def shape_fields():
    """A square of each shape, drawn on the free mesh of 1 mm."""
    data = made("shape_fields")
    ends = np.array([[0, 1], [1, 2], [2, 3]])
    data["spring_nodes"] = ("case", "spring", "spring_end"), np.array([ends, ends])
    return data.assign(outline_round=xr.zeros_like(data.outline_x, dtype=int))


def dataset(*names):
    """The tree of a study of all kinds: every label that the groups share is in each of them, and all is solved.

    With names the root has these groups alone.
    """
    made = _dataset()
    kept = {f"/{name}": made[name] for name in names or made.children}
    return xr.DataTree.from_dict({"/": made.to_dataset()} | kept).copy(deep=True)


@cache
def _dataset():
    own = (sensitivity, fields, stability, engine_curves, samples, sobol, shapes, shape_fields)
    groups = {name: partial(made, name) for name in GIVEN if name not in ("labels", "root", "small")}
    groups |= {one.__name__: one for one in own}
    # Groups are written and read one by one, so that labels of one need not be those of another.
    return xr.DataTree.from_dict({"/": made("root")} | {f"/{name}": make() for name, make in groups.items()})


def filled(data, rows):
    """Group of a dataset in whose cells values are put: each row has some labels, and what is there."""
    for row in rows:
        place = {name: label for name, label in row.items() if name in data.dims}
        for name in row.keys() - place.keys():
            data[name].loc[{dim: label for dim, label in place.items() if dim in data[name].dims}] = row[name]
    return data


SMALL_AXES = GIVEN["small"]["labels"]
"""Labels of a small dataset of scenes and curves."""

HELD = {*GIVEN["small"]["held"].split()}
"""Variables of the datasets that are compared."""

ATTRIBUTES = {"study": "small", "springtune_version": "0", "config": "title: small\nbeams: 1\n"}


def small(**axes):
    """A study of scenes and curves in memory: numbers of their own, all solved."""
    axes = SMALL_AXES | axes
    root, curves = ROOT.empty(axes, HELD), SENSITIVITY.empty(axes, HELD)
    for data in (root, curves):
        for name, array in data.data_vars.items():
            if array.dtype.kind == "f":
                array.values[...] = 1e-3 * np.arange(1, array.size + 1).reshape(array.shape)
            elif str(name).endswith("status"):
                array.values[...] = st.Status.SOLVED
    return xr.DataTree.from_dict({"/": root.assign_attrs(ATTRIBUTES), "/sensitivity": curves})


def written(tree, path):
    groups = {node.path: node.to_dataset(inherit=False) for node in tree.subtree}
    groups["/"].attrs, attributes = {}, tree.attrs
    stored.write(path, groups, attributes)
    return path
