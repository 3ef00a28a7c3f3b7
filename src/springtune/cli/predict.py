"""Commands without a study: predict, springs for other programs, and identify."""

import logging
import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import PATH, command, file_errors, options

if TYPE_CHECKING:
    from ..handover.net import SpringNet
    from ..scene.boundary_problem import ShapeProblem
    from ..scene.identify import Identified
    from ..scene.measured import MeasuredTest
    from .recommendation import Subject

ENGINE_OPTIONS: options.Options = {
    "engine": {"help": "Engine to calibrate to, such as xpbd."},
    "dt": {"help": "Time that a frame advances, such as 1/60 or '5 ms'.  [default: 1/60]"},
    "substeps": {"type": int, "help": "Steps of a frame.  [default: 1]"},
    "iterations": {"type": int, "help": "Iterations of the engine's solver in a step.  [default: 10]"},
    "precision": {"help": "float64 or float32.  [default: the engine's own]"},
    "force": {"help": "Size of the force of --load on a beam, such as '0.2 N'."},
    "scale": {"type": float, "default": 1.0, "help": "Factor on the load of a shape.  [default: 1]"},
    "definition": {"help": "Definition of the stiffness.  [default: the best]"},
}
"""Options of `predict` that are of engines, as click takes them."""

PROGRESS_SECONDS = 3  # time between two lines on the progress of a search [s]


class Progress(logging.Handler):
    """Prints the progress of a long search every few seconds."""

    def __init__(self) -> None:
        super().__init__()
        self.last = time.monotonic()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, unless the last one is recent."""
        if time.monotonic() - self.last > PROGRESS_SECONDS:
            self.last = time.monotonic()
            click.echo(f"{record.getMessage()} ...", err=True)


def show_progress() -> None:
    """Print the progress of searches."""
    logger = logging.getLogger("springtune")
    logger.setLevel(logging.INFO)
    logger.handlers = [Progress()]


Answer = tuple[str, Callable[[], "SpringNet"]]
"""Text of an answer, and a function that makes the springs that it recommends."""


@command(
    'springtune predict --beam 200x40 --size "2 mm" --material steel',
    'springtune predict --beam 200x40 --error "1 %" --load traction,bending --material steel',
    'springtune predict --beam 200x40 --error "2 %" --material steel --mesh structured,free --springs-alone '
    "--write net.csv",
    'springtune predict --beam 80x10 --mesh free --size "1 mm" --young "3 GPa" --poisson 0.4',
    'springtune predict --beam 80x10 --mesh graded.msh --unit "1 mm" --material rubber',
    'springtune predict --study config/shapes.yaml:cook --load shear --size "2 mm" --material third',
    'springtune predict --study config/shapes.yaml:cook --material third --error "2 %"',
    'springtune predict --engine xpbd --dt 1/60 --substeps 20 --iterations 10 --beam 200x40 --size "13 mm" '
    '--material rubber --density "1000 kg/m^3" --load traction --force "0.2 N"',
)
@options.sheet_options(
    "A mesh type, or a mesh file; with --error mesh types, such as structured,free.  "
    "[default: structured; with --error all]",
    "for the largest stable time steps",
)
@click.option("--error", help="Find the coarsest mesh that stays within this error, such as '1 %'.")
@click.option(
    "--load",
    help="Load case of a shape, by default its only one. Of a beam the loads that count: some of traction, "
    "compression, bending, shear and pressure, such as traction,bending; with --engine the first is calibrated to.  "
    "[default: traction,bending,shear; after the first with --engine all]",
)
@click.option("--springs-alone", is_flag=True, help="Recommend definitions of springs alone, without energies.")
@options.add_options(ENGINE_OPTIONS)
@options.target_option("--write", "Write the springs of what is recommended to a file")
def predict(
    sheet: dict[str, Any], error: str | None, load: str | None, springs_alone: bool, target: Path | None, **engine: Any
) -> None:
    """Recommend a definition for one mesh, with its error under some loads, or find a mesh.

    The network of each definition is solved on the mesh, with linear kinematics, and compared with the converged
    reference of small strain. With --error, meshes are solved from coarse to fine, until a mesh and all finer ones
    tried, up to twice as fine, stay within this error. Errors of a shape are those of the quantities of its load case.

    With --engine, find the factor on the stiffness that an engine needs at a setting, the errors under other loads, and
    the settings that converge. Stiff materials can take many minutes.
    """
    names = None if load is None else [name.strip() for name in load.split(",") if name.strip()]
    show_progress()
    if engine["engine"] is not None:
        text, make = _answer_for_engine(sheet, engine, names or [], springs_alone)
    else:
        body = options.read_body(sheet, load, sized=error is None)
        from ..prediction.choices import USUAL_LOADS  # here, so that a wrong option does not wait for it

        loads = USUAL_LOADS if names is None else names
        under: dict[str, Any] = {"loads": loads} if body.is_beam else {"load": body.load}
        if error is None:
            text, make = _answer_for_mesh(body, under, springs_alone)
        else:
            text, make = _answer_for_error(body, under, springs_alone, error, sheet["mesh"])
    click.echo(text)
    if target is not None:
        from .recommendation import written_text

        net = make()
        with file_errors(f"--write: {target}"):
            click.echo(f"\n{written_text(net, net.write(target))}")


def _shape_problem(body: options.BodyOptions) -> "ShapeProblem":
    from ..scene.boundary_problem import ShapeProblem

    return ShapeProblem(body.body, body.mesh, body.material, str(body.load), 1.0, "linear")


def _subject(body: options.BodyOptions, known: Any) -> "Subject":
    from .recommendation import beam_subject, shape_subject

    return beam_subject(body.body, body.material, known) if body.is_beam else shape_subject(_shape_problem(body), known)


def _answer_for_mesh(body: options.BodyOptions, under: dict[str, Any], springs_alone: bool) -> Answer:
    """Best definition for one mesh."""
    from ..prediction.choices import SOLVED_PARTICLES, predict, references, shape_references
    from .recommendation import prediction_text, recommended

    problem = None if body.is_beam else _shape_problem(body)
    known: Any = shape_references(problem) if problem else references(body.body, body.material, **under)
    mesh = body.mesh if body.is_beam else body.mesh.mesh
    if len(mesh.points) > SOLVED_PARTICLES:
        why = f"has {len(mesh.points)} particles, more than the {SOLVED_PARTICLES} that are solved here"
        raise click.ClickException(f"'{body.mesh_name}' {why}; give a coarser mesh, or make it a mesh of a study")
    found = predict(body.body, body.mesh, body.material, known, **under)
    counts = f"{len(mesh.points)} particles, {len(mesh.edges)} springs"
    found = [choice for choice in found if not (springs_alone and choice.energies)]
    best, _ = recommended(found)
    none = partial(_refuse, "nothing is recommended for this mesh, so nothing is written; take another mesh")
    make = partial(_net, body, definition=best.definition, loads=under.get("loads")) if best else none
    return prediction_text(_subject(body, known), body.mesh_name, counts, found), make


def _answer_for_error(
    body: options.BodyOptions, under: dict[str, Any], springs_alone: bool, error: str, mesh_types: str | None
) -> Answer:
    """Coarsest mesh that keeps an error."""
    from ..mesh.cells import MESH_TYPES
    from ..prediction.search import find_mesh
    from .recommendation import search_text

    if body.is_beam:
        under |= {"mesh_types": [name.strip() for name in (mesh_types or ",".join(MESH_TYPES)).split(",")]}
    elif not body.body.file:
        under |= {"make": partial(body.make, body.mesh_type)}
    search = find_mesh(body.body, body.material, error, **under)
    best = search.best_springs if springs_alone else search.best
    if mesh := best or next(reversed(search.tried), None):
        body = replace(body, mesh_type=mesh.mesh_type, size=mesh.size)
    none = partial(_refuse, f"no mesh keeps {error}, so nothing is written; allow a larger error")
    make = partial(_net, body, definition=best.choice.definition, loads=under.get("loads")) if best else none
    return search_text(_subject(body, search.known), search, springs_alone), make


def _answer_for_engine(sheet: dict[str, Any], asked: dict[str, Any], loads: list[str], springs_alone: bool) -> Answer:
    """Calibration of an engine."""
    from ..engines.base import ENGINES, EngineError, Setting
    from ..engines.calibration import best_runnable_scene, fit_engine
    from ..prediction.choices import USUAL_LOADS
    from ..problem.quantities import choose
    from ..scene.single import Scene
    from .recommendation import fit_text

    engine = choose(ENGINES, asked["engine"], "engine")
    names = ("dt", "substeps", "iterations", "precision")
    setting = Setting(**{name: asked[name] for name in names if asked[name] is not None})
    engine.check(setting)
    load = loads[0] if loads else None
    body = options.read_body(sheet | {"load": load, "force": asked["force"]}, load, further=options.FOR_ENGINE)
    make = partial(Scene, body.body, body.mesh, body.material, str(body.load), asked["force"], scale=asked["scale"])
    if asked["definition"] is None:
        try:
            scene, tried = best_runnable_scene(make, USUAL_LOADS, engine, setting, springs_alone)
        except EngineError as error:  # of no option that was given
            raise click.ClickException(str(error)) from None
    else:
        scene, tried = make(definition=asked["definition"]), ()
    fit = fit_engine(scene, engine.name, setting, loads=loads[1:] or None)
    none = partial(_refuse, f"there is no factor, so nothing is written: {fit.message}; give the setting above")
    return fit_text(fit, body.mesh_name, tried), fit.net if fit.factor == fit.factor else none


def _refuse(why: str) -> "SpringNet":
    raise click.ClickException(f"--write: {why}")


# -- springs for other programs ---------------------------------------------------------------------------------------


@command(
    'springtune springs --beam 200x40 --size "5 mm" --material steel --definition patch --out net.csv',
    'springtune springs --beam 80x10 --mesh graded.msh --unit "1 mm" --material rubber --out net.vtu',
    'springtune springs --beam 200x40 --size "5 mm" --material steel --density "7850 kg/m^3" --load traction '
    '--force "400 kN" --out net.json',
    'springtune springs --study config/shapes.yaml:hole --size "2 mm" --material steel --density "7850 kg/m^3" '
    "--definition lattice --out hole.xml",
)
@options.sheet_options("A mesh type, or a mesh file.", "for masses, and the largest stable time steps", "structured")
@click.option("--definition", default="patch", show_default=True, help="Definition, see `springtune definitions`.")
@click.option("--stiffness", help="Uniform stiffness, such as '170e6 N/m', for definitions that need one.")
@click.option("--load", help="Load of the beam, by default none; or load case of the shape, by default its only one.")
@click.option("--force", help="Size of the force on a beam, such as '400 kN'.")
@click.option("--scale", type=float, default=1.0, show_default=True, help="Factor on the load of a shape.")
@options.target_option("--out", "File to write, replaced if it exists", required=True)
def springs(sheet: dict[str, Any], load: str | None, target: Path, **how: Any) -> None:
    """Write the springs of a mesh to a file: rest lengths, stiffnesses, masses, and energies besides springs.

    The file also has the definition with its formula and source, and the network's errors on this mesh: under traction,
    bending, shear and the given load, or of a shape in the quantities of its load case.
    """
    from ..handover.simulation import EquilibriumWarning
    from .recommendation import written_text

    net = _net(options.read_body(sheet, load), **how)
    every = warnings.catch_warnings(record=True, action="always", category=EquilibriumWarning)
    with file_errors(f"--out: {target}"), every as heard:
        written = net.write(target)
    click.echo(written_text(net, written))
    for one in heard:
        click.echo(str(one.message))


def _net(
    body: options.BodyOptions, loads: Any = None, force: str | None = None, scale: float = 1.0, **how: Any
) -> "SpringNet":
    """Springs of a mesh, with a load if given; `scale` [1] multiplies the load of a shape, `how` has the definition."""
    from ..handover.net import SpringNet
    from ..mechanics.statics import SingularError
    from ..scene.single import Scene

    try:
        if body.load is None or loads:
            how |= {"beam": body.body, "mesh_name": body.mesh_name, "loads": loads}
            return SpringNet.from_mesh(body.mesh, body.material, **how)
        scene = Scene(body.body, body.mesh, body.material, body.load, force, scale=scale, **how)
        return SpringNet.from_scene(scene, body.mesh_name)
    except SingularError as error:  # of the patch test that scales them
        why = f"'{how['definition']}' has no springs on this mesh: {error}; take another"
        raise click.ClickException(f"--definition: {why}") from None


# -- materials from tests ----------------------------------------------------------------------------------------------

TEST_KEYS = ("beam", "thickness", "study", "load", "force", "angle", "shift", "file")
"""Keys of a test in a list of tests; all but the file are options, too."""


@command(
    "springtune identify pull.csv --beam 100x20 --load traction",
    'springtune identify dic.csv --beam 100x20 --load traction --force "400 N"',
    "springtune identify tests.yaml --law orthotropic",
)
@click.argument("files", nargs=-1, required=True, type=PATH)
@click.option("--law", default="isotropic", show_default=True, help="isotropic, orthotropic, regions.")
@click.option("--known", multiple=True, help="A constant that is known, such as nu=0.3; may be repeated.")
@options.add_options(options.BODY_OPTIONS)
@click.option("--load", help="Load of the beam, or load case of the shape: what is held and which side is loaded.")
@click.option("--force", help="Force on a beam at which a field was measured, such as '400 N'.")
@click.option("--angle", default="0 deg", help="Angle of the material's first axis from x.")
@click.option("--shift/--no-shift", default=True, help="Remove the rigid motion of fields, and the zero of curves.")
def identify(files: tuple[Path, ...], law: str, known: tuple[str, ...], **test: Any) -> None:
    """Find a material's constants from measured tests of a sheet, with 95 % intervals.

    FILES are CSV files of one test, or YAML files with a list of tests, whose keys are the options and 'file'. Columns
    have units in their heads, such as 'force [N],displacement [mm]' or 'x [mm],y [mm],u [um],v [um]'.
    """
    from ..scene.identify import identify as identified

    rows = [test | row for path in files for row in _rows(path)]
    given = {name: value for name, _, value in (one.partition("=") for one in known)}
    found = identified([_test(**row) for row in rows], law, known=given)
    click.echo(f"{found}\n\nin a study:\n{_materials(found)}", nl=False)


def _rows(path: Path) -> list[dict[str, Any]]:
    """Return the options of each test: one test of a CSV file, or several in a YAML file."""
    from yaml import YAMLError, safe_load

    from ..safe_io import LARGEST_CSV, read

    if path.suffix not in (".yaml", ".yml"):
        return [{"file": path}]
    try:
        rows = [dict(row) for row in safe_load(read(path, LARGEST_CSV))["tests"].values()]
    except (AttributeError, KeyError, TypeError, ValueError, YAMLError) as error:
        remedy = f"give 'tests:' and names, each with some of the keys {', '.join(TEST_KEYS)}"
        raise ValueError(f"{path}: is no list of tests ({type(error).__name__}: {error}); {remedy}") from None
    for row in rows:
        if wrong := [key for key in row if key not in TEST_KEYS]:
            raise ValueError(f"{path}: a test has the key {wrong[0]!r}; known: {', '.join(TEST_KEYS)}")
        row |= {key: path.parent / row[key] for key in ("file", "study") if row.get(key)}
    return rows


def _test(
    beam: str | None, study: str | None, thickness: str, load: str, file: Path | None = None, **others: Any
) -> "MeasuredTest":
    """Make a test from its options."""
    from ..scene.measured import MeasuredTest

    if not ((beam or study) and load and file):
        raise ValueError("load: a test needs a body, a load and a file; give such as --beam 100x20 --load traction")
    if beam:
        return MeasuredTest(options.read_beam(str(beam), thickness), load, file, **others)
    about, _, body = options.shape_of_study(str(study))
    if about.plane_strain:
        why = f"material {about.plane_strain[0]!r} is in plane strain, and tests are analysed in plane stress"
        raise ValueError(f"study: {study}: {why}; give a study in plane stress")
    return MeasuredTest(body, load, file, **others)


def _materials(found: "Identified") -> str:
    """Identified materials as a section of a study."""
    from yaml import safe_dump

    texts = [round(one, 6) if name[:2] == "nu" else f"{one:.6g} Pa" for name, one in found.values.items()]
    if found.law == "orthotropic":
        keys = ("young_modulus_x", "young_modulus_y", "poisson_ratio_xy", "shear_modulus")
        materials = [dict(zip(keys, texts))]
    else:
        materials = [{"young_modulus": text, "poisson_ratio": texts[-1]} for text in texts[:-1]]
    names = [one.name for one in found.materials.values()]
    return safe_dump({"materials": dict(zip(names, materials))}, sort_keys=False)
