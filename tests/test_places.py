"""Places to touch: a definition, a mesh type and a result group are one module each, and a study kind is two."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import springtune as st

from tables import STUDIES

CONTRIBUTING = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text()

RECIPES = {
    recipe.partition("\n")[0].removeprefix("# ").replace("src/springtune/", ""): recipe
    for recipe in re.findall(r"^```python\n(.*?)^```", CONTRIBUTING, re.DOTALL | re.MULTILINE)
}
"""What CONTRIBUTING.md tells to write, by the file's place in the package."""


STUDY = STUDIES["places"]


REPORT = """
import json, sys
from springtune.studies.runs import keys
from springtune.mesh.cells import MESH_TYPES
from springtune.springs import DEFINITIONS
import springtune as st
found = {
    "place": st.__file__,
    "DEFINITIONS": {name: keys.declared_closure(one).digest for name, one in DEFINITIONS.items()},
    "MESH_TYPES": {name: keys.mesh_type_closure(name).digest for name in MESH_TYPES},
    "light": not {"scipy", "h5py", "meshio", "netgen", "xarray", "pydantic"} & set(sys.modules),
}
from springtune.studies.runs import plan
stages = [one.module for one in plan.stages()]
found["stages"] = {stage: keys.closure(stage).digest for stage in stages}
found["modules"] = {stage: sorted(map(str, keys.closure(stage).files)) for stage in stages}
print(json.dumps(found))
"""

USED = """
import json, sys
from click.testing import CliRunner
from springtune.cli import main
from springtune.studies.kinds import load_study
told = [CliRunner().invoke(main, command.split()).output for command in sys.argv[2:]]
print(json.dumps([sorted({(one.definition, one.mesh.mesh_type) for one in load_study(sys.argv[1]).scenes}), *told]))
"""


def python(folder, *arguments):
    """Run Python with the package of a folder."""
    environment = os.environ | {"PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def report(folder):
    found = json.loads(python(folder, "-c", REPORT))
    assert Path(found["place"]).is_relative_to(folder)
    return found


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the package that tests may write to, and what it says of itself."""
    folder = tmp_path_factory.mktemp("copy")
    source = Path(st.__file__).parent
    shutil.copytree(source, folder / "springtune")  # with what is compiled
    return folder, report(folder)


FILES = {"DEFINITIONS": ("springs/twice.py", "lattice", "twice"), "MESH_TYPES": ("mesh/left.py", "right", "left")}


def test_a_definition_and_a_mesh_type_are_one_file_each(copy, tmp_path):
    """A file more is one name more, at its place; nothing else is to be computed again."""
    folder, before = copy
    for place, _, _ in FILES.values():
        (folder / "springtune" / place).write_text(RECIPES[place])
    found = report(folder)
    assert found["light"] and all(found[one] == before[one] for one in ("stages", "modules"))
    for registry, (_, after, name) in FILES.items():
        names = list(before[registry])
        names.insert(names.index(after) + 1, name)
        assert list(found[registry]) == names
        assert {one: digest for one, digest in found[registry].items() if one != name} == before[registry]
        assert found[registry][name] not in before[registry].values()
    for text, counts in (("# Edited.", False), ("EDITED = True", True)):
        for place, _, _ in FILES.values():
            path = folder / "springtune" / place
            path.write_text(f"{path.read_text()}\n{text}\n")
        edited = report(folder)
        assert edited["stages"] == found["stages"]
        for registry, (_, _, name) in FILES.items():
            changed = [one for one, digest in edited[registry].items() if digest != found[registry][one]]
            assert changed == [name] * counts
    study = tmp_path / "one.yaml"
    study.write_text(STUDY.replace("DEFINITION", "twice").replace("MESH_TYPE", "left"))
    predict = "predict --beam 100x20 --material steel --mesh left --size 10mm"
    scenes, listed, predicted = json.loads(python(folder, "-c", USED, study, "definitions", predict))
    assert scenes == [[name, kind] for name in ("twice", "uniform") for kind in ("left", "structured")]
    assert "twice" in [line.split()[0] for line in listed.splitlines()]
    assert "left" in predicted and "recommended" in predicted


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    """A copy of what a study runs on."""
    folder, source = tmp_path_factory.mktemp("repository"), Path(__file__).parents[1]
    for name in ("src", "workflow", "profiles"):
        shutil.copytree(source / name, folder / name)
    (folder / "config").mkdir()
    shutil.copy(source / "Snakefile", folder)
    return folder


def add_row(path, row, tuple_name):
    """Put a row at the end of a tuple of a module."""
    text = path.read_text()
    begin = text.index(f"{tuple_name} = (")
    end = text.index(")", begin) if "\n" not in row else text.index("\n)", begin) + 1
    path.write_text(text[:end] + row + text[end:])


def test_a_kind_is_two_modules_of_at_most_60_lines():
    recipes = [recipe for place, recipe in RECIPES.items() if place.startswith("studies/kinds/columns/")]
    lines = [line for recipe in recipes for line in recipe.splitlines()]
    code = [line for line in lines if line.strip() and not line.lstrip().startswith(('"""', "#"))]
    assert len(recipes) == 2 and len(code) <= 60


@pytest.mark.slow
def test_a_group_is_a_module_and_a_row_and_a_kind_is_a_package_and_a_study(repository):
    """What CONTRIBUTING.md writes down, run by Snakemake: both have their group, their figures and their keys."""
    package, written = repository / "src/springtune", 0
    for place, recipe in RECIPES.items():
        if place.startswith("studies/kinds/"):
            (package / place).parent.mkdir(exist_ok=True)
            (package / place).parent.joinpath("__init__.py").touch()
            (package / place).write_text(recipe)
            written += 1
    assert written == 3  # one module of a group, two of a kind
    row = RECIPES["row of studies/kinds/bodies/outputs.py"].partition("\n")[2]
    add_row(package / "studies/kinds/bodies/outputs.py", row, "OUTPUTS")
    with (repository / "workflow/rules/stages.smk").open("a") as rules:
        rules.write(f"\n\n{RECIPES['end of workflow/rules/stages.smk']}")
    study = re.search(r"^```yaml\n# config/columns.yaml\n(.*?)^```", CONTRIBUTING, re.DOTALL | re.MULTILINE)[1]
    (repository / "config/columns.yaml").write_text(study)
    command = ["-m", "snakemake", "--snakefile", "Snakefile", "--cores", "2", "--configfile", "config/columns.yaml"]
    environment = os.environ | {"PYTHONPATH": str(repository / "src")}
    done = subprocess.run([sys.executable, *command], cwd=repository, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    log = max((repository / ".snakemake/log").iterdir()).read_text()
    assert re.search(r"^columns +1$", log, re.MULTILINE)  # the rule, under its own name
    results = repository / "results/columns"
    for stem in ("columns", "compliance"):
        assert (results / f"figures/{stem}.png").stat().st_size and (results / f"figures/{stem}.pdf").stat().st_size
    with xr.open_datatree(results / "dataset.nc", engine="h5netcdf") as tree:
        # Euler's column with one end clamped, 2 L long; twelve rows of linear triangles bend one percent too stiffly.
        euler = np.pi**2 * 210e9 * 1e-3 * 3e-3**3 / 12 / (2 * 60e-3) ** 2
        assert tree["columns"].buckling_load.sel(definition="delingette").item() == pytest.approx(euler, rel=0.015)
        # A bar of E t H: the clamp, which holds its end across, takes less than a percent.
        compliance = tree["compliance"].compliance.sel(beam="60x3", material="steel", load="traction").item()
        assert compliance == pytest.approx(60e-3 / (210e9 * 1e-3 * 3e-3), rel=0.01)
