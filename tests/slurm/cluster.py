"""A cluster of two nodes on this machine: munged, slurmctld and two slurmd of Debian's packages, without systemd.

Needs root. `with cluster(folder):` leaves the machine as it was: as long as there is a slurm.conf and no slurmctld,
every start of Snakemake in an environment with the plugin takes ten seconds.
"""

import os
import platform
import shutil
import subprocess
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import psutil

CONFIG = Path("/etc/slurm/slurm.conf")
"""Where programs within jobs look for it, whatever SLURM_CONF says."""

MUNGE = Path("/run/munge")

NODES = ("springtune1", "springtune2")

PATIENCE = 3600
"""Seconds after which nothing more is expected; what a busy machine does later than an idle one is no failure."""

TEXT = Path(__file__).with_name("slurm.conf").read_text()

NODE = "NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={cpus} RealMemory={memory}"


class CannotError(Exception):
    """Why there can be no cluster on this machine."""


def install():
    """Install Slurm, where it is not."""
    if all(map(shutil.which, ("slurmctld", "slurmd", "munged"))):
        return
    if os.geteuid() or not shutil.which("apt-get"):
        raise CannotError("slurm-wlm and munge are not installed, and only root can: apt-get install slurm-wlm munge")
    quietly = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    options = ["-qq", "-o", "DPkg::Lock::Timeout=300"]
    for command in (["update"], ["install", "-y", "--no-install-recommends", "slurm-wlm", "munge"]):
        subprocess.run(["apt-get", *options, *command], check=True, env=quietly)


def asked(*command):
    """What a command of Slurm prints."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, f"{' '.join(command)}: {done.stderr}"
    return done.stdout


def until(condition, every=0.2):
    """Wait until a condition holds, and return what it found."""
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end, f"not within {PATIENCE} s"
        time.sleep(every)
    return found


def _answers():
    done = subprocess.run(["sinfo", "-h", "-N", "-o", "%N %t"], capture_output=True, text=True)
    return done.stdout.split().count("idle") == len(NODES)


@contextmanager
def _running(*command, log):
    """A program in the foreground, ended at the end."""
    with open(log, "ab") as file:
        process = subprocess.Popen(command, stdout=file, stderr=file, stdin=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@contextmanager
def cluster(folder):
    """The cluster, as long as this context lasts; its files are in a folder."""
    install()
    if os.geteuid():
        raise CannotError("only root can start slurmd")
    if CONFIG.exists():
        raise CannotError(f"{CONFIG} is there: this machine belongs to a cluster")
    folder.mkdir(parents=True)
    (folder / "state").mkdir()
    host = platform.node().partition(".")[0]
    of_node = {"host": host, "cpus": os.cpu_count(), "memory": psutil.virtual_memory().total // 2**20}
    nodes = [NODE.format(name=name, port=16900 + number, **of_node) for number, name in enumerate(NODES)]
    with ExitStack() as stack:
        stack.callback(CONFIG.unlink, missing_ok=True)
        CONFIG.write_text(TEXT.format(host=host, folder=folder, nodes="\n".join(nodes)))
        if subprocess.run(["munge", "-n"], capture_output=True).returncode:
            if not MUNGE.exists():
                MUNGE.mkdir(mode=0o755)
                stack.callback(shutil.rmtree, MUNGE)
                shutil.chown(MUNGE, "munge", "munge")
            munged = "setpriv --reuid=munge --regid=munge --clear-groups munged --foreground"
            stack.enter_context(_running(*munged.split(), log=folder / "munged.out"))
            until(lambda: not subprocess.run(["munge", "-n"], capture_output=True).returncode)
        stack.enter_context(_running("slurmctld", "-D", "-c", log=folder / "slurmctld.out"))
        for name in NODES:
            stack.enter_context(_running("slurmd", "-D", "-N", name, log=folder / f"slurmd.{name}.out"))
        until(_answers)
        stack.callback(_empty)
        yield


def _empty():
    """Cancel what is left, and wait until it is gone."""
    subprocess.run(["scancel", "--full", "--user", "root"], capture_output=True)
    until(lambda: not asked("squeue", "-h"))
