"""What changes, which jobs then run, and what they solve again: one row each."""

import os
from dataclasses import dataclass, field
from pathlib import Path

import driver

AFTER = "collect present_scenes browse"
"""Jobs after the stages: they run where the dataset may be another one."""


@dataclass(frozen=True)
class Row:
    """A change of the complete study.

    Attributes
    ----------
    change : callable
        Changes the folder, which is the working directory.
    jobs : str
        Names of the jobs that run then, and no others.
    solved : dict
        Results that are computed then, by kind of task, and no others.
    cores : int
        Cores of the run.
    """

    change: object
    jobs: str = ""
    solved: dict = field(default_factory=dict)
    cores: int = 1


def text(*pairs):
    """Change the text of the study."""

    def change():
        content = driver.CONFIG.read_text()
        for before, after in pairs:
            assert before in content, before
            content = content.replace(before, after)
        driver.CONFIG.write_text(content)

    return change


def flip(path):
    """Change one bit in the middle of a file; size and time stay."""
    state, content = path.stat(), bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns + 1))


def cut(path):
    """Leave half of a file."""
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def empty(path):
    """Leave nothing of a file."""
    path.write_bytes(b"")


def touch(path):
    """Change the time of a file."""
    os.utime(path)


def files(how, pattern):
    """Do something to the first of some files."""

    def change():
        how(sorted(driver.FOLDER.glob(pattern))[0])

    return change


def every(pattern):
    """Do something to all of some files."""

    def change():
        for path in sorted(driver.FOLDER.glob(pattern)):
            touch(path)

    return change


def then(*changes):
    """Changes one after the other, the study run after each but the last."""

    def change():
        for one in changes[:-1]:
            one()
            driver.Run().finish()
        changes[-1]()

    return change


def moved():
    """The mesh file, in another folder and by another name."""
    Path("meshes").mkdir()
    Path("own.inp").rename("meshes/mine.inp")
    text(("own.inp", "meshes/mine.inp"))()


SIZE = text(("[5 mm, 4 mm]", "[5 mm, 4 mm, 2.5 mm]"))
OUTPUT = "outputs: [size]"

GRID = """\
  three: {beam: a, mesh_type: structured, mesh_size: 5 mm, material: rubber, load: traction, force: 1 mN,
          definition: lattice, kinematics: linear}
"""

SIZES = f"mesh sensitivity calibrate solve moduli {AFTER}"
"""Jobs of a study with other mesh sizes."""

CURVES = f"sensitivity calibrate solve {AFTER}"
"""Jobs of a study with other curves: what comes after them looks, and finds its own results there."""

PRINTED = Path("printed.csv")

SCENES = {"linear": 24, "nonlinear": 25}
"""All scenes."""

RENAMED = ("  a: {", "  first: {"), ("beam: a", "beam: first"), ("beam: [a, b]", "beam: [first, b]")
FORCES = tuple((f"force: 1 kN\n    definition: {one}", f"force: 2 kN\n    definition: {one}") for one in ("[", "d"))
BEAMS = "  a: {length: 20 mm, height: 10 mm}\n", "  b: {length: 24 mm, height: 10 mm}\n"
DEFINITIONS = "[paper, lattice, calibrated]"

STUDY = {
    "nothing": Row(lambda: None),
    "comment added": Row(text(("title:", "# A comment.\ntitle:")), AFTER),
    "config touched": Row(lambda: touch(driver.CONFIG)),
    "config indented otherwise": Row(text(("    beam: [a, b]\n", "    beam:\n      - a\n      - b\n")), AFTER),
    "quantity in another unit": Row(text(("length: 20 mm", "length: 2 cm")), AFTER),
    "title changed": Row(text(("title: What", "title: All that")), AFTER),
    # Outputs: none of them solves anything.
    "output sensitivity added": Row(text((OUTPUT, "outputs: [size, sensitivity]")), f"{AFTER} present_sensitivity"),
    "output deformed added": Row(text((OUTPUT, "outputs: [size, deformed]")), AFTER),
    "output tables added": Row(text((OUTPUT, "outputs: [size, tables]")), AFTER),
    "output definitions added": Row(text((OUTPUT, "outputs: [size, definitions]")), f"{AFTER} present_definitions"),
    "output laying added": Row(text((OUTPUT, "outputs: [size, laying]")), f"{AFTER} present_laying"),
    "output stability added": Row(text((OUTPUT, "outputs: [size, stability]")), f"{AFTER} present_stability"),
    "output replaced": Row(text((OUTPUT, "outputs: [sensitivity]")), "collect present_sensitivity browse"),
    "outputs reordered": Row(
        then(
            text((OUTPUT, "outputs: [size, tables, laying]")),
            text(("[size, tables, laying]", "[laying, tables, size]")),
        ),
        f"{AFTER} present_laying",
    ),
    # Values added. Another size is another mean of best stiffnesses, so calibrated scenes are solved again.
    "mesh size added": Row(SIZE, SIZES, {"mesh": 2, "curve": 8, "linear": 20, "nonlinear": 20, "moduli": 1}),
    "coarser mesh size added": Row(
        text(("[5 mm, 4 mm]", "[5 mm, 4 mm, 8 mm]")),
        SIZES,
        {"mesh": 2, "curve": 8, "linear": 20, "nonlinear": 20, "moduli": 1},
    ),
    "definition added": Row(
        text((DEFINITIONS, "[paper, lattice, calibrated, area]")),
        f"solve moduli {AFTER}",
        {"linear": 8, "nonlinear": 8, "moduli": 2},
    ),
    "load added": Row(
        text(("[traction, compression]", "[traction, compression, bending]")),
        f"reference {CURVES}",
        {"reference": 2, "curve": 8, "linear": 12, "nonlinear": 12},
    ),
    "grid added": Row(
        text(("  two:\n", f"{GRID}  two:\n")), f"reference {CURVES}", {"reference": 1, "curve": 1, "linear": 1}
    ),
    "further reference added": Row(
        text(("printed:", "further_references: neo-hooke-plane-stress\nprinted:")), f"reference {CURVES}", {"finite": 4}
    ),
    "mesh type added": Row(
        text(
            ("mesh_type: structured\n    mesh_size: [5", "mesh_type: [structured, right]\n    mesh_size: [5"),
            ("[paper, lattice", "[uniform, lattice"),
        ),
        SIZES,
        {"mesh": 4, "curve": 16, "linear": 32, "nonlinear": 32, "moduli": 6},
    ),
    # Values removed: where another mesh is the coarsest, its fields are made, and no number again.
    "mesh size removed": Row(text(("[5 mm, 4 mm]", "[4 mm]")), SIZES, {"linear": 4, "nonlinear": 4, "fields": 16}),
    "finest mesh size removed": Row(text(("[5 mm, 4 mm]", "[5 mm]")), SIZES, {"linear": 4, "nonlinear": 4}),
    "definition removed": Row(text((DEFINITIONS, "[paper, calibrated]")), f"solve {AFTER}"),
    "load removed": Row(text(("[traction, compression]", "traction")), CURVES),
    "beam removed": Row(text(("beam: [a, b]", "beam: a")), f"mesh reference {CURVES}"),
    "kinematics removed": Row(text(("[linear, nonlinear]", "linear")), CURVES),
    "back to the grid of before": Row(then(SIZE, text(("[5 mm, 4 mm, 2.5 mm]", "[5 mm, 4 mm]"))), SIZES),
    "back to the size of before": Row(
        then(text(("[5 mm, 4 mm]", "[4 mm]")), text(("mesh_size: [4 mm]", "mesh_size: [5 mm, 4 mm]"))), SIZES
    ),
    # Values reordered.
    "mesh sizes reordered": Row(text(("[5 mm, 4 mm]", "[4 mm, 5 mm]")), AFTER),
    "beams reordered": Row(text(("beam: [a, b]", "beam: [b, a]")), AFTER),
    "loads reordered": Row(text(("[traction, compression]", "[compression, traction]")), AFTER),
    "definitions reordered": Row(text((DEFINITIONS, "[calibrated, paper, lattice]")), AFTER),
    "kinematics reordered": Row(text(("[linear, nonlinear]", "[nonlinear, linear]")), AFTER),
    "declared beams reordered": Row(text(("".join(BEAMS), "".join(reversed(BEAMS)))), AFTER),
    "measurements reordered": Row(
        then(text((DEFINITIONS, "[area, lattice, calibrated]")), text(("[area, lattice,", "[lattice, area,"))), AFTER
    ),
    # Labels.
    "beam renamed": Row(text(*RENAMED), AFTER),
    "material renamed": Row(text(("steel", "iron")), AFTER),
    "grid renamed": Row(text(("  two:\n", "  mine:\n")), AFTER),
    # What is computed.
    "thickness changed": Row(
        text(("a: {length: 20 mm,", "a: {thickness: 2 mm, length: 20 mm,")),
        CURVES,
        {"curve": 8, "linear": 16, "nonlinear": 17},
    ),
    "Young's modulus changed": Row(
        text(("210 GPa", "200 GPa")), f"laying stability {CURVES}", SCENES | {"curve": 16, "laying": 4, "contrast": 1}
    ),
    "Poisson's ratio changed": Row(
        text(("poisson_ratio: 0.3", "poisson_ratio: 0.29")),
        f"reference moduli laying stability {CURVES}",
        SCENES | {"reference": 2, "curve": 16, "moduli": 2, "laying": 4, "contrast": 1},
    ),
    "density changed": Row(text(("7850", "7800")), f"stability {AFTER}", {"contrast": 1}),
    "force changed": Row(text(*FORCES), CURVES, SCENES | {"curve": 16}),
    "stated stiffness changed": Row(text(("170e6", "171e6")), f"solve {AFTER}", {"linear": 8, "nonlinear": 8}),
    # On a bent curve the best stiffness is met from other points: it is another one in its last digits.
    "ratios of curves changed": Row(text(("points: 9", "points: 11")), CURVES, {"curve": 16, "nonlinear": 8}),
    "calibrating beam changed": Row(
        text(("calibrated: {beam: a,", "calibrated: {beam: b,")),
        f"calibrate solve {AFTER}",
        {"linear": 8, "nonlinear": 8},
    ),
    "patch of moduli changed": Row(
        text(("printed:", "patch: {length: 50 mm, height: 20 mm}\nprinted:")), f"moduli {AFTER}", {"moduli": 2}
    ),
    "no moduli any more": Row(text(("    moduli: true\n", "")), AFTER),
    "experiment added": Row(
        text(("experiment: contrast", "experiment: [contrast, slivers]")), f"stability {AFTER}", {"slivers": 1}
    ),
    "pressure of laying changed": Row(text(("0.001 MPa", "0.002 MPa")), f"laying {AFTER}", {"laying": 4}),
    # Files that a study reads.
    "printed table edited": Row(
        lambda: Path("printed.csv").write_text(driver.PRINTED.replace("0.011", "0.012")), AFTER
    ),
    "printed table commented": Row(lambda: Path("printed.csv").write_text("# As printed.\n" + driver.PRINTED), AFTER),
    "mesh file edited": Row(lambda: driver.write_mesh("own.inp", 3e-4), f"mesh {CURVES}", {"mesh": 1, "nonlinear": 1}),
    "mesh file touched": Row(lambda: touch(Path("own.inp"))),
    "mesh file moved": Row(moved, f"mesh {CURVES}"),
    "more cores": Row(lambda: None, cores=2),
}

FILES = {
    "mesh": ("meshes/20x10_structured_5mm.vtu", f"mesh {CURVES}", {"mesh": 1}),
    "mesh notes": ("meshes/20x10_structured_5mm.json", f"mesh {CURVES}", {"mesh": 1}),
    "curve": ("curves/20x10_structured_5mm.h5", CURVES, {"curve": 4}),
    "solution": ("solutions/20x10_structured_5mm.h5", f"solve {AFTER}", {"linear": 6, "nonlinear": 6}),
    "reference": ("references/*.h5", f"reference {CURVES}", {"reference": 1}),
    "moduli": ("moduli/structured_5mm.h5", f"moduli {AFTER}", {"moduli": 1}),
    "laying": ("laying/*.h5", f"laying {AFTER}", {"laying": 1}),
    "stability": ("stability/*.h5", f"stability {AFTER}", {"contrast": 1}),
    "record": ("done/solve_0.json", f"solve {AFTER}", {}),
    "dataset": ("dataset.nc", AFTER, {}),
    "summary": ("summary.txt", AFTER, {}),
    "figure": ("figures/*.png", "present_scenes", {}),
    "page": ("index.html", "browse", {}),
}
"""Files by what they hold, the jobs that run to make one again, and what they compute."""

STORED = (
    {
        f"{what} {called}": Row(files(how, pattern), jobs, solved)
        for what, (pattern, jobs, solved) in FILES.items()
        for called, how in (("deleted", Path.unlink), ("with a bit flipped", flip), ("cut", cut), ("empty", empty))
    }
    | {
        f"{what} {called}": Row(files(how, pattern))
        for what, pattern in (
            ("task file", "tasks/solve_0.json"),
            ("bundles", "tasks/bundles.json"),
            ("costs", "../costs.json"),
            ("code", "../code.json"),
        )
        for called, how in (("deleted", Path.unlink), ("with a bit flipped", flip), ("cut", cut))
    }
    | {"everything touched": Row(every("**/*.*"))}
)

NETWORKS = {"curve": 16, "moduli": 2, "laying": 4, "contrast": 1} | SCENES
"""Results of all networks."""

EVERYTHING = f"reference mesh moduli laying stability {CURVES}"
"""All jobs."""

SOLVING = f"moduli laying stability {CURVES}"
"""Jobs of networks, and what comes after them."""

CODE = {
    "nothing": ("studies/kinds/scenes/solve.py", ("", ""), "", {}),
    "docstring of a stage": ("studies/kinds/scenes/solve.py", ('"""Stage `solve`', '"""The stage `solve`'), "", {}),
    "docstring of a function": ("mechanics/newton.py", ("    Parameters\n", "    What it takes\n"), "", {}),
    "comment": ("mechanics/network.py", ("import numpy", "# Arrays.\nimport numpy"), "", {}),
    "annotation for type checkers": (
        "scene/curve.py",
        ("if TYPE_CHECKING:\n", "if TYPE_CHECKING:\n    import pandas\n"),
        "",
        {},
    ),
    "stage of scenes": ("studies/kinds/scenes/solve.py", "", f"solve {AFTER}", SCENES),
    "stage of curves": ("studies/kinds/scenes/sensitivity.py", "", CURVES, {"curve": 16}),
    "stage of moduli": ("studies/kinds/moduli/solve.py", "", f"moduli {AFTER}", {"moduli": 2}),
    "stage of laying": ("studies/kinds/laying/solve.py", "", f"laying {AFTER}", {"laying": 4}),
    "stage of stability": ("studies/kinds/stability/experiments.py", "", f"stability {AFTER}", {"contrast": 1}),
    "calibration": ("studies/kinds/scenes/calibrate.py", "", f"calibrate solve {AFTER}", {}),
    "definition of one scene": (
        "springs/delingette.py",
        "",
        f"solve laying stability {AFTER}",
        {"nonlinear": 1, "laying": 4, "contrast": 1},
    ),
    "definition of a laid strip": ("springs/area.py", "", f"laying {AFTER}", {"laying": 1}),
    "definition that is not asked for": ("springs/searched.py", "", "", {}),
    "mesh type": ("mesh/rows.py", "", f"mesh {SOLVING}", NETWORKS | {"mesh": 4, "nonlinear": 24}),
    "mesh type that is not asked for": ("mesh/free.py", "", "", {}),
    "paths": ("mechanics/series.py", "", CURVES, {"curve": 16}),
    "networks": ("mechanics/network.py", "", SOLVING, NETWORKS),
    "references": ("reference/small_strain.py", "", f"reference {CURVES}", {"reference": 2, "curve": 16} | SCENES),
    "references at finite strain, not asked for": ("reference/finite_strain.py", "", "", {}),
    "figures": ("studies/kinds/scenes/figures.py", "", "present_scenes", {}),
    "figures that are not asked for": ("studies/kinds/laying/figures.py", "", "", {}),
    "style of figures": ("studies/output/style.py", "", "present_scenes", {}),
    "collect": ("studies/kinds/scenes/collect.py", "", AFTER, {}),
    "page to browse": ("studies/output/browse/page.py", "", "browse", {}),
    "command line": ("cli/results.py", "", "", {}),
}
"""File of the package, what is edited in it (nothing: a statement is added), and as of a `Row`."""

VERSIONS = {
    "numpy": (EVERYTHING, NETWORKS | {"reference": 2, "mesh": 5}),
    "scipy": (EVERYTHING, NETWORKS | {"reference": 2, "mesh": 5}),
    "pyamg": (SOLVING, NETWORKS),
    "cvxopt": (f"reference {SOLVING}", NETWORKS | {"reference": 2}),
    "numba": (f"stability {AFTER}", {"contrast": 1}),
    "meshio": (f"mesh {CURVES}", {"mesh": 1, "nonlinear": 1}),
    "netgen-mesher": ("", {}),
    "scikit-fem": ("", {}),
    "h5py": ("", {}),
    "pint": ("", {}),
    "matplotlib": ("present_scenes", {}),
    "xarray": (AFTER, {}),
    "snakemake": ("", {}),
}
"""Distributions, and as of a `Row` what another version of them changes."""
