"""Find a material's constants from measured tests."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import examples
from .options import STUDY_EXAMPLE, read_beam, shape_of_study

if TYPE_CHECKING:
    from ..scene.identify import Identified
    from ..scene.measured import MeasuredTest

TEST_KEYS = ("beam", "thickness", "study", "load", "force", "angle", "shift", "file")
"""Keys of a test in a list of tests; all but the file are options, too."""


@click.command(
    epilog=examples(
        "springtune identify pull.csv --beam 100x20 --load traction",
        'springtune identify dic.csv --beam 100x20 --load traction --force "400 N"',
        "springtune identify tests.yaml --law orthotropic",
    )
)
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--law", default="isotropic", show_default=True, help="isotropic, orthotropic, regions.")
@click.option("--known", multiple=True, help="A constant that is known, such as nu=0.3; may be repeated.")
@click.option("--beam", help="Length x height in mm, such as 100x20.")
@click.option("--study", help=f"A study's shape instead of a beam, such as {STUDY_EXAMPLE}.")
@click.option("--thickness", default="1 mm", show_default=True, help="Thickness of a beam.")
@click.option("--load", help="Load of the beam, or load case of the shape: what is held and which side is loaded.")
@click.option("--force", help="Force on a beam at which a field was measured, such as '400 N'.")
@click.option("--angle", default="0 deg", help="Angle of the material's first axis from x.")
@click.option("--shift/--no-shift", default=True, help="Remove the rigid motion of fields, and the zero of curves.")
def identify(files: tuple[Path, ...], law: str, known: tuple[str, ...], **options: Any) -> None:
    """Find a material's constants from measured tests of a sheet, with 95 % intervals.

    FILES are CSV files of one test, or YAML files with a list of tests, whose keys are the options and 'file'. Columns
    have units in their heads, such as 'force [N],displacement [mm]' or 'x [mm],y [mm],u [um],v [um]'.
    """
    from ..scene.identify import identify as identified

    rows = [options | row for path in files for row in _rows(path)]
    given = {name: value for name, _, value in (one.partition("=") for one in known)}
    found = identified([_test(**row) for row in rows], law, known=given)
    click.echo(f"{found}\n\nin a study:\n{_materials(found)}", nl=False)


def _rows(path: Path) -> list[dict[str, Any]]:
    """Options of each test of a file: one test of a CSV file, the list in a YAML file."""
    from yaml import YAMLError, safe_load

    from ..safe_io.inputs import LARGEST_CSV, read

    if path.suffix not in (".yaml", ".yml"):
        return [{"file": path}]
    try:
        rows = [dict(row) for row in safe_load(read(path, LARGEST_CSV))["tests"].values()]
    except (AttributeError, KeyError, TypeError, ValueError, YAMLError) as error:
        raise ValueError(
            f"{path}: is no list of tests ({type(error).__name__}: {error}); give 'tests:' and names, each with some "
            f"of the keys {', '.join(TEST_KEYS)}"
        ) from None
    for row in rows:
        if wrong := [key for key in row if key not in TEST_KEYS]:
            raise ValueError(f"{path}: a test has the key {wrong[0]!r}; known: {', '.join(TEST_KEYS)}")
        row |= {key: path.parent / row[key] for key in ("file", "study") if row.get(key)}
    return rows


def _test(
    beam: str | None, study: str | None, thickness: str, load: str, file: Path | None = None, **others: Any
) -> "MeasuredTest":
    """Test of its options."""
    from ..scene.measured import MeasuredTest

    if not ((beam or study) and load and file):
        raise ValueError("load: a test needs a body, a load and a file; give such as --beam 100x20 --load traction")
    if beam:
        return MeasuredTest(read_beam(str(beam), thickness), load, file, **others)
    about, _, body = shape_of_study(str(study))
    if about.plane_strain:
        raise ValueError(
            f"study: {study}: material {about.plane_strain[0]!r} is in plane strain, and tests are analysed in plane "
            "stress; give a study in plane stress"
        )
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
