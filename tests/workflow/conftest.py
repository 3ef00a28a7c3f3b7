"""A study run through Snakemake in a folder of its own."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]

collect_ignore = ["forks.py"]  # which has no examples, and imports Snakemake


def called(command, folder, **environment):
    """Exit code and output of a module that is a program, in a folder."""
    command = list(map(str, [sys.executable, "-m", *command]))
    done = subprocess.run(command, cwd=folder, env=os.environ | environment, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


@dataclass
class Run:
    """Where a study runs, and how."""

    folder: Path
    forks: subprocess.Popen

    def snakemake(self, config, *arguments, package=None):
        """Exit code and output of the workflow in this folder, with the package of another one if given."""
        command = ["--snakefile", REPOSITORY / "Snakefile", "--directory", self.folder, "--cores", "2"]
        command += ["--workflow-profile", REPOSITORY / "workflow/profiles/default"]
        command += ["--configfile", self.folder / config, *arguments]
        if package:
            return called(["snakemake", *command], self.folder, PYTHONPATH=str(package))
        return self.forked(command)

    def forked(self, command, **environment):
        """Exit code and output of Snakemake in this folder."""
        log = self.folder.with_suffix(".log")
        log.unlink(missing_ok=True)
        told = {"arguments": list(map(str, command)), "folder": str(self.folder), "log": str(log)}
        self.forks.stdin.write(json.dumps(told | {"environment": os.environ | environment}) + "\n")
        self.forks.stdin.flush()
        return int(self.forks.stdout.readline()), log.read_text()

    def springtune(self, config, *arguments):
        """Exit code and output of `springtune run` in this folder, on two cores."""
        command = ["springtune", "run", config, "--cores", "2", *arguments]
        return called(command, self.folder)

    def write(self, name, text):
        """Write a study."""
        (self.folder / name).write_text(text)

    def times(self, pattern):
        """Time of the last change of each file."""
        return {str(path.relative_to(self.folder)): path.stat().st_mtime_ns for path in self.folder.glob(pattern)}


@pytest.fixture(scope="session")
def forks():
    """A process that has imported Snakemake."""
    command = [sys.executable, Path(__file__).with_name("forks.py")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        yield server
        server.stdin.close()


@pytest.fixture(scope="module")
def run(tmp_path_factory, forks):
    """An empty folder to run studies in, with the printed values beside them."""
    folder = tmp_path_factory.mktemp("run")
    shutil.copy(REPOSITORY / "config/paper_tables.csv", folder)
    return Run(folder, forks)


@pytest.fixture
def run_alone(tmp_path, forks):
    """An empty folder of one test to run Snakemake in."""
    (tmp_path / "alone").mkdir()
    return Run(tmp_path / "alone", forks)


@pytest.fixture(scope="session")
def repository():
    """The repository's folder."""
    return REPOSITORY
