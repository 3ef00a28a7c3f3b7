"""Find a material's constants from measured tests."""

import os
import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import WrongCall, examples
from .options import asked_beam, refusals, shape_of_study

if TYPE_CHECKING:
    from ..problem.materials import AnyMaterial
    from ..scene.identify import Identified
    from ..scene.measured import MeasuredTest

ARGUMENT = re.compile("^(?=(law|known|load|force|scale|angle|noise):)")
"""Begin of messages with the name of an argument, which is an option here."""

KEYS = ("beam", "thickness", "shape", "load", "force", "scale", "angle", "noise", "shift", "file")
"""Keys of a test in a list of tests; all but the file are options, too."""


@click.command(
    epilog=examples(
        "springtune identify pull.csv --beam 100x20 --load traction",
        'springtune identify dic.csv --beam 100x20 --load traction --force "400 N" --noise "1 um" --plot residuals.png',
        "springtune identify tests.yaml --law orthotropic --write mine.yaml",
        "springtune identify config/treloar/uniaxial.csv --law yeoh",
    )
)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--law", default="isotropic", show_default=True, help="isotropic, orthotropic, regions, yeoh, neo-hooke.")
@click.option("--known", multiple=True, help="A constant that is known, such as nu=0.3; may be repeated.")
@click.option("--beam", help="Length x height in mm, such as 100x20.")
@click.option("--shape", help="A study's shape, such as config/shapes.yaml:cook, in the place of a beam.")
@click.option("--thickness", default="1 mm", show_default=True, help="Thickness of a beam.")
@click.option("--load", help="Load of the beam, or load case of the shape: what is held and which side is loaded.")
@click.option("--force", help="Force on a beam at which a field was measured, such as '400 N'.")
@click.option("--scale", type=float, default=1.0, help="Factor on the load case at which a shape's field was measured.")
@click.option("--angle", default="0 deg", help="Angle of the material's first axis from x.")
@click.option("--noise", help="Noise of the displacements, such as '1 um'; estimated without.")
@click.option("--shift/--no-shift", default=True, help="Remove the rigid motion of fields, and the zero of curves.")
@click.option("--plot", type=click.Path(path_type=Path), help="Draw the residuals: a .png, .svg or .pdf file.")
@click.option("--write", type=click.Path(path_type=Path), help="Write a small study with the material: a .yaml file.")
def identify(
    files: tuple[Path, ...], law: str, known: tuple[str, ...], plot: Path | None, write: Path | None, **options: Any
) -> None:
    """Find a material's constants from measured tests of a sheet, with 95 % intervals.

    FILES are CSV files of one test, or YAML files with a list of tests, whose keys are the options and 'file'. Columns
    have units in their heads, such as 'force [N],displacement [mm]' or 'x [mm],y [mm],u [um],v [um]'.
    """
    from ..scene.identify import SHEET_LAWS
    from ..scene.identify import identify as identified

    target = plot or write
    for option, path, endings in (("--plot", plot, (".png", ".svg", ".pdf")), ("--write", write, (".yaml", ".yml"))):
        if path is not None and path.suffix not in endings:
            raise WrongCall(f"{option}: '{path}' has another ending than {', '.join(endings)}; give one of these")
    with refusals("--plot" if plot else "--write", target, partial(ARGUMENT.sub, "--")):
        given = {name: _number(value) for name, _, value in (one.partition("=") for one in known)}
        rows = [row for path in files for row in _rows(path, options)]
        if SHEET_LAWS.get(law) == ():
            found = identified(files[0] if len(files) == 1 else [], law)
        else:
            found = identified([_test(row) for row in rows], law, known=given)
        text = _study(found, rows[0], write) if write else ""
        if plot:
            import matplotlib.pyplot as plt

            found.plot()
            plt.savefig(plot)
            plt.close()
        if write:
            write.write_text(text)
    click.echo(found)


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


def _rows(path: Path, options: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Options of each test of a file, with paths from here: one of a CSV file, those of the list in a YAML file."""
    from yaml import YAMLError, safe_load

    from ..safe_io.inputs import LARGEST_CSV, read

    if path.suffix not in (".yaml", ".yml"):
        return [{**options, "file": path}]
    try:
        rows = [dict(row) for row in safe_load(read(path, LARGEST_CSV))["tests"].values()]
    except (AttributeError, KeyError, TypeError, ValueError, YAMLError) as error:
        raise ValueError(
            f"{path}: is no list of tests ({type(error).__name__}: {error}); give 'tests:' and names, each with some "
            f"of the keys {', '.join(KEYS)}"
        ) from None
    for row in rows:
        if wrong := [key for key in row if key not in KEYS]:
            raise ValueError(f"{path}: a test has the key {wrong[0]!r}; known: {', '.join(KEYS)}")
        row |= {key: path.parent / row[key] for key in ("file", "shape") if row.get(key)}
    return [{**options, **row} for row in rows]


def _test(row: Mapping[str, Any]) -> "MeasuredTest":
    """Test of its options."""
    from ..scene.measured import MeasuredTest

    body, load, file = row["beam"] or row["shape"], row["load"], row.get("file")
    if not (body and load and file):
        raise ValueError("--load: a test needs a body, a load and a file; give such as --beam 100x20 --load traction")
    body = asked_beam(str(body), row["thickness"]) if row["beam"] else shape_of_study(str(body))[2]
    return MeasuredTest(body, load, file, *(row[name] for name in ("force", "scale", "angle", "noise", "shift")))


def _study(found: "Identified", row: Mapping[str, Any], target: Path) -> str:
    """Text of a small study of the first test's body with the material that was found."""
    from yaml import safe_dump, safe_load

    from .study import template_text

    materials = {one.name: _declared(one, row, target) for one in found.materials.values()}
    main = found.materials[""].name
    if row["shape"]:
        path, _, name = str(row["shape"]).rpartition(":")
        source = safe_load(Path(path or row["shape"]).read_text())
        body = source["shapes"][name or next(iter(source["shapes"]))]
        parts = {part: one.name for part, one in found.materials.items() if part}
        study = safe_load(template_text(target, "shape"))
        study["shapes"] = {"plate": body | ({"parts": parts} if parts else {})}
        if body.get("file"):
            body["file"] = os.path.relpath(Path(path or row["shape"]).parent / body["file"], target.parent)
            study["shape_grids"]["plate"].pop("mesh_size")
        study["shape_grids"]["plate"] |= {"material": main, "load": row["load"]}
    elif "young_modulus" not in materials[main] and "uniaxial_test" not in materials[main]:
        raise ValueError("--write: beams of a study are isotropic; give a --shape, or leave --write out")
    else:
        study = safe_load(template_text(target, "beam"))
        beam = asked_beam(row["beam"] or "100x20", row["thickness"])
        sides = {side: f"{1e3 * getattr(beam, side):g} mm" for side in ("length", "height", "thickness")}
        grid = {"beam": beam.name, "material": main, "mesh_size": f"{250 * beam.height:g} mm"}
        curve = next((one for one in found.places.values() if one.ndim == 1), None)
        force = row["force"] or (f"{abs(curve).max():g} N" if row["beam"] and curve is not None else "1 N")
        study["beams"] = {beam.name: sides}
        study["grids"]["pulled"] |= grid | {"load": row["load"] or "traction", "force": force}
    study["materials"] = materials
    return safe_dump(study, sort_keys=False)


def _declared(material: "AnyMaterial", row: Mapping[str, Any], target: Path) -> dict[str, Any]:
    """Keys of a material in a study."""
    from ..problem.materials import Material, Rubber

    if isinstance(material, Rubber):
        return {"uniaxial_test": os.path.relpath(row["file"], target.parent), "terms": len(material.coefficients)}
    if isinstance(material, Material):
        return {"young_modulus": f"{material.young_modulus:.6g} Pa", "poisson_ratio": round(material.poisson_ratio, 6)}
    along, across, ratio, shear, _ = material.constants_at()
    names = ("young_modulus_x", "young_modulus_y", "shear_modulus")
    moduli = {name: f"{value:.6g} Pa" for name, value in zip(names, (along, across, shear))}
    return moduli | {"poisson_ratio_xy": round(ratio, 6)}
