"""A dataset with every group, of which each number is told from the others; for tests and examples of figures."""

from functools import cache

import numpy as np
import xarray as xr

import springtune as st
from springtune.studies.kinds.bodies.variables import ROOT, SENSITIVITY
from springtune.studies.output import dataset as stored

BEAMS, TYPES, SIZES = ["100x20", "200x40"], ["structured", "free"], [1e-3, 2e-3, 5e-3]
MATERIALS, LOADS, DEFINITIONS = ["steel", "rubber"], ["traction", "compression", "pressure"], ["paper", "area"]
SCENE = ("beam", "mesh_type", "mesh_size", "material", "load", "definition", "kinematics")
LABELS = {
    "beam": BEAMS,
    "mesh_type": TYPES,
    "mesh_size": SIZES,
    "material": MATERIALS,
    "load": LOADS,
    "definition": DEFINITIONS,
    "kinematics": ["nonlinear", "linear"],
}


def variables(labels, **dimensions):
    """Dataset of distinct numbers over dimensions: each variable counts on where the one before it ended."""
    data, start = xr.Dataset(coords=labels), 1
    for name, dims in dimensions.items():
        shape = [len(labels[dim]) for dim in dims]
        count = int(np.prod(shape))
        data[name] = (dims, 1e-3 * np.arange(start, start + count).reshape(shape))
        start += count
    return data


def root():
    load, mesh = ("beam", "material", "load"), ("beam", "mesh_type", "mesh_size", "material", "load")
    data = variables(
        LABELS, deformation_error=SCENE, field_error=SCENE, stiffness=SCENE, reference_displacement=load, force=load,
        paper_displacement=mesh, paper_reference_displacement=mesh, paper_stiffness=mesh,
        material_young_modulus=("material",), material_poisson_ratio=("material",),
    )  # fmt: skip
    data["beam_length"], data["beam_height"] = ("beam", [0.1, 0.2]), ("beam", [0.02, 0.04])
    return data.assign(status=xr.ones_like(data.deformation_error, dtype=np.int8))


def sensitivity():
    dims = ("beam", "mesh_type", "mesh_size", "material", "load", "kinematics")
    labels = {name: LABELS[name] for name in dims} | {"stiffness_ratio": [0.5, 0.7, 0.9, 1.1]}
    curve = (*dims, "stiffness_ratio")
    data = variables(labels, deformation_error=curve, displacement=curve)
    data["stiffness"] = 1e3 * data.stiffness_ratio.broadcast_like(data.displacement)
    data["best_stiffness"] = data.stiffness.isel(stiffness_ratio=0, drop=True) + 300
    data["predicted_stiffness"] = data.best_stiffness + 50
    return data.assign(status=xr.ones_like(data.displacement, dtype=np.int8))


def fields():
    places = {"particle": range(4), "outline_point": range(5), "spring": range(3), "coordinate": range(2)}
    mesh, load = ("beam", "mesh_type", "mesh_size"), ("material", "load")
    labels = LABELS | places
    data = variables(
        labels, x=(*mesh, "particle"), y=(*mesh, "particle"),
        displacement_x=(*mesh, "definition", *load, "particle"),
        displacement_y=(*mesh, "definition", *load, "particle"),
        outline_x=("beam", "outline_point"), outline_y=("beam", "outline_point"),
        reference_displacement_x=("beam", *load, "outline_point"),
        reference_displacement_y=("beam", *load, "outline_point"),
    )  # fmt: skip
    ends = xr.DataArray([[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]], dims=("end", "spring"))
    shape = data.x.isel(particle=0, drop=True) * 0
    topology = {"cf_role": "mesh_topology", "topology_dimension": 2, "node_coordinates": "x y"}
    topology |= {"edge_node_connectivity": "spring_nodes", "face_node_connectivity": "cell_nodes"}
    corners = xr.DataArray([[0.0, 1.0, 2.0], [1.0, 3.0, 2.0]], dims=("cell", "cell_corner"))
    return data.assign(
        mesh=xr.DataArray(0, attrs=topology),
        spring_nodes=(shape + ends).transpose(*mesh, "spring", "end").rename(end="spring_end"),
        cell_nodes=shape + corners,
    )


def block():
    labels = LABELS | {"face_position": [0.0, 0.5, 1.0], "reference": ["small-strain", "neo-hooke-plane-stress"]}
    data = variables(
        labels, face_profile=(*SCENE, "face_position"),
        reference_face_profile=("beam", "material", "load", "reference", "face_position"),
    )  # fmt: skip
    return data


def moduli():
    labels = {name: LABELS[name] for name in ("mesh_type", "definition", "mesh_size")} | {"poisson_ratio": [0.0, 0.3]}
    data = variables(labels, effective_poisson_ratio=tuple(labels))
    return data.assign(status=xr.ones_like(data.effective_poisson_ratio, dtype=np.int8))


def laying():
    labels = {"loading": ["gravity", "pressure"], "friction": [0.0, 0.3], "definition": DEFINITIONS, "mesh_size": SIZES}
    places = {"corner": range(4), "strip_point": range(5), "reference_point": range(5)}
    cell = ("loading", "friction")
    every = (*cell, "definition", "mesh_size")
    data = variables(
        labels | places, trapezoid_x=("corner",), trapezoid_y=("corner",), strip_x=(*every, "strip_point"),
        strip_y=(*every, "strip_point"), reference_x=(*cell, "reference_point"), reference_y=(*cell, "reference_point"),
        reference_elongation=cell, reference_elongation_error_estimate=cell, area_error=every, elongation=every,
    )  # fmt: skip
    return data.assign(status=xr.ones_like(data.elongation, dtype=np.int8))


def stability():
    labels = {
        "definition": DEFINITIONS, "mesh_size": SIZES, "integrator": ["central-difference", "backward-euler"],
        "damper": ["mass", "springs"], "damping_ratio": [0.0, 0.1], "step_ratio": [0.5, 1.0, 2.0],
        "map_damping_ratio": [0.1, 1.0], "sample": range(5), "critical_ratio": [0.5, 1.0, 2.0],
        "cg_iterations": [5, 0], "implicit_steps": [10, 50], "sliver_angle": [30.0, 5.0], "perturbation": [0.0, 0.2],
        "strain_load": ["axial", "follower-pressure"], "strain": [-0.1, 0.1], "rows": [10, 20], "arch_point": range(4),
    }  # fmt: skip
    scheme = ("definition", "mesh_size", "integrator", "damper", "damping_ratio")
    strained = ("strain_load", "definition", "strain")
    data = variables(
        labels, dt_limit_predicted=scheme, dt_limit_measured=scheme, omega_max=("definition", "mesh_size"),
        dt_particle_bound=("definition", "mesh_size"), behaviour=("integrator", "step_ratio", "map_damping_ratio"),
        step_ratio_predicted=("integrator", "map_damping_ratio"), energy=("integrator", "sample"),
        energy_drift=("integrator",), steps_to_rest=("critical_ratio",),
        truncated_error=("cg_iterations", "implicit_steps", "mesh_size"),
        sliver_step_limit=("definition", "sliver_angle"),
        perturbed_step_limit=("definition", "perturbation"), perturbed_error=("definition", "perturbation"),
        strain_status=strained, negative_pivots=strained, strain_load_share=strained,
        buckling_load=("definition", "rows"), euler_load=("definition",), arch_deflection=("definition", "arch_point"),
        arch_load=("definition", "arch_point"), arch_negative_pivots=("definition", "arch_point"),
    )  # fmt: skip
    data["strain_message"] = xr.full_like(data.strain_status, "", dtype=object)
    data["buckling_message"] = xr.full_like(data.buckling_load, "", dtype=object)
    data.buckling_message[0, 1] = "nothing bifurcates"
    done = ["limits", "maps", "drift", "rest", "slivers", "strains", "buckling"]
    return data.assign_coords(experiment=done)


def benchmark():
    labels = {
        "scene": ["traction", "bending"], "approach": ["delingette/structured", "condensation", "calculix-cps3"],
        "mesh_size": SIZES,
    }  # fmt: skip
    cell = ("scene", "approach", "mesh_size")
    parts = dict.fromkeys([f"{name}_seconds" for name in ("meshing", "assembling", "factorizing", "solving")], cell)
    return variables(
        labels, error=cell, assured_error=cell, seconds=cell, unknowns=cell, **parts,
        reference_error_estimate=("scene",), reference_seconds=("scene",),
    )  # fmt: skip


def engines(factors=()):
    """Two engines at two numbers of iterations and of substeps; of curves with factors on what is typed."""
    labels = {
        "scene": ["sheet", "strip"], "definition": DEFINITIONS, "engine": ["xpbd", "vbd"], "precision": ["float64"],
        "dt": [1 / 60], "substeps": [1, 4], "iterations": [1, 10],
    }  # fmt: skip
    run = (*labels, *(["stiffness_factor"] if factors else []))
    data = variables(labels | ({"stiffness_factor": factors} if factors else {}), error=run, frame_seconds=run)
    data["definition_error"] = ("scene", "definition"), np.full((2, 2), 0.01)
    data["message"] = xr.full_like(data.error, "", dtype=object)
    flags = xr.ones_like(data.error, dtype=np.int8)
    return data.assign(status=flags, engine_status=flags)


def engine_curves():
    data = engines([0.5, 1.0, 2.0])
    best = 1 + data.error.isel(stiffness_factor=0, drop=True)
    return data.assign(best_factor=best, best_factor_message=xr.full_like(best, "", dtype=object))


def samples():
    """Rows of four base samples of two parameters."""
    labels = {"sample": range(16), "load": LOADS, "definition": DEFINITIONS}
    cell = ("sample", "load", "definition")
    data = variables(labels, displacement=cell, deformation_error=cell, height=("sample",), force=("sample",))
    data = data.assign(status=xr.ones_like(data.displacement, dtype=np.int8))
    about = {"design": "sobol-indices", "size": 4, "mesh_type": "structured", "kinematics": "linear"}
    return data.set_coords(["height", "force"]).assign_attrs(about | {"varied": "height force"})


def sobol():
    labels = {"quantity": ["displacement", "deformation_error"], "parameter": ["height", "force"]}
    labels |= {"load": LOADS, "definition": DEFINITIONS}
    names = [f"{order}_order{end}" for order in ("first", "total") for end in ("", "_low", "_high")]
    data = variables(labels, **dict.fromkeys(names, ("quantity", "parameter", "load", "definition")))
    counted = xr.full_like(data.first_order.isel(parameter=0, drop=True), 4, dtype=int)
    return data.assign(base_samples=counted, base_samples_without=0 * counted).assign_attrs(bands="", failures="")


def shapes():
    """Two shapes under one load: of each two quantities, one of which others have computed."""
    labels = {"shape": ["cook", "hole"], "quantity": ["tip", "work"]} | LABELS
    mesh, case = ("shape", "mesh_type", "mesh_size"), ("shape", "material", "load")
    scene, asked = (*mesh, *SCENE[3:]), ("shape", "load", "quantity")
    data = variables(
        labels, error=(*scene, "quantity"), value=(*scene, "quantity"), reference_value=(*case, "quantity"),
        expected_error=(*scene, "quantity"), reference_expected_error=(*case, "quantity"), solve_seconds=scene,
        definition_seconds=scene, particles=mesh,
    )  # fmt: skip
    data["particles"] = 1e3 * data.particles.max() - 1e3 * data.particles
    data["reference_error_estimate"] = xr.full_like(data.reference_value, 1e-5)
    words = {"kind": ["displacement", "energy"], "component": ["y", ""], "of": ["tip", ""], "units": ["m", "J"]}
    for name, texts in words.items():
        data[f"quantity_{name}"] = asked, np.broadcast_to(np.array(texts, dtype=object), (2, len(LOADS), 2)).copy()
    data["status"] = xr.zeros_like(data.solve_seconds, dtype=np.int8)
    data.status.loc[{"load": "traction"}] = 1
    data["message"] = xr.full_like(data.status, "", dtype=object)
    return data.assign(reference_applies=xr.ones_like(data.status.isel(dict.fromkeys(
        ("mesh_type", "mesh_size", "definition"), 0), drop=True)))  # fmt: skip


def shape_fields():
    """A square of each shape, drawn on the free mesh of 1 mm."""
    labels = {"case": ["cook, traction", "hole, traction"], "definition": DEFINITIONS}
    places = {"particle": range(4), "spring": range(3), "outline_point": range(4)}
    drawn = ("case", "definition")
    data = variables(
        labels | places, displacement_x=(*drawn, "particle"), displacement_y=(*drawn, "particle"),
        spring_force=(*drawn, "spring"), reference_displacement_x=("case", "outline_point"),
        reference_displacement_y=("case", "outline_point"),
    )  # fmt: skip
    about = {"shape_name": ["cook", "hole"], "load_name": "traction", "material_name": "steel"}
    about |= {"kinematics_name": "linear", "mesh_type_name": "free"}
    for name, texts in about.items():
        data[name] = "case", np.broadcast_to(np.array(texts, dtype=object), 2).copy()
    square = {"x": [0.0, 0.1, 0.1, 0.0], "y": [0.0, 0.0, 0.1, 0.1]}
    for axis, values in square.items():
        data[axis] = ("case", "particle"), np.array([values, values])
        data[f"outline_{axis}"] = ("case", "outline_point"), np.array([values, values])
    ends = np.array([[0, 1], [1, 2], [2, 3]])
    data["spring_nodes"] = ("case", "spring", "spring_end"), np.array([ends, ends])
    data["case_mesh_size"] = "case", [1e-3, 1e-3]
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
    groups = {"sensitivity": sensitivity, "fields": fields, "block": block, "moduli": moduli, "laying": laying}
    groups |= {"stability": stability, "benchmark": benchmark}
    groups |= {"engines": engines, "engine_curves": engine_curves}
    groups |= {"shapes": shapes, "shape_fields": shape_fields}
    groups |= {"samples": samples, "sobol": sobol}
    # Groups are written and read one by one, so that labels of one need not be those of another.
    return xr.DataTree.from_dict({"/": root()} | {f"/{name}": make() for name, make in groups.items()})


SMALL_AXES = {
    "beam": ("200x40", "100x20"), "mesh_type": ("structured", "free"), "mesh_size": (2e-3, 5e-3),
    "material": ("steel",), "load": ("traction", "bending"), "definition": ("lattice", "patch"),
    "kinematics": ("linear",), "stiffness_ratio": (0.5, 1.0, 1.5),
}  # fmt: skip
"""Labels of a small dataset of scenes and curves."""

HELD = {
    "displacement", "deformation_error", "field_error", "stiffness", "status", "message", "iterations", "residual",
    "solve_seconds", "solver", "material_young_modulus", "beam_length", "beam_height", "beam_thickness", "force",
    "reference_displacement", "best_stiffness", "curve_seconds",
}  # fmt: skip
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
