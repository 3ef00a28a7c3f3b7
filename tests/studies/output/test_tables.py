"""Pages made from datasets: what they print, and that nothing of one mesh stands there as if it were of all."""

import re

import numpy as np
import pytest
import xarray as xr

from springtune.problem.compare import assured
from springtune.studies.kinds.benchmark import figures as benchmark
from springtune.studies.kinds.benchmark.kind import KIND as BENCHMARK
from springtune.studies.kinds.bodies.variables import ROOT
from springtune.studies.kinds.collect import group_of
from springtune.studies.kinds.moduli import figures as definitions
from springtune.studies.kinds.moduli.kind import KIND as MODULI
from springtune.studies.kinds.stability import figures as stability
from springtune.studies.kinds.stability.kind import KIND as STABILITY
from springtune.studies.output import page as tables_page
from springtune.studies.output.text import decimals, number


def cells(line):
    return [cell.strip() for cell in line.strip("|").split("|")]


def tables(text):
    """Rows of every table of a page, by the heading above it: a list of dicts each."""
    found, heading, heads = {}, "", None
    for line in text.splitlines():
        if line.startswith("#"):
            heading, heads = line.strip("# "), None
        elif line.startswith("|") and heads is None:
            heads = cells(line)
            found.setdefault(heading, [])
        elif line.startswith("|") and not line.startswith(("|-", "| -")):
            found[heading].append(dict(zip(heads, cells(line))))
    return found


# -- which definition --------------------------------------------------------------------------------------------------

SIZES = (1e-3, 2e-3, 5e-3)
BEAMS = {"100x20": 0.02, "200x40": 0.04}


def compared():
    """Dataset of `area` on the free mesh, whose error is a tenth of a/H, on two beams, and moduli that tell sizes."""
    axes = {
        "beam": tuple(BEAMS), "mesh_type": ("structured", "free"), "mesh_size": SIZES, "material": ("steel", "nu-0.5"),
        "load": ("traction", "bending", "shear"), "definition": ("area", "adjoint"), "kinematics": ("linear",),
        "poisson_ratio": (0.3, 0.5),
    }  # fmt: skip
    root = ROOT.empty(axes)
    root["material_poisson_ratio"].values[:] = 0.3, 0.5
    root["beam_height"].values[:] = tuple(BEAMS.values())
    root["beam_length"].values[:] = 0.1, 0.2
    for beam, height in BEAMS.items():
        for size in SIZES:
            place = {"beam": beam, "mesh_type": "free", "mesh_size": size, "definition": "area"}
            root["deformation_error"].loc[place] = 0.1 * size / height * (-1 if beam == "200x40" else 1)
            root["status"].loc[place] = 1
    place = {"beam": "100x20", "mesh_type": "free", "mesh_size": 5e-3, "definition": "adjoint"}
    root["deformation_error"].loc[place], root["status"].loc[place] = 0.5, 1
    # More scenes of the first beam, so that its tables are printed.
    root["status"].loc[{"beam": "100x20", "mesh_type": "structured", "definition": "area"}] = 1
    moduli = group_of(MODULI).empty(axes)
    for size in SIZES:
        place = {"definition": "area", "mesh_size": size}
        moduli["young_modulus_error"].loc[place] = size / 1e-3 / 100  # 1 % at 1 mm
        moduli["effective_poisson_ratio"].loc[place] = size / 1e-2
        moduli["status"].loc[place] = 1
    place = {"definition": "adjoint", "mesh_size": 5e-3}
    moduli["young_modulus_error"].loc[place], moduli["status"].loc[place] = 0.05, 1
    moduli.attrs = {"patch_length": 0.1, "patch_height": 0.02}
    return xr.DataTree.from_dict({"/": root, "/moduli": moduli})


def rows_of(tree, heading="Mesh type `free`", key="definition"):
    """Rows of a table of the page of definitions; in short, those of `area`."""
    found = tables(definitions.decision(tree))[heading]
    return {row[key]: row for row in found if row.get("usual choice", "`area`") == "`area`"}


def test_moduli_and_errors_of_a_row_are_of_one_mesh_size():
    text, rows = definitions.decision(compared()), rows_of(compared())
    wanted = {"E at 0.3": "+1.0 %", "ν at 0.3": "0.100", "traction, 0.3": "+0.5 %"}  # at 1 mm, as the errors
    assert wanted.items() <= rows["`area`"].items()
    assert {"E at 0.3": "+5.0 %", "traction, 0.3": "+50.0 %"}.items() <= rows["`adjoint` (5 mm)"].items()
    assert "1 mm (a/H = 0.05)" in text and "100 x 20 mm" in text


def test_a_definition_without_moduli_on_its_mesh_size_is_left_out():
    tree = compared()
    tree["moduli"]["status"].loc[{"mesh_size": 1e-3}] = 0
    rows = rows_of(tree)
    assert "`area` (2 mm)" in rows and "`area`" not in rows
    assert rows["`area` (2 mm)"]["E at 0.3"] == "+2.0 %"


def test_moduli_of_another_box_than_the_beam_are_said():
    tree = compared()
    tree["moduli"].attrs["patch_height"] = 0.04
    assert "moduli are of the meshes of a 100 x 40 mm sheet" in definitions.decision(tree)


def test_summary_gives_the_range_over_all_meshes():
    rows = rows_of(compared(), "In short", "a/H")
    assert list(rows) == ["to 0.05", "to 0.1", "to 0.25"]
    # 200x40 at 1 and 2 mm (-.25, -.5 %), 100x20 at 1 mm (.5 %); 100x20 at 2 mm; 5 mm on both.
    assert [row["meshes"] for row in rows.values()] == ["3", "1", "2"]
    assert rows["to 0.05"]["traction, ν = 0.3"] == "−0.5 to +0.5 %"
    assert rows["to 0.1"]["traction, ν = 0.3"] == "+1.0 %"
    assert rows["to 0.25"]["shear, ν = 0.5"] == "−1.2 to +2.5 %"


@pytest.mark.parametrize("spoiled", ["load", "mesh"])
def test_a_range_never_hides_a_mesh_that_is_not_solved(spoiled):
    """What has no answer on a mesh of a row says so there."""
    tree = compared()
    place = {"beam": "200x40", "mesh_type": "free", "mesh_size": 5e-3, "definition": "area"}
    if spoiled == "load":
        place["load"] = "shear"
    tree["deformation_error"].loc[place], tree["status"].loc[place] = np.nan, 5
    rows = rows_of(tree, "In short", "a/H")
    assert "1 not solved" in rows["to 0.25"]["shear, ν = 0.3"]
    assert ("not solved" in rows["to 0.25"]["traction, ν = 0.3"]) == (spoiled == "mesh")


def test_a_load_that_was_not_asked_on_all_meshes_says_on_how_many():
    tree = compared()
    place = {"beam": "200x40", "mesh_type": "free", "load": "bending", "definition": "area"}
    tree["deformation_error"].loc[place], tree["status"].loc[place] = np.nan, 0
    rows = rows_of(tree, "In short", "a/H")
    assert rows["to 0.05"]["bending, ν = 0.3"] == "+0.5 % (1 of 3)"


# -- the benchmark -----------------------------------------------------------------------------------------------------


def timed():
    """Group of a benchmark with made-up errors, the finest mesh size first."""
    axes = {"scene": ("traction",), "approach": ("steady", "slow"), "mesh_size": (1e-3, 2e-3, 5e-3, 1e-2),
            "thread_count": (1, 2), "precision": ("float64", "float32")}  # fmt: skip
    data = group_of(BENCHMARK).empty(axes)
    data["error"].values[0] = [(0.0002, 0.0008, 0.005, 0.02), (np.nan, np.nan, 0.001, 0.002)]
    data["seconds"].values[:] = np.where(np.isfinite(data.error), (0.08, 0.02, 0.004, 0.001), np.nan)
    data.status.values[:] = [[[1, 1, 1, 1], [5, 5, 1, 1]]]
    data.message.values[0, 1, :2] = "not run", "no memory"
    data["spring_updates"].values[:] = 2e8
    return xr.DataTree.from_dict({"/benchmark": data})


def test_the_page_of_the_benchmark_has_numbers_and_holes():
    text = benchmark.page(timed())
    assert "### traction: what has no numbers\n\n- `slow` (1 mm): not run\n- `slow` (2 mm): no memory\n" in text
    found = tables(text)
    (row,) = found["traction: approaches on one mesh size"]
    assert (row["at 1 mm"], row["error"], row["time"]) == ("`steady`", "+0.02 %", "80 ms")
    assert found["Explicit steps"][0]["float32, threads: 2"] == "200"


@pytest.mark.parametrize(
    ("errors", "wanted"),
    [
        ((0.0002, -0.0008, 0.005), (np.nan, 0.0008, 0.005)),  # nothing finer than the first was run
        ((0.15, 0.12, 0.0002), (np.nan, 0.15, 0.15)),  # crosses zero on its way
        ((0.0001, np.nan, 0.0003), (np.nan, np.nan, np.nan)),  # a finer one failed
        ((np.nan, 0.01, 0.02), (np.nan, np.nan, 0.02)),
    ],
)
def test_an_error_counts_only_with_all_finer_ones(errors, wanted):
    assert assured(np.array([errors]))[0] == pytest.approx(wanted, nan_ok=True)


# -- the experiments on stability --------------------------------------------------------------------------------------


def stressed():
    """Group of strains of which one flutters."""
    axes = {
        "definition": ("lattice", "area"), "experiment": ("strains",),
        "strain_load": ("axial", "follower-pressure"), "strain": (-0.1, 0.1),
    }  # fmt: skip
    used = [name for name, one in STABILITY.variables.items() if set(one[0]) <= set(axes)]
    strains = group_of(STABILITY).empty(axes, used)
    strains["strain_status"].values[:], strains["strain_load_share"].values[:] = 1, 1.0
    strains["negative_pivots"].values[:] = 0.0
    place = {"definition": "area", "strain_load": "follower-pressure", "strain": 0.1}
    strains["strain_status"].loc[place] = 4
    strains["strain_message"].loc[place] = "flutter: two modes have merged"
    place = {"definition": "area", "strain_load": "axial", "strain": -0.1}
    strains["strain_status"].loc[place], strains["negative_pivots"].loc[place] = 4, 2.0
    return xr.DataTree.from_dict({"/stability": strains})


def test_page_tells_flutter_from_buckling():
    text = stability.page(stressed())
    assert "| `area` | unstable (2) | solved |" in text
    assert "| `area` | solved | unstable (flutter) |" in text


def test_page_marks_buckling_loads_where_nothing_bifurcates():
    axes = {"definition": ["lattice"], "rows": [10, 20], "experiment": ["buckling"]}
    data = xr.Dataset(
        {"buckling_load": (("definition", "rows"), [[105.3, 99.9]]), "euler_load": ("definition", [100.0]),
         "buckling_message": (("definition", "rows"), [["", "nothing bifurcates: why"]])}, axes,
    )  # fmt: skip
    text = stability.page(xr.DataTree.from_dict({"/stability": data}))
    assert "| `lattice` | +5.3 % | −0.1 %* |" in text and "\n\\* nothing bifurcates: why\n" in text


# -- the page of all tables --------------------------------------------------------------------------------------------


def scenes(printed=False):
    """Root of a bar, 2 mm thick, whose `area` is linear alone and whose `lattice` is unstable in compression."""
    axes = {
        "beam": ("alu-bar",), "mesh_type": ("free",), "mesh_size": (4e-3,), "material": ("alu",),
        "load": ("traction", "compression"), "definition": ("lattice", "area"), "kinematics": ("nonlinear", "linear"),
    }  # fmt: skip
    root = ROOT.empty(axes)
    root["beam_length"].values[:], root["beam_height"].values[:] = 0.12, 0.025
    root["beam_thickness"] = ("beam", [2e-3])
    root["force"].values[:], root["reference_displacement"].values[:] = 1e4, 3.42e-6
    root["reference_applies"].values[:] = 1
    root["status"].loc[{"definition": "lattice"}] = 1
    root["displacement"].loc[{"definition": "lattice"}] = 3.5e-6
    root["deformation_error"].loc[{"definition": "lattice"}] = 0.0234
    place = {"definition": "lattice", "load": "compression", "kinematics": "nonlinear"}
    root["status"].loc[place] = 4
    place = {"definition": "area", "kinematics": "linear", "load": "traction"}
    root["status"].loc[place], root["displacement"].loc[place] = 1, 3.4e-6
    root["deformation_error"].loc[place] = -0.006
    place = {"definition": "area", "kinematics": "linear", "load": "compression"}
    root["status"].loc[place], root["message"].loc[place] = 3, "no equilibrium"
    if printed:
        place = {"load": "traction"}
        root["paper_displacement"].loc[place], root["paper_reference_displacement"].loc[place] = 3.6e-3, 3.4e-3
        root["paper_deformation_error"].loc[place], root["paper_table"].loc[place] = 0.0588, 7
    return xr.DataTree(root.assign_attrs(title="A bar", springtune_version="1", git_commit="", created="today"))


def lines_of(folder):
    """Texts of the cells of the page, line by line."""
    html = (folder / "index.html").read_text()
    rows = re.findall(r"<tr.*?</tr>", html, re.DOTALL)
    return html, [[re.sub(r"<.*?>", "", cell) for cell in re.findall(r"<t[dh].*?</t[dh]>", row)] for row in rows]


def test_the_page_has_both_kinematics_and_says_what_was_not_asked(tmp_path):
    assert tables_page.write(scenes(), tmp_path)[-1] == "index.html"
    html, lines = lines_of(tmp_path)
    found = [line for line in lines if "nonlinear" in line or "linear" in line]
    compression, traction = found[:2], found[2:]
    place = ["alu-bar", "4", "10000", "0.003420"]
    assert traction[0] == [*place, "nonlinear", "0.003500", "+2.34", "not asked", ""]
    assert traction[1] == [*place, "linear", "0.003500", "+2.34", "0.003400", "−0.60"]
    assert compression[0][5:] == ["0.003500u", "+2.34", "not asked", ""]
    assert compression[1][-2:] == ["not converged", ""]
    assert "u marks an equilibrium that is unstable" in html and "<li>not converged: no equilibrium</li>" in html
    assert "alu-bar, 120 x 25 x 2 mm" in html


def test_the_page_says_once_what_a_sign_means(tmp_path):
    tree = scenes()
    tables_page.write(tree, tmp_path)
    assert (tmp_path / "index.html").read_text().count("|reference|; positive: too soft. The reference") == 1
    tree["reference_displacement"].loc[{"load": "compression"}] *= -1
    tables_page.write(tree, tmp_path)
    said = "; positive: too soft; under compression, where displacements are negative, negative is too soft."
    assert (tmp_path / "index.html").read_text().count(said) == 1


def test_the_page_speaks_of_the_paper_only_where_the_study_has_its_cells(tmp_path):
    tables_page.write(scenes(), tmp_path)
    html, _ = lines_of(tmp_path)
    assert "paper prints" not in html and "printed" not in html.split("</style>")[1] and "Table" not in html
    tables_page.write(scenes(printed=True), tmp_path)
    html, lines = lines_of(tmp_path)
    assert "Paper, as printed" in html and "Table 7: traction" in html
    assert ["3.400", "3.60", "5.88"] in [line[3:6] for line in lines]


@pytest.mark.parametrize(
    "values, texts",
    [
        ((9.5004, 0.4751), ["9.500", "0.475"]),  # three digits of the smallest
        ((234.56, 12.3), ["234.6", "12.3"]),
        ((0.00342, np.nan), ["0.003420", "–"]),
        ((1e-12, 3.0), ["1e−12", "3"]),  # no number of decimals serves both
        ((0.0, -0.0), ["0", "0"]),
        ((-2.5, 2.5), ["−2.500", "2.500"]),
    ],
)
def test_a_column_has_the_decimals_that_its_numbers_need(values, texts):
    places = decimals(values)
    assert [number(value, places) for value in values] == texts


def test_a_number_that_is_nothing_has_no_sign():
    assert number(-0.001, 2, sign=True) == "0.00" and number(0.5, 1, sign=True) == "+0.5"
