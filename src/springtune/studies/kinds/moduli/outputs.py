"""Figures, table and browse view that compare definitions."""

from ...config.kind import Output


def _figures(study):
    mesh_types = dict.fromkeys(scene.mesh.mesh_type for scene in study.scenes)
    return {"definitions_moduli": {}} | {f"definitions_loads_{name}": {"mesh_type": name} for name in mesh_types}


def _lack(study):
    return "" if study.parts["moduli"] else "compares moduli and no grid has them; add 'moduli: true' to a grid"


OUTPUTS = (
    Output(
        "definitions",
        "comparison of definitions",
        figures=_figures,
        plot="studies.kinds.moduli.figures:definitions",
        lack=_lack,
    ),
)


MESH_SIZES_OVER_HEIGHT = {0.05: "up to 0.05", 0.1: "0.05 to 0.1", float("inf"): "above 0.1"}
"""Largest mesh sizes over the height of the beam [1] of fine, middle and coarse meshes, and their texts."""

TABLE_NOTE = (
    "Lowest and highest deformation error over beams and mesh sizes. Beyond small strain a reference does not apply, "
    "and the error is not the network's alone."
)


def tables(tree):
    """Make the table of error ranges by definition, mesh type, material, load and mesh size."""
    import pandas as pd  # here, since a plan does without it and xarray

    from ...output.dataset import most_requested, unswept

    if "moduli" not in tree or "deformation_error" not in tree:
        return []
    root = unswept(tree.to_dataset())
    root = root.sel(kinematics=most_requested(root, "kinematics"))
    place = ["definition", "mesh_type", "material", "load"]
    cells = root[["deformation_error", "status", "reference_applies"]].assign(ratio=root.mesh_size / root.beam_height)
    frame = cells.to_dataframe([*place, "beam", "mesh_size"]).reset_index()
    frame = frame[frame.status != 0]
    ends = [0.0, *(end * (1 + 1e-9) for end in MESH_SIZES_OVER_HEIGHT)]
    frame["mesh_size_over_height"] = pd.cut(frame.ratio, ends, labels=[*MESH_SIZES_OVER_HEIGHT.values()]).astype(str)
    frame["solved"] = frame.status == 1
    frame["beyond"] = frame.solved & (frame.reference_applies == 0)
    frame["error"] = 100 * frame.deformation_error.where(frame.solved)
    ranges = frame.groupby([*place, "mesh_size_over_height"], sort=False).agg(
        scenes=("solved", "size"),
        solved=("solved", "sum"),
        beyond_small_strain=("beyond", "sum"),
        lowest_error_percent=("error", "min"),
        highest_error_percent=("error", "max"),
    )
    rows = ranges.reset_index().to_dict("records")
    return [{"stem": "definitions", "title": "Definitions compared", "note": TABLE_NOTE, "rows": rows}]
