"""Types of the public names, for checkers and editors; `__init__.py` imports each when it is first asked for."""

from .kinds import load_study as load_study
from .kinds.benchmark.figures import plot_benchmark as plot_benchmark
from .kinds.benchmark.figures import plot_benchmark_costs as plot_benchmark_costs
from .kinds.benchmark.figures import plot_benchmark_curve as plot_benchmark_curve
from .kinds.benchmark.figures import plot_benchmark_rates as plot_benchmark_rates
from .kinds.laying.figures import plot_laying as plot_laying
from .kinds.moduli.figures import plot_definitions_loads as plot_definitions_loads
from .kinds.moduli.figures import plot_definitions_size as plot_definitions_size
from .kinds.moduli.figures import plot_moduli as plot_moduli
from .kinds.samples.figures import plot_effects as plot_effects
from .kinds.samples.figures import plot_sobol as plot_sobol
from .kinds.scenes.figures import plot_block as plot_block
from .kinds.scenes.figures import plot_deformed as plot_deformed
from .kinds.scenes.figures import plot_sensitivity as plot_sensitivity
from .kinds.scenes.figures import plot_size as plot_size
from .kinds.stability.figures import plot_stability_buckling as plot_stability_buckling
from .kinds.stability.figures import plot_stability_energy as plot_stability_energy
from .kinds.stability.figures import plot_stability_limits as plot_stability_limits
from .kinds.stability.figures import plot_stability_maps as plot_stability_maps
from .kinds.stability.figures import plot_stability_meshes as plot_stability_meshes
from .kinds.stability.figures import plot_stability_rest as plot_stability_rest
from .kinds.stability.figures import plot_stability_strains as plot_stability_strains
from .mesh import MESH_TYPES as MESH_TYPES
from .mesh import Mesh as Mesh
from .mesh import MeshError as MeshError
from .mesh import mesh_type as mesh_type
from .output.reading import field as field
from .output.reading import open as open
from .prediction import Choice as Choice
from .prediction import predict as predict
from .problem.geometry import Beam as Beam
from .problem.loads import LOADS as LOADS
from .problem.materials import Material as Material
from .problem.status import Status as Status
from .scene.curve import Curve as Curve
from .scene.curve import sensitivity as sensitivity
from .scene.meshes import make_mesh as make_mesh
from .scene.meshes import read_mesh as read_mesh
from .scene.moduli import Moduli as Moduli
from .scene.moduli import moduli as moduli
from .scene.single import Result as Result
from .scene.single import Scene as Scene
from .springs import DEFINITIONS as DEFINITIONS
from .springs import Definition as Definition
from .springs import DefinitionError as DefinitionError
from .springs import Springs as Springs
from .springs import definition as definition
from .study.messages import StudyError as StudyError
from .units import UnitError as UnitError

__all__: list[str]
__version__: str
