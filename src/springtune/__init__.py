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

TYPE_CHECKING = False
"""What type checkers take for true; `typing` itself takes longer to import than all that is here."""

__version__ = "0.1.0"

_NAMES = {
    "mesh": ("MESH_TYPES", "Mesh", "MeshError"),
    "output.reading": ("open",),
    "prediction": ("Choice", "predict"),
    "problem.geometry": ("Beam",),
    "problem.loads": ("LOADS",),
    "problem.materials": ("Material",),
    "problem.status": ("Status",),
    "scene.curve": ("Curve", "sensitivity"),
    "scene.meshes": ("make_mesh", "read_mesh"),
    "scene.moduli": ("Moduli", "moduli"),
    "scene.single": ("Result", "Scene"),
    "springs": ("DEFINITIONS", "Definition", "DefinitionError", "Springs"),
    "units": ("UnitError",),
}
"""Public names by the module that has them; a figure is added by a row of its module."""

_PLACES = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [
    "DEFINITIONS",
    "LOADS",
    "MESH_TYPES",
    "Beam",
    "Choice",
    "Curve",
    "Definition",
    "DefinitionError",
    "Material",
    "Mesh",
    "MeshError",
    "Moduli",
    "Result",
    "Scene",
    "Springs",
    "Status",
    "UnitError",
    "__version__",
    "make_mesh",
    "moduli",
    "open",
    "predict",
    "read_mesh",
    "sensitivity",
]


def __getattr__(name: str):
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f".{_PLACES[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)


if TYPE_CHECKING:
    from .mesh import MESH_TYPES, Mesh, MeshError
    from .output.reading import open
    from .prediction import Choice, predict
    from .problem.geometry import Beam
    from .problem.loads import LOADS
    from .problem.materials import Material
    from .problem.status import Status
    from .scene.curve import Curve, sensitivity
    from .scene.meshes import make_mesh, read_mesh
    from .scene.moduli import Moduli, moduli
    from .scene.single import Result, Scene
    from .springs import DEFINITIONS, Definition, DefinitionError, Springs
    from .units import UnitError
