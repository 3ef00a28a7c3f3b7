"""What commands answer and refuse, by the table of commands.yaml: in one line, with a remedy, and nothing is left."""

import re
import shlex
import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest
import xarray as xr
import yaml

import springtune as st
from counting import counted
from springtune.cli.study import template_text
from springtune.mesh.cells import MeshType
from springtune.mesh.formats import write_mesh
from springtune.scene.boundary_problem import unit_reference
from springtune.scene.mesh_cache import MeshCache

from synthetic import small, written
from tables import STUDIES, run

REPOSITORY = Path(__file__).parents[2]
TABLE = yaml.load(Path(__file__).with_name("commands.yaml").read_text(), yaml.CSafeLoader)
ANSWERED = TABLE.pop("answered")


def cases():
    """Section, call, exit code and parts of the message of each call that is refused."""
    for section, rows in TABLE.items():
        for call, *said in rows:
            code = said.pop(0) if isinstance(said[0], int) else 2
            for one in said.pop() if isinstance(said[-1], list) else [""]:
                yield pytest.param(section, call.replace("VALUE", one), code, said, id=call.replace("VALUE", one))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder as that of a checkout, with studies, meshes, datasets, and what looks like them."""
    folder = tmp_path_factory.mktemp("folder")
    for name in ("Snakefile", "workflow"):
        (folder / name).symlink_to(REPOSITORY / name)
    for name in ("paper.yaml", "paper_tables.csv", "shapes.yaml"):
        shutil.copy(REPOSITORY / "config" / name, folder)
    for name in ("config/folder.yaml", "folder.json", "folder.csv"):
        (folder / name).mkdir(parents=True)
    for name in ("one", "two", "small"):
        (folder / f"config/{name}.yaml").write_text(template_text(Path("one"), "beam"))
    for name in ("own.msh", "file", "text.nc", "folder.csv/results"):
        (folder / name).write_text("" if name == "own.msh" else "text")
    (folder / "bad.yaml").write_text((REPOSITORY / "config/quick.yaml").read_text().replace("length:", "lenght:", 1))
    (folder / "c.csv").write_text("force [N],displacement [um]\n0,0\n1,1\n2,2.1\n")
    shape = template_text(Path("x"), "shape")
    (folder / "strain.yaml").write_text(shape.replace("ratio: 0.3}", "ratio: 0.3, plane: strain}"))
    (folder / "study.yaml").write_text(STUDIES["cli_shapes"].replace("s: {a: fixed}", "s: {a: fixed, b: {y: 0}}"))
    hole = st.Hole.circle(("20 mm", "10 mm"), "4 mm")
    write_mesh(folder / "own.vtu", st.mesh_shape(st.Shape.rectangle("40 mm", "20 mm", holes=[hole]), "4 mm"))
    write_mesh(folder / "braced.vtu", st.make_mesh(st.Beam("100 mm", "20 mm"), "braced", "5 mm"))
    tree = small()
    tree.attrs |= {"config": template_text(Path("one"), "beam"), "software": "{}"}
    written(tree, folder / "results/small/dataset.nc")
    written(small(beam=("200x40", "200x40")), folder / "twice.nc")
    xr.Dataset({"a": 1}).to_netcdf(folder / "plain.nc")
    return folder


@pytest.fixture
def files(folder, monkeypatch):
    """Files of the folder, which is the current one; none is made or changed."""
    monkeypatch.chdir(folder)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    yield
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before


def missing(said, output):
    """Parts that an output does not have, neither as it is nor with each run of blanks as one."""
    lines = "\n".join(["", *(" ".join(line.split()) for line in output.splitlines()), ""])
    return [part for part in said if part not in output + lines and not re.search(part, output)]


@pytest.mark.filterwarnings("default::springtune.problem.shapes.AssumptionWarning")
@pytest.mark.parametrize(("call", "said"), [pytest.param(call, said, id=call) for call, *said in ANSWERED])
def test_a_call_is_answered(call, said, files):
    result = run(*shlex.split(call))
    assert result.exit_code == 0 and not missing(said, result.output), result.output


@pytest.mark.filterwarnings("default::springtune.problem.shapes.AssumptionWarning")
@pytest.mark.parametrize(("section", "call", "code", "said"), [*cases()])
def test_a_call_is_refused(section, call, code, said, files):
    work = (MeshType.__call__, unit_reference, MeshCache.__init__)
    with counted(*work) if "at once" in section else nullcontext() as calls:
        result = run(*shlex.split(call))
    assert (result.exit_code, missing(said, result.output)) == (code, []), result.output
    aside = ("Usage: ", "Try ", "warning: ", "running ")
    lines = [line for line in result.stderr.splitlines() if line and not line.startswith(aside)]
    lacking = len(re.findall(": (missing|none); give", result.stderr))  # a line each
    assert len(lines) == max(1, lacking) and "Traceback" not in result.output, result.stderr
    assert not calls and ("at once" not in section or result.stdout == "")
