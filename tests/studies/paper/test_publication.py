"""The paper: numbers by name, nothing typed, the same bytes from the same datasets; and its own source."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

from springtune.studies.paper import PaperError
from springtune.studies.paper.build import draw, run, typed_numbers
from springtune.studies.paper.numbers import numbers, read, table

import synthetic
from tables import beside

REPOSITORY = Path(__file__).parents[3]
PAPER = REPOSITORY / "workflow/paper"
ATTRIBUTES = beside(__file__)["ATTRIBUTES"]
ROWS = yaml.safe_load(Path(__file__).with_name("publication.yaml").read_text())
CELL, HOLE, CURVE = ROWS["cells"].values()


def write(path, **attributes):
    """A dataset of a study of all kinds, with a cell of each status."""
    tree = synthetic.dataset()
    data = tree.to_dataset()
    data["status"] = data.status.copy()
    data.status.loc[CELL] = 4
    data["message"] = xr.full_like(data.status, "", dtype=object)
    data.message.loc[HOLE] = "it buckled"
    data.deformation_error.loc[HOLE] = np.nan
    data.mesh_size.attrs["units"] = "m"
    tree.dataset = data
    tree.attrs = ATTRIBUTES | attributes
    tree.to_netcdf(path, engine="h5netcdf")
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(tmp_path_factory.mktemp("datasets") / "mine.nc")


@pytest.fixture(scope="module")
def datasets(path):
    return read([path])


def number(datasets, **entry):
    """Text of a number of the study."""
    entry = {"study": "mine"} | entry
    return numbers({"it": entry}, {}, datasets)["it"]["text"]


# -- numbers -----------------------------------------------------------------------------------------------------------


def test_numbers_are_cells_reductions_and_formulas_of_the_dataset(datasets):
    root = datasets["mine"].tree.to_dataset()
    errors = root.deformation_error.sel(load="traction", definition="area").values
    at = {"load": "traction", "definition": "area"}
    share = {"variable": "deformation_error", "at": at, "unit": "%", "digits": 3}
    assert (
        number(datasets, variable="deformation_error", at=CELL, digits=6) == f"{root.deformation_error.sel(CELL):.6f}"
    )
    assert number(datasets, **share, reduce="median") == f"{100 * np.median(errors):.3f}"
    assert number(datasets, **share, reduce="largest") == f"{100 * errors.max():.3f}"
    assert number(datasets, variable="deformation_error", at=at, reduce="count") == str(errors.size)
    several = [at | {"beam": "100x20"}, at | {"beam": ["200x40"]}]
    assert number(datasets, **share | {"at": several}, reduce="mean") == f"{100 * errors.mean():.3f}"
    assert number(datasets, variable="status", where="status=unstable", reduce="count") == "1"
    assert number(datasets, variable="status", where="status!=unstable", reduce="count") == str(root.status.size - 1)
    assert number(datasets, variable="mesh_type", reduce="count") == "2"
    best = datasets["mine"].tree["sensitivity"].best_stiffness
    share = {"over": "best_stiffness", "minus": 1, "reduce": "largest", "unit": "%", "digits": 4}
    ratio = number(datasets, variable="sensitivity/predicted_stiffness", **share)
    assert ratio == f"{100 * (50 / best).max():.4f}"
    declared = {"a": {"study": "mine", "variable": "mesh_size", "reduce": "largest", "unit": "mm"}}
    declared["b"] = {"formula": "sqrt(3) / 2 * a - printed_length", "unit": "mm", "digits": 2}
    printed = {"printed_length": {"printed": "12.50", "unit": "mm", "where": "Figure 1"}}
    found = numbers(declared, printed, datasets)
    assert [found[name]["text"] for name in ("printed_length", "a", "b")] == ["12.50", "5", "−8.17"]
    assert found["printed_length"]["source"] == "Figure 1"


@pytest.mark.parametrize(("value", "shown", "text"), ROWS["shown"])
def test_numbers_are_shown_as_declared(datasets, value, shown, text):
    found = numbers({"it": {"formula": repr(value)} | shown}, {}, datasets)["it"]
    assert found["text"] == text and found["value"] == pytest.approx(value)


@pytest.mark.parametrize(("entry", "told"), ROWS["wrong"])
def test_what_is_wrong_with_a_number_is_told_with_its_name(datasets, entry, told):
    with pytest.raises(PaperError, match="^it: ") as error:
        number(datasets, **entry)
    assert re.search(told, str(error.value)), error.value


def test_a_table_is_the_product_of_rows_and_columns(datasets):
    made = table(ROWS["table"], datasets, "t")
    root = datasets["mine"].tree.to_dataset()
    assert made["columns"] == [{"group": "200x40 mm", "title": "2 mm", "unit": ""}]
    force, error = root.force.sel(beam="200x40", material="rubber", load="traction"), root.deformation_error.sel(CELL)
    assert [row["cells"] for row in made["rows"]] == [[f"{force:.3f}"], [f"{error:.3f}†"], ["–"]]


# -- typed numbers -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", ROWS["typed"])
def test_a_typed_number_is_found(text):
    assert list(typed_numbers(text))


@pytest.mark.parametrize("text", ROWS["untyped"])
def test_names_references_and_structure_are_no_typed_numbers(text):
    assert not list(typed_numbers(text))


def test_the_paper_has_no_typed_number_and_one_that_is_planted_stops_the_build(tmp_path, path):
    text = (PAPER / "main.typ").read_text()
    assert not list(typed_numbers(text))
    source = tmp_path / "paper"
    shutil.copytree(PAPER, source)
    (source / "main.typ").write_text(text.replace("= Limits", "= Limits\n\nErrors of 3.4 % remain.", 1))
    line = text[: text.index("= Limits")].count("\n") + 3
    with pytest.raises(PaperError, match=rf"main.typ:{line}: '3.4 %' is typed; declare it"):
        run(source, tmp_path / "build", tmp_path / "paper.pdf", path)
    assert not (tmp_path / "paper.pdf").exists()


# -- the paper's own source --------------------------------------------------------------------------------------------


def test_every_number_is_declared_and_used():
    text = (PAPER / "main.typ").read_text()
    declared = yaml.safe_load((PAPER / "numbers.yaml").read_text())
    printed = yaml.safe_load((PAPER / "printed.yaml").read_text())
    figures = yaml.safe_load((PAPER / "figures.yaml").read_text())
    called = set(re.findall(r'#?\b(?:n|v|has)\("([^"]+)"\)', text))
    called |= {name for pair in re.findall(r'\brange\("([^"]+)", "([^"]+)"\)', text) for name in pair}
    assert called <= set(declared["numbers"]) | set(printed)
    formulas = " ".join(entry.get("formula", "") for entry in declared["numbers"].values())
    used = called | set(re.findall(r"[a-z]\w+", formulas))
    assert not (set(declared["numbers"]) | set(printed)) - used
    assert set(re.findall(r'#tabular\("([^"]+)"', text)) == set(declared["tables"])
    assert set(re.findall(r'"([^"]+)"', " ".join(re.findall(r"#drawing\(([^\[]+)", text)))) == set(figures)


# -- figures and the whole ---------------------------------------------------------------------------------------------

MAIN, NUMBERS, FIGURES = ROWS["paper"].values()


def paper(folder, main=MAIN, declared=NUMBERS, figures=FIGURES):
    """Source of a small paper."""
    folder.mkdir(exist_ok=True)
    shutil.copy(PAPER / "template.typ", folder)
    (folder / "main.typ").write_text(main)
    for name, content in {"numbers": declared, "printed": {}, "figures": figures}.items():
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(content, sort_keys=False))
    return folder


@pytest.mark.slow
def test_the_same_dataset_gives_the_same_bytes_and_another_one_others(tmp_path, path):
    pypdf = pytest.importorskip("pypdf")
    source, output = paper(tmp_path / "source"), tmp_path / "paper.pdf"
    run(source, tmp_path / "build", output, path)
    content = output.read_bytes()
    # Another process, another folder.
    made = [source, tmp_path / "other", tmp_path / "again.pdf", tmp_path / "again.json", "digest"]
    command = [sys.executable, "-m", "springtune.studies.paper.build", *made]
    done = subprocess.run([*command, path], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "again.pdf").read_bytes() == content
    text = "\n".join(page.extract_text() for page in pypdf.PdfReader(output).pages)
    (sha256,) = (one.sha256[:12] for one in read([path]).values())
    assert "No more." in text and "0123456789ab+" in text and text.count(sha256) == 3
    assert "mine: 200x40, free, rubber, traction, sha256" in " ".join(text.split())
    assert not list(tmp_path.rglob("*.unfinished"))

    later = write(tmp_path / "later.nc", created="2026-01-03T00:00:00+00:00")
    run(source, tmp_path / "build", output, later)
    assert output.read_bytes() != content

    # What fails leaves what was there.
    content = output.read_bytes()
    paper(source, MAIN.replace('The error is #n("error")', 'The error is #n("unheard")'))
    with pytest.raises(PaperError) as error:
        run(source, tmp_path / "build", output, path)
    assert "no number is called 'unheard'" in str(error.value) and "main.typ:5" in str(error.value)
    assert output.read_bytes() == content


def test_an_example_draws_a_figure_of_the_paper_and_what_is_wrong_with_one_is_told(tmp_path, datasets):
    (tmp_path / "examples").mkdir()
    one = "import matplotlib.pyplot as plt\ndef main():\n    plt.plot([0, 1], [0, 1])\n    print('drawn')\n"
    (tmp_path / "examples/one.py").write_text(one)
    (tmp_path / "examples/none.py").write_text("def main():\n    pass\n")

    def drawn(declared):
        return draw({"f": declared}, datasets, tmp_path, tmp_path / "examples")

    assert drawn({"example": "one"}) == {"f": "none, drawn by examples/one.py"}
    content = (tmp_path / "f.pdf").read_bytes()
    drawn({"example": "one"})
    assert (tmp_path / "f.pdf").read_bytes() == content
    for declared, told in ROWS["figures"]:
        with pytest.raises(PaperError, match=f"^figure f: .*{told}"):
            drawn(declared)


def test_a_dataset_that_is_not_there_is_told(tmp_path):
    with pytest.raises(PaperError, match=r"lost.nc: there is no such dataset"):
        run(paper(tmp_path / "source"), tmp_path / "build", tmp_path / "paper.pdf", tmp_path / "lost.nc")
    with pytest.raises(PaperError, match=r"main.typ: there is no such file"):
        run(tmp_path / "nowhere", tmp_path / "build", tmp_path / "paper.pdf", tmp_path / "lost.nc")
