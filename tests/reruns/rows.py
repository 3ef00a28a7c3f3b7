"""What changes, which jobs then run, and what they solve again: the rows of rows.yaml."""

import os
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import driver
import yaml

AFTER = "collect present_scenes browse"
CURVES = f"sensitivity calibrate solve {AFTER}"
SOLVING = f"moduli laying stability {CURVES}"
JOBS = {
    "AFTER": AFTER,  # after the stages: they run where the dataset may be another one
    "CURVES": CURVES,  # of other curves: what comes after them looks, and finds its own results there
    "SIZES": f"mesh sensitivity calibrate solve moduli {AFTER}",  # of other mesh sizes
    "SOLVING": SOLVING,  # of networks, and what comes after them
    "EVERYTHING": f"reference mesh {SOLVING}",
}
TABLE = yaml.safe_load(Path(__file__).with_name("rows.yaml").read_text())
SCENES = {"linear": 24, "nonlinear": 25}
RESULTS = {"SCENES": SCENES, "NETWORKS": dict(SCENES, curve=16, calibrate=2, moduli=2, laying=2, contrast=1)}


@dataclass(frozen=True)
class Row:
    """A change of the complete study.

    Attributes
    ----------
    change : callable
        Changes the folder, which is the working directory.
    jobs : set of str
        Names of the jobs that run then, and no others.
    solved : dict
        Results that are computed then, by stage, and no others.
    """

    change: object
    jobs: set
    solved: dict

    @property
    def computes(self):
        """Whether the change itself runs the study."""
        return getattr(self.change, "func", None) is replace_twice


def row(change, jobs="", solved=None):
    """Row of the table, its capitals written out."""
    counts = {}
    for name, count in (solved or {}).items():
        for kind, one in (RESULTS.get(name) or {name: count}).items():
            counts[TABLE["stages"].get(kind, kind)] = counts.get(TABLE["stages"].get(kind, kind), 0) + one
    return Row(change, {job for name in jobs.split() for job in JOBS.get(name, name).split()}, counts)


def replace(*pairs):
    """Change texts of the study."""
    content = driver.CONFIG.read_text()
    for before, after in pairs:
        assert before in content, before
        content = content.replace(before, after)
    driver.CONFIG.write_text(content)


def replace_twice(first, second):
    """Change a text of the study, run it, and change another one."""
    replace(first)
    driver.Run().finish()
    replace(second)


def delete_first(pattern):
    """Delete the first of some files."""
    sorted(driver.FOLDER.glob(pattern))[0].unlink()


def move_mesh():
    """The mesh file, in another folder and by another name."""
    Path("meshes").mkdir()
    Path("own.inp").rename("meshes/mine.inp")
    replace(("own.inp", "meshes/mine.inp"))


def comment_both():
    Path("printed.csv").write_text("# As printed.\n" + driver.PRINTED)
    replace(("title:", "# A comment.\ntitle:"))


FUNCTIONS = {
    "nothing": lambda: None,
    "touch_config": partial(os.utime, driver.CONFIG),
    "edit_printed": lambda: Path("printed.csv").write_text(driver.PRINTED.replace("0.011", "0.012")),
    "comment_both": comment_both,
    "edit_mesh": partial(driver.write_mesh, "own.inp", 3e-4),
    "touch_mesh": partial(os.utime, "own.inp"),
    "move_mesh": move_mesh,
}


def change_of(told):
    """Function of a change: one of `FUNCTIONS`, one or several texts and what takes their place, or two in turn."""
    if isinstance(told, str):
        return FUNCTIONS[told]
    if isinstance(told, list):
        return partial(replace, told)
    return partial(replace, *told["texts"]) if "texts" in told else partial(replace_twice, *told["then"])


STUDY = {name: row(**one | {"change": change_of(one["change"])}) for name, one in TABLE["study"].items()}
STORED = {
    f"{what} deleted": row(partial(delete_first, one["path"]), one.get("jobs", ""), one.get("solved"))
    for what, one in TABLE["files"].items()
} | {"everything touched": row(lambda: [os.utime(path) for path in driver.FOLDER.glob("**/*.*")])}
CODE = {
    name: (one["module"], one.get("edit"), row(None, one.get("jobs", ""), one.get("solved")))
    for name, one in TABLE["code"].items()
}
"""File of the package, what is edited in it (None: a statement is added; nothing: it stays), and a row."""
