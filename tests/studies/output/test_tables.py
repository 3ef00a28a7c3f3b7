"""Tables made from datasets, and that nothing of one mesh stands there as if it were of all."""

import re

import numpy as np
import pytest
import xarray as xr

from springtune.studies.kinds.benchmark import figures as benchmark
from springtune.studies.kinds.benchmark.kind import KIND as BENCHMARK
from springtune.studies.kinds.benchmark.solve import largest_finer_errors
from springtune.studies.kinds.bodies.collect import ROOT
from springtune.studies.kinds.collect import group_of
from springtune.studies.kinds.moduli import figures as definitions
from springtune.studies.kinds.moduli.kind import KIND as MODULI
from springtune.studies.kinds.stability import figures as stability
from springtune.studies.kinds.stability.kind import KIND as STABILITY
from springtune.studies.output.present import write_page
from springtune.studies.output.text import decimals, number

from synthetic import filled
from tables import beside, cases

# -- which definition --------------------------------------------------------------------------------------------------


def made(name, kind=None):
    """Group of a kind, or else of scenes, whose rows are in `cases.yaml`; of the table of this name there."""
    told = beside(__file__)[name]
    group = group_of(kind) if kind else ROOT
    used = {name: one for name, one in group.variables.items() if {*one[0]} <= {*told["axes"]}}
    return filled(group.empty(told["axes"], used), told[group.name])


def compared():
    root, moduli = made("compared"), made("compared", MODULI)
    moduli.attrs = {"patch_length": 0.1, "patch_height": 0.02}
    return xr.DataTree.from_dict({"/": root, "/moduli": moduli})


def ranges(tree, load="traction", material="steel"):
    """Rows of the table of definitions: those of `area` on the free mesh, by mesh size."""
    (table,) = definitions.tables(tree)
    place = {"definition": "area", "mesh_type": "free", "material": material, "load": load}
    return {row["mesh_size_over_height"]: row for row in table["rows"] if place.items() <= row.items()}


def test_the_table_of_definitions_gives_the_range_over_all_meshes():
    rows = ranges(compared())
    assert list(rows) == ["up to 0.05", "0.05 to 0.1", "above 0.1"]
    # 200x40 at 1 and 2 mm (-.25, -.5 %), 100x20 at 1 mm (.5 %); 100x20 at 2 mm; 5 mm on both.
    assert [row["scenes"] for row in rows.values()] == [row["solved"] for row in rows.values()] == [3, 1, 2]
    ends = [(row["lowest_error_percent"], row["highest_error_percent"]) for row in rows.values()]
    assert np.array(ends) == pytest.approx(np.array([(-0.5, 0.5), (1.0, 1.0), (-1.25, 2.5)]))


@pytest.mark.parametrize("spoiled", ["load", "mesh"])
def test_a_range_never_hides_a_mesh_that_is_not_solved(spoiled):
    """What has no answer on a mesh of a row says so there."""
    tree = compared()
    place = {"beam": "200x40", "mesh_type": "free", "mesh_size": 5e-3, "definition": "area"}
    if spoiled == "load":
        place["load"] = "shear"
    tree["deformation_error"].loc[place], tree["status"].loc[place] = np.nan, 5
    assert ranges(tree, "shear")["above 0.1"]["solved"] == 1 < ranges(tree, "shear")["above 0.1"]["scenes"]
    assert (ranges(tree)["above 0.1"]["solved"] == 1) == (spoiled == "mesh")


def test_a_range_counts_the_meshes_that_were_asked_for():
    tree = compared()
    place = {"beam": "200x40", "mesh_type": "free", "load": "bending", "definition": "area"}
    tree["deformation_error"].loc[place], tree["status"].loc[place] = np.nan, 0
    row = ranges(tree, "bending")["up to 0.05"]
    assert row["scenes"] == row["solved"] == 1 and row["lowest_error_percent"] == pytest.approx(0.5)


# -- the benchmark -----------------------------------------------------------------------------------------------------


def timed():
    return xr.DataTree.from_dict({"/benchmark": made("timed", BENCHMARK)})


def test_the_tables_of_the_benchmark_have_numbers_and_holes():
    cases, steps = (table["rows"] for table in benchmark.tables(timed()))
    assert len(cases) == 8 and len(steps) == 16
    steady = {"approach": "steady", "status": "solved", "message": "", "mesh_size_mm": 1.0, "time_ms": 80.0}
    assert steady.items() <= cases[0].items() and cases[0]["error_percent"] == pytest.approx(0.02)
    holes = {row["mesh_size_mm"]: (row["approach"], row["message"]) for row in cases if row["status"] == "failed"}
    assert holes == {1.0: ("slow", "not run"), 2.0: ("slow", "no memory")}
    assert steps[0]["million_springs_a_second"] == pytest.approx(200)


@cases
def test_an_error_counts_only_with_all_finer_ones(errors, wanted):
    assert largest_finer_errors(np.array([errors]))[0] == pytest.approx(wanted, nan_ok=True)


# -- the experiments on stability --------------------------------------------------------------------------------------


def stressed():
    return xr.DataTree.from_dict({"/stability": made("stressed", STABILITY)})


def test_the_table_of_strains_tells_flutter_from_buckling():
    ((rows,),) = ([table["rows"]] for table in stability.tables(stressed()))
    area = {(row["strain_load"], row["strain"]): row for row in rows if row["definition"] == "area"}
    assert area["axial", -0.1]["negative_pivots"] == 2 and area["axial", 0.1]["negative_pivots"] == 0
    assert "flutter" in area["follower-pressure", 0.1]["strain_message"]


def test_the_table_of_buckling_loads_says_where_nothing_bifurcates():
    axes = {"definition": ["lattice"], "rows": [10, 20], "experiment": ["buckling"]}
    data = xr.Dataset(
        {"buckling_load": (("definition", "rows"), [[105.3, 99.9]]), "euler_load": ("definition", [100.0]),
         "buckling_message": (("definition", "rows"), [["", "nothing bifurcates: why"]])}, axes,
    )  # fmt: skip
    (table,) = stability.tables(xr.DataTree.from_dict({"/stability": data}))
    assert [row["buckling_message"] for row in table["rows"]] == ["", "nothing bifurcates: why"]
    assert [row["buckling_load_N"] / row["euler_load_N"] for row in table["rows"]] == pytest.approx([1.053, 0.999])


# -- the page of all tables --------------------------------------------------------------------------------------------


def scenes(printed=False):
    root = made("scenes")
    if printed:
        filled(root, beside(__file__)["scenes"]["printed"])
    return xr.DataTree(root.assign_attrs(title="A bar", springtune_version="1", git_commit="", created="today"))


def lines_of(folder):
    """Texts of the cells of the page, line by line."""
    html = (folder / "index.html").read_text()
    rows = re.findall(r"<tr.*?</tr>", html, re.DOTALL)
    return html, [[re.sub(r"<.*?>", "", cell) for cell in re.findall(r"<t[dh].*?</t[dh]>", row)] for row in rows]


def test_the_page_has_both_kinematics_and_says_what_was_not_asked(tmp_path):
    write_page(scenes(), tmp_path)
    html, lines = lines_of(tmp_path)
    found = [line for line in lines if "nonlinear" in line or "linear" in line]
    compression, traction = found[:2], found[2:]
    place = ["alu-bar", "4", "10000", "0.003420"]
    # The definition with the smaller error stands first.
    assert traction[0] == [*place, "nonlinear", "", "", "0.003500", "+2.34"] and "Empty: not requested." in html
    assert traction[1] == [*place, "linear", "0.003400", "−0.60", "0.003500", "+2.34"]
    assert compression[0][5:] == ["0.003500u", "+2.34", "", ""]
    assert compression[1][-2:] == ["not converged", ""]
    assert "u marks an equilibrium that is unstable" in html and "<li>not converged: no equilibrium</li>" in html
    assert "alu-bar, 120 x 25 x 2 mm" in html


def test_the_page_speaks_of_the_paper_only_where_the_study_has_its_cells(tmp_path):
    write_page(scenes(), tmp_path)
    html, _ = lines_of(tmp_path)
    assert "paper prints" not in html and "printed" not in html.split("</style>")[1] and "Table" not in html
    write_page(scenes(printed=True), tmp_path)
    html, lines = lines_of(tmp_path)
    assert "Paper, as printed" in html and "Table 7: traction" in html
    assert ["3.400", "3.60", "5.88"] in [line[3:6] for line in lines]


@cases
def test_a_column_has_the_decimals_that_its_numbers_need(values, texts):
    places = decimals(values)
    assert [number(value, places) for value in values] == [*texts]
