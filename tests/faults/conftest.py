"""A small study, run once, and how its folder was before each of its jobs."""

import os
from dataclasses import dataclass, field
from pathlib import Path

import driven
import pytest


@dataclass
class Whole:
    """The study, complete.

    Attributes
    ----------
    steps : list of str
        What a run does, in order.
    snapshots : Path
        Folders as they were before each step.
    wanted : dict
        What files hold at the end.
    operations : dict of str to list
        Operations on files of each step, once they are counted.
    """

    steps: list
    snapshots: Path
    wanted: dict
    operations: dict = field(default_factory=dict)
    _contents: dict = field(default_factory=dict)

    def after(self, step):
        """What files hold when a step and the dataset are done."""
        place = max(self.steps.index(step), self.steps.index("collect")) + 1
        if place == len(self.steps):
            return self.wanted
        name = self.steps[place]
        if name not in self._contents:
            self._contents[name] = driven.contents(self.snapshots / name / "results")
        return self._contents[name]


@pytest.fixture(scope="session")
def whole(tmp_path_factory):
    """The study run in this process, whose forks find all modules imported and the kernels compiled."""
    os.environ["MPLBACKEND"] = "Agg"
    base = tmp_path_factory.mktemp("whole")
    driven.warm_up(base / "scratch")
    steps = driven.complete(base / "study", base / "snapshots")
    return Whole(steps, base / "snapshots", driven.contents(base / "study/results"))
