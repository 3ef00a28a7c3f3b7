"""A study run job by job in this process, as the rules run it, and what it solved."""

import contextlib
import json
import shutil
import sys
from pathlib import Path

import meshio
import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "support"))  # for `campaigns`, where this is a program

import springtune as st
from springtune.studies.runs import plan

from campaigns import Campaign, held

HERE = Path(__file__).parent
CONFIG = Path("small.yaml")
FOLDER = Path("results/small")

PRINTED = (HERE / "printed.csv").read_text()


class Run(Campaign):
    """The study of this folder, as it is to be run now."""

    def __init__(self):
        super().__init__(CONFIG)

    def finish(self):
        """Run what is to run.

        Returns
        -------
        jobs : set of str
            Jobs that ran; those of stages without the number of their bundle.
        solved : dict of str to int
            What they computed, by the stage.
        """
        names, solved = self.due(), {}
        if names:
            self.write()
        for name in names:
            self.do(name)
            computed = json.loads(self.jobs[name].record.read_text()).get("computed", 0)
            if computed:
                solved[self.called(name)] = solved.get(self.called(name), 0) + computed
        return {self.called(name) for name in names}, solved

    def called(self, name):
        """Name of a job, without the number of its bundle."""
        return self.bundles[name].stage.name if name in self.bundles else name


def prepare(folder):
    """Write the files of the study into a new folder."""
    folder.mkdir(parents=True)
    shutil.copy(HERE / "small.yaml", folder)
    (folder / "printed.csv").write_text(PRINTED)
    write_mesh(folder / "own.inp")


def write_mesh(path, shift=0.0):
    """Write a mesh of one's own, points inside shifted [m]."""
    mesh = st.MESH_TYPES["structured"](0.02, 0.01, 5e-3)
    points = mesh.points.copy()
    points[((points > 1e-9) & (points < [0.02 - 1e-9, 0.01 - 1e-9])).all(axis=1)] += shift
    points = np.column_stack([1e3 * points, np.zeros(len(points))])
    meshio.Mesh(points, [("triangle", mesh.triangles)]).write(path)


def dataset(folder):
    """What the dataset of a study holds, without times."""
    return held(folder / FOLDER / plan.DATASET)


if __name__ == "__main__":  # with the package of another folder
    command, folder = sys.argv[1:]
    with contextlib.chdir(folder):
        run = Run()
        if command == "finish":
            names, computed = run.finish()
            print(json.dumps([sorted(names), computed]))
        else:
            print(json.dumps([run.called(name) for name in run.due()]))
