"""Experiments on numerical stability: a study's section ``stability``."""

from math import nan
from typing import Annotated

from pydantic import Field

from springtune.mechanics.integrators import BEHAVIOURS
from springtune.mesh.types import MESH_TYPES

from ...config import fields
from ...config.checks import check_able, check_beam_material, check_density, check_particles
from ...config.fields import OneOrMore, Section, default, one_of, optional
from ...config.kind import Stage, StudyKind
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key
from ...runs.plan import Task
from . import AXES, DEFINITION_FREE, EXPERIMENTS
from .outputs import OUTPUTS, STABILITY_TABLES

ExperimentName = Annotated[str, *one_of("experiment", EXPERIMENTS)]


class StabilityConfig(Section):
    """Experiments on numerical stability of a beam in traction."""

    beam: fields.BeamName
    """Beam."""

    material: fields.MaterialName
    """Material, with a density."""

    force: fields.Force
    """Traction on the right end."""

    definition: fields.DefinitionNames
    """Definitions that derive a stiffness without a reference. Some experiments use only the first."""

    mesh_type: fields.MeshType = default("structured")
    """Mesh type of triangles."""

    mesh_size: OneOrMore[fields.Length]
    """Lengths of edges; most experiments use the coarsest."""

    experiment: OneOrMore[ExperimentName] = Field(
        list(EXPERIMENTS),
        description="; ".join(f"`{name}`: {text}" for name, text in EXPERIMENTS.items()) + ". All by default.",
    )


def _check(config, problems):
    section = config.stability
    check_beam_material(problems, ("stability", "material"), section.material, config)
    check_density(config, section.material, ("stability", "material"), problems)
    check_able(problems, ("stability", "definition"), section.definition, ["structured"])
    made = [name for name, one in MESH_TYPES.items() if one.corners == 3]
    if section.mesh_type not in made:
        message = f"'{section.mesh_type}' is no mesh type of triangles that is made; choose of {', '.join(made)}"
        problems.add(("stability", "mesh_type"), message)
    extent = config.beams[section.beam].length, config.beams[section.beam].height
    check_particles(problems, ("stability", "mesh_size"), section.mesh_size, *extent)
    if (largest := max(section.mesh_size)) > 0.3 * min(extent):
        message = f"{1e3 * largest:g} mm leaves few particles inside; give at most {300 * min(extent):g} mm"
        problems.add(("stability", "mesh_size"), message)


def _expand(config, declared):
    """Values of each experiment and definition; some experiments need only the first definition."""
    section = config.stability
    shared = {
        "beam": beam_key(declared.beams[section.beam]),
        "material": material_key(declared.materials[section.material], density=True),
        "force": section.force,
        "mesh_type": section.mesh_type,
        "mesh_sizes": sorted(section.mesh_size),
    }
    names = [name for name in EXPERIMENTS if name in section.experiment]
    pairs = [(name, one) for name in names for one in section.definition[: 1 if name in DEFINITION_FREE else None]]
    return {pair: shared | dict(zip(("name", "definition"), pair)) for pair in pairs}


def _tables(study):
    asked = {name for name, _ in study.parts["stability"]}
    return [f"stability_{name}" for name in STABILITY_TABLES if name in asked]


def _axes(experiments):
    names, definitions = (tuple(dict.fromkeys(found)) for found in zip(*experiments))
    sizes = next(iter(experiments.values()))["mesh_sizes"]
    return AXES | {"definition": set(definitions), "mesh_size": set(sizes), "experiment": names}


def _tasks(study):
    for (name, definition), values in study.parts["stability"].items():
        also = mesh_type_key(values["mesh_type"]), definition_key(definition)
        yield Task(values, also, {"experiment": name, "definition": definition}, seconds=3.0)


SCHEME = ("definition", "mesh_size", "integrator", "damper", "damping_ratio")
SLIVER = ("definition", "sliver_angle")
CONTRAST = ("stiffness_contrast",)
POISSON = ("definition", "stressed_poisson_ratio")
STRAIN = ("definition", "strain_load", "strain")
PERTURBATION = ("definition", "perturbation")
ARCH = ("definition", "arch_point")
COLUMN = ("definition", "rows")
DEFINITION = ("definition",)


def _status_variables(name, dimensions, long_name):
    """Status and message of an experiment."""
    return {
        f"{name}_status": (dimensions, "1", f"what became of {long_name}", 0),
        f"{name}_message": (dimensions, "1", f"why it is not solved: {long_name}", ""),
    }


EXPERIMENT_VARIABLES = {
    "dt_limit_predicted": (SCHEME, "s", "largest stable step, predicted", nan),
    "dt_limit_measured": (SCHEME, "s", "largest step that does not grow noise, by bisection of runs", nan),
    "dt_particle_bound": (("definition", "mesh_size"), "s", "safe step from each particle's springs alone", nan),
    "omega_max": (("definition", "mesh_size"), "rad/s", "highest frequency at rest", nan),
    "behaviour": (("integrator", "step_ratio", "map_damping_ratio"), "1", "what a run makes of noise", -1),
    "step_ratio_predicted": (
        ("integrator", "map_damping_ratio"),
        "1",
        "largest stable step over 2 / omega_max, predicted; 1000 where there is none",
        nan,
    ),
    "energy_drift": (("integrator",), "1", "mean energy of the last tenth of a run over that of the first", nan),
    "energy_swing": (("integrator",), "1", "largest less smallest energy of a run over the first", nan),
    "energy": (("integrator", "sample"), "1", "energy over that at the start, undamped", nan),
    "momentum_drift": (("integrator",), "1", "change of momentum over the sum of its parts", nan),
    "steps_to_rest": (("critical_ratio",), "1", "steps to rest within 0.1 %, central difference", nan),
    "loaded_frequency": ((), "rad/s", "lowest frequency that the load excites", nan),
    "truncated_error": (
        ("mesh_size", "cg_iterations", "implicit_steps"),
        "1",
        "distance of backward Euler from the static solution over its largest displacement",
        nan,
    ),
    "relaxation_error": (("mesh_size",), "1", "distance of dynamic relaxation from the static solution", nan),
    "relaxation_steps": (("mesh_size",), "1", "steps of dynamic relaxation", nan),
    **_status_variables("sliver", SLIVER, "a mesh with a sliver"),
    "sliver_negative_pivots": (SLIVER, "1", "negative pivots of the tangent with a sliver", nan),
    "sliver_step_limit": (SLIVER, "s", "largest stable step with a sliver", nan),
    "sliver_error": (SLIVER, "1", "displacement with a sliver over that without, less 1", nan),
    **_status_variables("contrast", CONTRAST, "a network with stiff and soft parts"),
    "contrast_negative_pivots": (CONTRAST, "1", "negative pivots of the tangent with a contrast", nan),
    "contrast_error": (CONTRAST, "1", "error of the linear solution, against extended precision", nan),
    "contrast_estimate": (CONTRAST, "1", "its estimate, by which it is judged", nan),
    **_status_variables("poisson", POISSON, "a material near the incompressible one"),
    "poisson_negative_pivots": (POISSON, "1", "negative pivots of the tangent", nan),
    "poisson_modulus_error": (POISSON, "1", "error of Young's modulus along x", nan),
    "poisson_step_limit": (POISSON, "s", "largest stable step", nan),
    "scaled_step_limit": (("scale",), "s/m", "largest stable step over the mesh size", nan),
    "precision_error": (("scale", "precision"), "1", "error of a run to rest, against the static solution", nan),
    **_status_variables("strain", STRAIN, "a large strain"),
    "negative_pivots": (STRAIN, "1", "negative pivots of the tangent; 0 where the equilibrium is stable", nan),
    "strain_displacement": (STRAIN, "m", "mean displacement of the loaded side along the force", nan),
    "strain_load_share": (STRAIN, "1", "largest share of the load with a good equilibrium", nan),
    **_status_variables("perturbed", PERTURBATION, "a mesh with particles moved"),
    "perturbed_negative_pivots": (PERTURBATION, "1", "negative pivots of the tangent", nan),
    "perturbed_error": (PERTURBATION, "1", "displacement with particles moved over that without, less 1", nan),
    "perturbed_step_limit": (PERTURBATION, "s", "largest stable step with particles moved", nan),
    "inverted_starts_right": (DEFINITION, "1", "share of inverted starts that end in the right solution", nan),
    "inverted_starts_wrong": (DEFINITION, "1", "share of inverted starts that end as solved elsewhere", nan),
    "buckling_load": (COLUMN, "N", "buckling load of a column twenty times as long as high", nan),
    "buckling_message": (COLUMN, "1", "what restricts the buckling load, or why there is none", ""),
    "euler_load": (DEFINITION, "N", "its load by Euler", nan),
    "arch_load": (ARCH, "N", "force on the middle of a shallow arch along its path", nan),
    "arch_deflection": (ARCH, "m", "its deflection", nan),
    "arch_negative_pivots": (ARCH, "1", "negative pivots of the tangent there", nan),
    "experiment_seconds": (("experiment", "definition"), "s", "time of an experiment", nan),
    "experiment_message": (("experiment", "definition"), "1", "why an experiment has no results", ""),
}

EXPERIMENT_DIMENSIONS: dict[str, str | tuple[str, str]] = {
    "integrator": "time integrator",
    "damper": "damping in proportion to mass, or of dampers along springs",
    "damping_ratio": "damping ratio of the highest mode",
    "step_ratio": "time step over 2 / omega_max",
    "map_damping_ratio": "damping ratio of the highest mode, damping in proportion to mass",
    "sample": "number of the sample in time",
    "critical_ratio": "damping over that critical for the lowest loaded mode",
    "cg_iterations": "conjugate-gradient iterations a step of backward Euler; 0 is a direct solver",
    "implicit_steps": "steps of backward Euler",
    "sliver_angle": ("smallest angle of the drawn triangle", "degree"),
    "stiffness_contrast": "stiffness of the stiff parts over that of the soft ones",
    "stressed_poisson_ratio": "Poisson's ratio",
    "scale": ("length of an edge of the scaled beam", "m"),
    "precision": "floating-point numbers of an explicit run",
    "strain_load": "axial load, or a follower pressure on a long face, its force taken for the strain",
    "strain": "force over E t times the loaded side",
    "perturbation": "largest move of an inner particle over the mesh size",
    "rows": "triangles over the height of the column",
    "arch_point": "point of the arch's path",
    "experiment": "experiment on stability",
}


KIND = StudyKind(
    "stability",
    study_fields={"stability": optional(StabilityConfig, "Experiments on numerical stability: group `/stability`.")},
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=lambda part: [["experiments", len(part), "on numerical stability"]],
    variables=EXPERIMENT_VARIABLES,
    dimensions=EXPERIMENT_DIMENSIONS,
    flags={"behaviour": BEHAVIOURS},
    sparse=True,
    stages=(Stage("stability", "studies.kinds.stability.solve", _tasks),),
    outputs=OUTPUTS,
    tables=_tables,
)
