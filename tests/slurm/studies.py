"""Copies of the repository, in which studies are run, and the jobs that Slurm knows of."""

import os
import shutil
import signal
import subprocess
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from cluster import asked

REPOSITORY = Path(__file__).parents[2]

ENVIRONMENT = REPOSITORY / "build/slurm/bin"
"""What `make test-slurm` installs: requirements/run.txt and slurm.txt."""


@dataclass(frozen=True)
class Job:
    """A job that Slurm knows, or knew."""

    number: str
    state: str
    limit: str
    memory: str
    node: str
    rule: str


def jobs():
    """All jobs of the cluster by their numbers."""
    rows = asked("squeue", "--states=all", "--noheader", "--format=%i|%T|%l|%m|%N|%k").splitlines()
    found = [Job(*row.split("|")) for row in rows]
    return sorted(found, key=lambda job: int(job.number))


@dataclass
class Copy:
    """A copy of the repository."""

    folder: Path

    def command(self, study, *options):
        return [ENVIRONMENT / "python", "-m", "springtune", "run", f"config/{study}.yaml", *options]

    def environment(self):
        path = f"{ENVIRONMENT}{os.pathsep}{os.environ['PATH']}"
        return os.environ | {"PYTHONPATH": str(self.folder / "src"), "PATH": path}

    def run(self, study, *options):
        """Output of a run that ends well."""
        command = list(map(str, self.command(study, *options)))
        done = subprocess.run(command, cwd=self.folder, env=self.environment(), capture_output=True, text=True)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    @contextmanager
    def running(self, study, *options):
        """Context of a run: the process, and the file of what it says."""
        log = self.folder / f"{study}.log"
        with open(log, "w") as file:
            command = list(map(str, self.command(study, *options)))
            process = subprocess.Popen(command, cwd=self.folder, env=self.environment(), stdout=file, stderr=file)
        try:
            yield process, log
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.wait()


def copied(folder):
    """A copy of the repository as it is in a folder, what is not committed included."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    files = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True).stdout
    for file in filter(None, files.split("\0")):
        if os.path.lexists(REPOSITORY / file):
            (folder / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(REPOSITORY / file, folder / file, follow_symlinks=False)
    shutil.copy(Path(__file__).with_name("two_thousand.yaml"), folder / "config")
    return Copy(folder)
