"""Copies of the repository, in which studies are run, and the jobs that Slurm knows of."""

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from cluster import asked

REPOSITORY = Path(__file__).parents[2]

ENVIRONMENT = REPOSITORY / "build/slurm/bin"
"""What `make test-slurm` installs: requirements/run.txt and slurm.txt."""


def jobs():
    """State and node of each job that Slurm knows, or knew."""
    return [row.split("|") for row in asked("squeue", "--states=all", "--noheader", "--format=%T|%N").splitlines()]


@dataclass
class Copy:
    """A copy of the repository."""

    folder: Path

    def springtune(self, *words):
        """Output of a command that ends well."""
        path = f"{ENVIRONMENT}{os.pathsep}{os.environ['PATH']}"
        environment = os.environ | {"PYTHONPATH": str(self.folder / "src"), "PATH": path}
        command = [str(ENVIRONMENT / "python"), "-m", "springtune", *map(str, words)]
        done = subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr


def copied(folder):
    """A copy of the repository as it is in a folder, what is not committed included."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    files = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout
    for file in filter(None, files.split("\0")):
        if os.path.lexists(REPOSITORY / file):
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(REPOSITORY / file, folder / file, follow_symlinks=False)
    return Copy(folder)
