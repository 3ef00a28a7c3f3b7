"""Keys follow what is computed: the code without what is written for readers, and the packages that it imports."""

import importlib.metadata
import json
import sys
from fnmatch import fnmatch
from pathlib import Path

import pytest
import yaml

import springtune as st
from springtune.studies.kinds.bodies.kind import REFERENCES_OF_SHAPES, SHAPE_MODULES
from springtune.studies.runs import keys
from springtune.studies.runs.plan import stages
from springtune.studies.runs.source import DIGESTS, STATE, source_state

from campaigns import forget_keys

TABLES = yaml.safe_load(Path(__file__).with_name("code_changes.yaml").read_text())
MODULE = TABLES["module"]


@pytest.mark.parametrize(
    "computed, name", [(kind, name) for kind in ("for_readers", "computed") for name in TABLES[kind]]
)
def test_a_digest_changes_with_what_is_computed_and_not_with_what_is_for_readers(computed, name):
    before, after = TABLES[computed][name]
    changed = MODULE.replace(before, after)
    compile(changed, "changed", "exec")
    assert changed != MODULE and (keys.digest_of(changed) != keys.digest_of(MODULE)) == (computed == "computed")


def test_a_job_takes_the_digests_of_its_run_unless_the_package_changed(monkeypatch):
    path = keys.PACKAGE / "units.py"
    for state, found in ((source_state(), "of the run"), ("of before", keys.file_digest(path))):
        monkeypatch.setenv(STATE, state)
        monkeypatch.setenv(DIGESTS, json.dumps({str(path): "of the run"}))
        forget_keys()
        assert keys.file_digest(path) == found
    forget_keys()


# -- imports -----------------------------------------------------------------------------------------------------------


def test_no_module_imports_a_package_that_brings_in_others():
    faces = [f"{keys.PACKAGE.name}.{name}" for name in ("mesh", "springs")]
    assert not any(keys.imports_graph().find_modules_that_directly_import(face) for face in faces)


@pytest.mark.parametrize("row", TABLES["closures"].values(), ids=TABLES["closures"])
def test_a_module_counts_with_what_it_imports_and_with_nothing_else(row):
    known = {"beams": SHAPE_MODULES, "references of beams": REFERENCES_OF_SHAPES}
    without = known.get(str(row.get("without")), tuple(row.get("without", ())))
    files = keys.closure(row["module"], without=without).files
    found = {path.relative_to(keys.PACKAGE).as_posix() for path in files}
    known = {*row.get("has", ())}
    assert known <= found
    assert not [name for name in found - known if any(fnmatch(name, one) for one in row.get("lacks", ()))]


def test_an_engine_and_a_mesher_have_keys_of_their_own():
    assert keys.declared_key(st.ENGINES["xpbd"]) != keys.declared_key(st.ENGINES["vbd"])
    assert "netgen" in keys.mesh_type_closure("free").packages
    assert not any("netgen" in keys.mesh_type_closure(name).packages for name in set(st.MESH_TYPES) - {"free"})
    assert "meshio" in keys.mesh_type_closure("from a file").packages


# -- what springtune runs on -------------------------------------------------------------------------------------------

WRITING = {"xarray", "matplotlib", "h5netcdf", "netCDF4", "bokeh", "typst", "jinja2", "pydantic", "yaml", "PIL"}


@pytest.mark.parametrize("stage", stages(), ids=lambda stage: stage.name)
def test_what_writes_draws_or_reads_studies_is_in_no_key_of_a_result(stage):
    assert not keys.closure(stage.module).packages & (WRITING | keys.CARRIER_PACKAGES)


def _keys():
    forget_keys()
    found = {stage.module.removeprefix("studies.kinds."): keys.stage_key(stage.module) for stage in stages()}
    of_beams = (*REFERENCES_OF_SHAPES, "reference.finite_strain", "reference.interpolant")
    found["unit"] = keys.stage_key("studies.kinds.bodies.reference", without=of_beams)
    found["samples.interpolate"] = keys.stage_key("studies.kinds.samples.interpolate", without=of_beams)
    found["box"] = keys.stage_key("studies.kinds.bodies.mesh", without=("studies.kinds.bodies.task_values",))
    found["beam"] = keys.stage_key("studies.kinds.bodies.solve", without=SHAPE_MODULES)
    found |= {name: keys.definition_key(name) for name in ("lattice", "patch", "annealed")}
    return found | {name: keys.mesh_type_key(name) for name in ("structured", "free", "from a file")}


@pytest.fixture(scope="module")
def known():
    """Keys of what is installed here."""
    return _keys()


KINDS = ("bodies", "moduli", "laying", "stability", "benchmark", "samples", "engines")
SOLVING = {"beam", "bodies.sensitivity", "patch", "annealed", *(f"{name}.solve" for name in KINDS)}
REFERENCE = {"bodies.reference", "samples.interpolate", "unit"}

VERSIONS = {
    **dict.fromkeys(("matplotlib", "xarray", "h5py", "pint", "pydantic", "snakemake"), set()),
    "netgen-mesher": {"free", "bodies.mesh", "bodies.reference", "bodies.solve", "engines.solve"},
    "meshio": {"from a file"},
    "numba": SOLVING,
    "scikit-fem": {"bodies.reference", "benchmark.solve", "bodies.solve", "engines.solve"},
    "cvxopt": SOLVING | REFERENCE,
    "scipy": SOLVING | REFERENCE | {"bodies.mesh", "box", "bodies.calibrate", "free", "from a file", "lattice"},
}


@pytest.mark.parametrize("package", VERSIONS)
def test_a_packages_version_is_in_the_keys_of_what_it_computes(package, known, monkeypatch):
    version = importlib.metadata.version
    monkeypatch.setattr(importlib.metadata, "version", lambda name: "999" if name == package else version(name))
    after = _keys()
    monkeypatch.undo()
    forget_keys()
    assert {name for name in known if after[name] != known[name]} == VERSIONS[package]


# -- definitions of one's own ------------------------------------------------------------------------------------------


@pytest.fixture
def own(tmp_path, monkeypatch):
    """Import a module of some text beside others; closure of its definition ``own``."""
    monkeypatch.syspath_prepend(tmp_path)
    number = iter(range(100))

    def closure(text, **beside):
        for name, other in beside.items():
            path = tmp_path / (name.replace("__in_", "/") + ".py")
            path.parent.mkdir(exist_ok=True)
            path.write_text(other)
        name = f"own_{tmp_path.name}_{next(number)}"
        (tmp_path / f"{name}.py").write_text(text)
        importlib.import_module(name)
        keys.file_digest.cache_clear()
        found = keys.declared_closure(st.DEFINITIONS["own"])
        st.DEFINITIONS.discard("own")
        sys.modules.pop(name)
        return found

    yield closure
    st.DEFINITIONS.discard("own")


OWN = TABLES["own"]


def test_ones_own_definition_counts_with_its_code_and_packages(own):
    digest = own(OWN).digest
    assert own(OWN.replace("Springs.", "My springs.").replace("# one", "# 1")).digest == digest
    assert own(OWN.replace("1.0", "2.0")).digest != digest
    assert own("import h5py, pandas, os\n" + OWN).packages == {"h5py", "numpy", "pandas"}


def test_modules_beside_ones_own_definition_count(own):
    text = OWN.replace("1.0", "factor").replace("\n@", "from beside import factor\n\n@", 1)
    more = "import scipy\nfactor = 1.0\n"
    first = own(text, beside="from helpers.more import factor\n", helpers__in_more=more)
    before = first.digest
    assert {path.name for path in first.files} >= {"base.py", "more.py"} and "scipy" in first.packages
    assert own(text, helpers__in_more=more.replace("1.0", "2.0")).digest != before


def test_modules_of_ones_own_elsewhere_on_the_path_count(own, tmp_path, monkeypatch):
    """A module, one of a package under a name of Python's own, and none of what Python has or nobody has."""
    texts = {"apart_from_it": "import scipy", "boxed_up/__init__": "", "boxed_up/json": "import numba"}
    for name, text in texts.items():
        path = tmp_path / "elsewhere" / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    monkeypatch.syspath_prepend(tmp_path / "elsewhere")
    tried = "try:\n    import had_by_nobody\nexcept ImportError:\n    import decimal\n"
    found = own(f"import apart_from_it, boxed_up.json, json\n{tried}{OWN}")
    others = {path for path in found.files if not path.is_relative_to(keys.PACKAGE)}
    elsewhere = {path.relative_to(tmp_path / "elsewhere") for path in others if path.parent != tmp_path}
    assert {path.as_posix() for path in elsewhere} == {"apart_from_it.py", "boxed_up/__init__.py", "boxed_up/json.py"}
    assert set(found.packages) == {"had_by_nobody", "numba", "numpy", "scipy"}


def test_names_of_the_package_itself_are_followed(own):
    text = OWN.replace("from springtune.springs import Springs, definition", "import springtune as st")
    text = text.replace("@definition", "@st.definition").replace("Springs(", "st.Springs(")
    files = {path.name for path in own(text).files}
    assert "base.py" in files and not {"single.py", "__init__.py"} & files
    more = own(text.replace("1.0", "st.moduli(mesh, material, 'lattice').young_modulus_error"))
    assert "sheet.py" in {path.name for path in more.files} and "scipy" in more.packages


def test_a_definition_that_was_typed_is_refused_with_the_remedy():
    space = {"Springs": st.Springs, "__name__": "prompt"}
    exec("springs = lambda mesh, material, thickness: Springs(1.0, mesh.edge_lengths)", space)
    st.definition("own")(space["springs"])
    try:
        with pytest.raises(ValueError, match="'own' was typed, and jobs of a study do not find it; put it into a"):
            keys.declared_closure(st.DEFINITIONS["own"])
    finally:
        st.DEFINITIONS.discard("own")
