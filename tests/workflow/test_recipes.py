"""Places to touch: a result group with its figure is a module and a row, a study kind two modules and a study."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

CONTRIBUTING = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text()

RECIPES = {
    recipe.partition("\n")[0].removeprefix("# ").replace("src/springtune/", ""): recipe
    for recipe in re.findall(r"^```python\n(.*?)^```", CONTRIBUTING, re.DOTALL | re.MULTILINE)
}
"""What CONTRIBUTING.md tells to write, by the file's place in the package."""


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    """A copy of what a study runs on."""
    folder, source = tmp_path_factory.mktemp("repository"), Path(__file__).parents[2]
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
