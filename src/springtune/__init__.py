"""springtune: which stiffness to give the springs of a 2-D mass-spring model, and how far off it then is.

Names are imported when they are first asked for: ``import springtune`` costs nothing, not even numpy.

Examples
--------
>>> import springtune as st
>>> beam, steel = st.Beam("200 mm", "40 mm", thickness="1 mm"), st.Material("210 GPa", 0.3)
>>> mesh = st.make_mesh(beam, "structured", "5 mm")
>>> result = st.Scene(beam, mesh, steel, "traction", "400 kN", definition="patch").solve()
>>> print(f"{result.status}: {1e3 * result.displacement:.2f} mm, error {100 * result.error:+.1f} %")
solved: 9.51 mm, error +0.1 %
"""

__version__ = "0.1.0"

_NAMES = {
    "engines.base": ("ENGINES", "Engine", "EngineError", "Setting", "engine"),
    "engines.calibration": ("EngineFit", "LoadBand", "NeededSetting", "fit_engine"),
    "engines.run": ("EngineResult", "in_engine"),
    "handover.net": ("SpringNet",),
    "studies.kinds": ("load_study",),
    "studies.kinds.benchmark.figures": ("plot_benchmark",),
    "studies.kinds.engines.figures": ("plot_engine_curves", "plot_engine_errors"),
    "studies.kinds.laying.figures": ("plot_laying",),
    "studies.kinds.moduli.figures": ("plot_definitions_loads", "plot_moduli"),
    "studies.kinds.samples.figures": ("plot_sobol",),
    "studies.kinds.bodies.beam_figures": ("plot_block", "plot_deformed", "plot_sensitivity", "plot_size", "plot_sweep"),
    "studies.kinds.bodies.shape_figures": ("plot_shape", "plot_shape_errors", "plot_shapes"),
    "studies.kinds.stability.figures": ("plot_stability_maps", "plot_stability_strains"),
    "mesh.cells": ("MESH_TYPES", "Mesh", "MeshError", "mesh_type"),
    "mesh.sheets": ("GroupedMesh",),
    "studies.output.reading": ("field", "open"),
    "studies.output.summary": ("info",),
    "prediction.choices": ("Choice", "predict"),
    "prediction.search": ("MeshChoice", "MeshSearch", "SolvedMesh", "find_mesh"),
    "problem.loads": ("LOADS",),
    "problem.materials": ("AnisotropicMaterial", "Material", "Rubber", "fit_rubber"),
    "problem.shapes": ("Beam", "Hole", "LoadCase", "Pressure", "Quantity", "Segment", "Shape", "Support", "Traction"),
    "problem.quantities": ("Status",),
    "scene.curve": ("Curve", "sensitivity"),
    "scene.identify": ("Identified", "identify"),
    "scene.measured": ("MeasuredTest",),
    "scene.sheet": ("BestSprings", "Moduli", "best_springs", "moduli"),
    "scene.single": ("Result", "Scene", "make_mesh", "mesh_shape", "read_mesh", "read_shape"),
    "springs.base": ("DEFINITIONS", "Definition", "DefinitionError", "Springs", "definition"),
    "studies.config.messages": ("StudyError",),
    "units": ("UnitError",),
}
"""Public names by the module that has them; a figure is added by a row of its module."""

_PLACES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = ["__version__", *sorted(_PLACES)]  # noqa: PLE0604


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .registry import import_name

    return import_name(f"{_PLACES[name]}:{name}")


def __dir__() -> list[str]:
    return sorted(__all__)
