"""Places to touch: a new definition is one file and so is a new mesh type; all that lists them finds it there."""

import importlib
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import springtune
from springtune.mechanics.network import Network
from springtune.mechanics.statics import StaticProblem
from springtune.mesh import MESH_TYPES, mesh_type
from springtune.problem.boundary import held, weights
from springtune.problem.loads import LOADS
from springtune.problem.materials import Material
from springtune.springs import DEFINITIONS, definition
from springtune.studies.runs import keys

from tables import STUDIES

STEEL = Material(name="steel", young_modulus=210e9, poisson_ratio=0.3)

CONTRIBUTING = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text()

RECIPES = {
    recipe.partition("\n")[0].removeprefix("# ").replace("src/springtune/", ""): recipe
    for recipe in re.findall(r"^```python\n(.*?)^```", CONTRIBUTING, re.DOTALL | re.MULTILINE)
}
"""What CONTRIBUTING.md tells to write, by the file's place in the package."""


def outside_package(place):
    """A recipe as it is written outside the package."""
    package = f"springtune.{place.partition('/')[0]}"
    text = RECIPES[place].replace("from ..", "from springtune.").replace("from . ", f"from {package} ")
    return text.replace("from .", f"from {package}.")


STUDY = STUDIES["places"]

REGISTRIES = {"DEFINITIONS": DEFINITIONS, "MESH_TYPES": MESH_TYPES}


def displacement(name, type_name="structured"):
    """What 1 kN of traction does to a beam [m]."""
    mesh, kind = MESH_TYPES[type_name](0.1, 0.02, 5e-3), LOADS["traction"].kind
    springs = DEFINITIONS[name].springs(mesh, STEEL, 1e-3)
    pattern = weights(mesh, kind)
    network = Network(mesh, held(mesh, kind), springs.relative, springs.energies)
    found = StaticProblem(network, pattern).linear(1e3 / springs.reference)
    return float((found.displacements * pattern).sum())


class TestOutsideThePackage:
    """A file of one's own, imported: the same decorator, nothing else."""

    @pytest.fixture
    def outside(self, tmp_path, monkeypatch):
        """Import a module of some text; what is declared is taken out after the test."""
        known = {what: set(registry) for what, registry in REGISTRIES.items()}
        monkeypatch.syspath_prepend(tmp_path)
        modules = []

        def load(stem, text):
            (tmp_path / f"{stem}.py").write_text(text)
            modules.append(stem)
            return importlib.import_module(stem)

        yield load
        for what, registry in REGISTRIES.items():
            for name in set(registry) - known[what]:
                registry.discard(name)
        for stem in modules:
            sys.modules.pop(stem)

    def test_a_definition(self, outside, tmp_path):
        outside("own_springs", outside_package("springs/twice.py"))
        names = list(DEFINITIONS)
        assert names[names.index("lattice") + 1] == "twice"
        one = DEFINITIONS["twice"]
        assert one.summary.startswith("Springs twice as stiff") and one.file == tmp_path / "own_springs.py"
        assert displacement("twice") == pytest.approx(displacement("lattice") / 2, rel=1e-9)
        digest = keys.definition_closure("twice").digest
        assert digest not in {keys.definition_closure(name).digest for name in set(names) - {"twice"}}

    def test_a_mesh_type(self, outside):
        outside("own_mesh", outside_package("mesh/left.py"))
        names = list(MESH_TYPES)
        assert names[names.index("right") + 1] == "left"
        one = MESH_TYPES["left"]
        assert one.corners == 3 and one.summary == "Squares cut by parallel diagonals, the other way"
        mesh = one(0.1, 0.02, 5e-3)
        assert mesh.area == pytest.approx(2e-3)
        assert displacement("lattice", "left") == pytest.approx(displacement("lattice", "right"), rel=0.01)
        digest = keys.mesh_type_closure("left").digest
        assert digest not in {keys.mesh_type_closure(name).digest for name in set(names) - {"left"}}

    @pytest.mark.parametrize(
        ("declare", "name"), [(definition, "lattice"), (mesh_type, "structured")], ids=["definition", "mesh type"]
    )
    def test_a_name_that_is_taken_is_refused(self, declare, name):
        with pytest.raises(ValueError, match=rf"'{name}' is springtune\..* already; choose another name for .*other"):

            @declare(name)
            def other(*_):
                """Not to be."""

    @pytest.mark.parametrize("registry", REGISTRIES.values(), ids=REGISTRIES)
    def test_others_only_read(self, registry):
        with pytest.raises(TypeError):
            registry["new"] = None
        with pytest.raises(KeyError, match="unknown .* 'nothing'; known: "):
            registry["nothing"]
        assert "nothing" not in registry and registry.get("nothing") is None


REPORT = """
import json, sys
from springtune.studies.runs import keys
from springtune.mesh import MESH_TYPES
from springtune.springs import DEFINITIONS
import springtune
found = {
    "place": springtune.__file__,
    "DEFINITIONS": {name: keys.definition_closure(name).digest for name in DEFINITIONS},
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
    source = Path(springtune.__file__).parent
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
