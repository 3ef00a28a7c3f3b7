"""Which figures a study has, and the labels that each of them selects."""

SENSITIVITY = ("beam", "mesh_type", "material", "load")
SIZE = DEFORMED = ("mesh_type", "material", "load")

FORMATS = ("png", "pdf")


def selections(kind, labels, cells):
    """Distinct selections of the dataset's cells, in order, and the stem of each one's file.

    Parameters
    ----------
    kind : str
        First part of the stem: ``sensitivity``, ``size`` or ``deformed``.
    labels : tuple of str
        Dimensions that a figure selects.
    cells : iterable of dict
        Labels of each cell that the study asks for.

    Returns
    -------
    dict of str to dict
        Selection by stem.
    """
    found = {}
    for cell in cells:
        chosen = {label: cell[label] for label in labels}
        found.setdefault("_".join([kind, *chosen.values()]), chosen)
    return found


def of_study(study):
    """Selections by kind of figure.

    Parameters
    ----------
    study : Study

    Returns
    -------
    dict of str to dict
        ``sensitivity``, ``size``, ``deformed``, ``definitions``, ``block``, ``laying``, ``stability`` and
        ``benchmark``, each a dict of selections by stem; empty where the study does not ask for the kind.
    """
    curves = [_labels(curve) for curve in study.curves if curve.kinematics == "nonlinear"]
    scenes = [_labels(scene) for scene in study.scenes if scene.kinematics == "nonlinear"]
    every = {
        "sensitivity": selections("sensitivity", SENSITIVITY, curves),
        "size": selections("size", SIZE, scenes),
        "deformed": selections("deformed", DEFORMED, scenes),
        "definitions": definitions(study.axes["load"], study.axes["mesh_type"]),
        "block": {"block": {}},
        "laying": {"laying": {}},
        "stability": stability(study),
        "benchmark": {stem: {} for stem in benchmark(study.axes.get("scene", ()))},
    }
    return {kind: chosen if kind in study.outputs else {} for kind, chosen in every.items()}


def definitions(loads, mesh_types):
    """Selections of the figures that compare definitions: moduli, errors against size by load, and heat maps."""
    found = {"definitions_moduli": {}}
    found |= {f"definitions_size_{load}": {"load": load} for load in loads}
    return found | {f"definitions_loads_{mesh_type}": {"mesh_type": mesh_type} for mesh_type in mesh_types}


STABILITY = {
    "stability_limits": "limits",
    "stability_maps": "maps",
    "stability_energy": "drift",
    "stability_rest": "rest",
    "stability_meshes": "slivers",
    "stability_strains": "strains",
    "stability_buckling": "buckling",
}
"""Figures of the experiments on stability and the one that each needs."""


def benchmark(scenes):
    """Stems of the figures of the benchmark."""
    return [*(f"benchmark_{scene}" for scene in scenes), "benchmark_rates", "benchmark_costs", "benchmark_curve"]


def stability(study):
    """Selections of the figures of the experiments on stability."""
    done = {one.name for one in study.parts["stability"]}
    return {stem: {} for stem, experiment in STABILITY.items() if experiment in done}


def _labels(item):
    beam, mesh_type = item.mesh.beam.name, item.mesh.mesh_type
    return {"beam": beam, "mesh_type": mesh_type, "material": item.material.name, "load": item.load}
