"""Write the springs of a mesh for other programs."""

import re
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import examples
from .options import (
    SPRING_FILES,
    SheetOptions,
    Unmet,
    check_kind,
    check_target,
    names_from,
    refusals,
    sheet_options,
)

if TYPE_CHECKING:
    from ..handover.net import SpringNet
    from ..problem.geometry import Beam
    from ..problem.materials import Material
    from .options import AskedShape

OPTIONS = re.compile(r"^(?=(load|force|scale|definition|stiffness|density|mujoco)\b)")
"""Begin of messages with the name of an argument, which is an option here."""


def _definitions() -> Iterable[str]:
    from .. import DEFINITIONS

    return DEFINITIONS


def _loads() -> Iterable[str]:
    from ..problem.loads import LOADS

    return LOADS


@click.command(
    epilog=examples(
        'springtune springs --beam 200x40 --size "5 mm" --material steel --definition patch --out net.csv',
        'springtune springs --beam 80x10 --mesh graded.msh --unit "1 mm" --material rubber --out net.vtu',
        'springtune springs --beam 200x40 --size "5 mm" --material steel --density "7850 kg/m^3" --load traction '
        '--force "400 kN" --out net.json',
        'springtune springs --shape config/shapes.yaml:hole --size "2 mm" --material steel --density "7850 kg/m^3" '
        "--definition lattice --out hole.xml",
    )
)
@sheet_options("A mesh type, or a mesh file.", "for masses, and the largest stable time steps", "structured")
@click.option(
    "--definition",
    default="patch",
    show_default=True,
    shell_complete=names_from(_definitions),
    help="Rule for the stiffness; `springtune definitions` lists them, `springtune predict` recommends one.",
)
@click.option("--stiffness", help="Uniform stiffness, such as '170e6 N/m', for definitions that are told one.")
@click.option(
    "--load",
    shell_complete=names_from(_loads),
    help="What holds and pulls the beam, nothing without; or a shape, its only load without.",
)
@click.option("--force", help="Size of the force on a beam, such as '400 kN'.")
@click.option("--scale", type=float, default=1.0, show_default=True, help="Factor on the load of a shape.")
@click.option(
    "--mujoco",
    type=int,
    help="Version of MuJoCo that .xml is for: 3, or 4, the newest, without. Springs alone are the same in both.",
)
@click.option(
    "--out",
    "target",
    required=True,
    type=click.Path(path_type=Path),
    help=f"File: {SPRING_FILES}; one that is there is replaced.",
)
def springs(
    sheet: SheetOptions,
    definition: str,
    stiffness: str | None,
    load: str | None,
    force: str | None,
    scale: float,
    mujoco: int | None,
    target: Path,
) -> None:
    """Write the springs of a mesh: their rest lengths and stiffnesses, masses, and energies besides them.

    The file says what its numbers are: definition, formula and source, and how far off the network is under traction,
    bending, shear and the load that is given, solved on this very mesh; of a shape in the quantities that its load case
    asks for.
    """
    from ..handover.simulation import EquilibriumWarning

    with refusals("--out", target, partial(OPTIONS.sub, "--", count=1)):
        check_kind(sheet.shape, sheet.beam, ("scale",))
        check_target("--out", target)
        if sheet.shape is not None:
            net = net_of_shape(sheet.asked_shape(load), definition, scale, stiffness)
        else:
            beam, solid = sheet.asked_beam()
            edge = sheet.edge(beam)
            net = _net(beam, solid, sheet.mesh(beam, edge), sheet.mesh_name(edge), definition, stiffness, load, force)
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always", EquilibriumWarning)
            written = net.write(target, mujoco=mujoco)
    click.echo(written_text(net, written, mujoco))
    for one in heard:
        click.echo(str(one.message))


@contextmanager
def _derived(definition: str) -> Iterator[None]:
    """Context in which springs are derived; a patch test that scales them may be singular."""
    from ..mechanics.statics import SingularError

    try:
        yield
    except SingularError as error:
        raise Unmet(f"--definition: '{definition}' has no springs on this mesh: {error}; take another") from None


def _net(
    beam: "Beam",
    material: "Material",
    mesh: Any,
    name: str,
    definition: str,
    stiffness: str | None,
    load: str | None,
    force: str | None,
) -> "SpringNet":
    from ..handover.net import SpringNet
    from ..scene.single import Scene

    if (load is None) != (force is None):
        if load is None:
            raise ValueError(f"--force: '{force}' is of no load; give --load such as traction, or leave --force out")
        raise ValueError(f"--force: missing; give the size of the force of --load {load}, such as '400 kN'")
    with _derived(definition):
        if load is None or force is None:
            return SpringNet.from_mesh(mesh, material, definition, beam=beam, stiffness=stiffness, mesh_name=name)
        scene = Scene(beam, mesh, material, load, force, definition=definition, stiffness=stiffness)
        return SpringNet.from_scene(scene, name)


def net_of_shape(asked: "AskedShape", definition: str, scale: float = 1.0, stiffness: str | None = None) -> "SpringNet":
    """Springs of a shape under its load case; `scale` [1] is a factor on the load."""
    from ..handover.net import SpringNet
    from ..scene.single import Scene

    if any(one.x or one.y for one in asked.shape.loads[asked.load].supports):
        raise ValueError(
            f"--load: '{asked.load}' of shape '{asked.shape.name}' moves a support, and files of springs have forces "
            "and directions that are held; give a load of forces"
        )
    scene = Scene(
        asked.shape,
        asked.mesh(),
        asked.materials,
        asked.load,
        definition=definition,
        stiffness=stiffness,
        scale=scale,
    )
    with _derived(definition):
        return SpringNet.from_scene(scene, asked.mesh_name)


def written_text(net: "SpringNet", written: "Iterable[Path]", mujoco: int | None = None) -> str:
    """Written files and their expected errors, as text."""
    from ..handover.formats import for_mujoco
    from ..handover.mujoco import for_versions

    header = net.header
    first, *others = written
    besides = [f"{terms.kind} terms of {len(terms.cells)} cells" for terms in net.energies]
    springs = f"{len(net.springs)} springs" if net.stiffness.any() else f"{len(net.springs)} edges with no own springs"
    counts = [f"{len(net.points)} particles", springs, *besides]
    lines = [f"{first}: {', '.join(counts)} of definition {header['definition']}"]
    lines += [f"beside it: {', '.join(str(other) for other in others)}"] if others else []
    lines += [for_versions(net.energies, mujoco)] if for_mujoco(first) else []
    errors = header["expected_error"]
    if isinstance(errors, dict):
        known = [f"{load} {100 * error:+.3g} %" for load, error in errors.items() if isinstance(error, float)]
        why: dict[str, list[str]] = {}
        for load, error in errors.items():
            if isinstance(error, str):
                why.setdefault(error, []).append(load)
        unknown = [f"{', '.join(loads)}: {reason}" for reason, loads in why.items()]
        what = "error of the displacement" if header["beam"] else "errors"
        lines += [f"{what}, solved on this mesh: {', '.join(known)}"] if known else []
        lines += unknown
    else:
        lines.append(f"error of the displacement: {errors}")
    steps = header["largest_stable_step"]
    if isinstance(steps, dict):
        step = min(step for step in steps.values() if isinstance(step, float))
        lines.append(f"largest stable step of explicit integrators, undamped: {step:.4g} s")
    return "\n".join(lines)
