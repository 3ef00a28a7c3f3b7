"""Which tasks share a job: bundles of about equal cost, by what such tasks have cost on this machine.

One process a scene would be all start-up, so tasks are put together until start-up is a small share of a job. Jobs say
what their tasks cost (`springtune.jobs.costs`), the stage `collect` adds that up over studies (`remember`), and the
next bundles are made by it. A bundle once made keeps its tasks as long as the study asks for them: only what is new is
shared out.
"""

from collections import defaultdict
from math import ceil
from pathlib import Path

from . import atomic

COSTS = {
    "mesh": (4e-3, 2.5e-5),
    "linear": (5e-4, 1e-6),
    "nonlinear": (1.5e-3, 1e-5),
    "curve": (1.5e-3, 1e-5),
    "moduli": (5e-4, 2e-6),
    "reference": (3e-2, 0.0),
    "finite": (1.0, 0.0),
    "laying": (0.0, 1.5),
    "adjoint": (0.05, 2e-4),
    "annealed": (0.05, 1e-3),
    "evolved": (0.05, 1e-3),
    "limits": (10.0, 0.0),
    "maps": (8.0, 0.0),
    "drift": (9.0, 0.0),
    "rest": (2.0, 0.0),
    "sizes": (3.0, 0.0),
    "strains": (2.0, 0.0),
    "buckling": (2.0, 0.0),
    "slivers": (0.1, 0.0),
    "contrast": (0.1, 0.0),
    "poisson": (0.3, 0.0),
    "perturbation": (0.5, 0.0),
}
"""Seconds of a task, in any case and per particle, before any was measured; what a machine measures multiplies them.

Kinds are the scenes' kinematics, other stages' tasks, definitions that search, and experiments on stability."""

START_UP = 0.25
"""Seconds of imports of a job before any was measured."""

SPAWNED = 0.25
"""Seconds of a job's start-up that it does not see: Snakemake's share, the shell's, and those of an interpreter."""

START_SHARE = 0.05
"""Share of a job that its start-up may take."""

REMEMBERED = 20
"""A machine's costs follow the last jobs: those before count as at most so many times the work of the last run."""


class Costs:
    """What tasks cost on this machine.

    Parameters
    ----------
    path : Path
        File of `remember`; without it, costs are those of `COSTS`.
    """

    def __init__(self, path):
        known = atomic.read_json(path) if path.exists() else {}
        self.ratios = {kind: seconds / usual for kind, (usual, seconds) in known.get("kinds", {}).items() if usual}
        self.start_up = known.get("start_up", START_UP) + SPAWNED

    def of(self, kind, units=0.0):
        """Seconds of a task."""
        return self.ratios.get(kind, 1.0) * _usual(kind, 1, units)


def _usual(kind, count, units):
    always, each = COSTS[kind]
    return always * count + each * units


def remember(path, done):
    """Add what the jobs of a run did to what is known of the machine.

    Parameters
    ----------
    path : Path
        JSON file: sums of usual and of measured seconds by kind, and a job's imports.
    done : iterable of Path
        Files of jobs that hold a `Work.summary`; those older than the file at `path` are in it already.
    """
    known = atomic.read_json(path) if path.exists() else {"kinds": {}}
    since = path.stat().st_mtime if path.exists() else 0.0
    notes = [atomic.read_json(file) for file in done if file.stat().st_mtime > since]
    sums = defaultdict(lambda: [0.0, 0.0])
    for note in notes:
        for kind, (count, units, seconds) in note.get("work", {}).items():
            if kind in COSTS:
                sums[kind][0] += _usual(kind, count, units)
                sums[kind][1] += seconds
    for kind, (usual, seconds) in sums.items():
        before = known["kinds"].get(kind, [0.0, 0.0])
        fade = min(1.0, REMEMBERED * usual / before[0]) if before[0] else 0.0
        known["kinds"][kind] = [fade * before[0] + usual, fade * before[1] + seconds]
    starts = sorted(note["start_up"] for note in notes if note.get("work"))
    if starts:
        known["start_up"] = starts[len(starts) // 2]
        atomic.write_json(path, known)


def share_out(costs, cores, start_up, before):
    """Bundles of about equal cost.

    Parameters
    ----------
    costs : dict of str to float
        Seconds of each task by name.
    cores : int
        As many bundles are made at least, unless start-up were most of their work.
    start_up : float
        Seconds of a job's start-up.
    before : dict of str to list of str
        Bundles made before; what they hold stays there.

    Returns
    -------
    dict of str to list of str
        Names of the tasks of each bundle by its label.
    """
    bundles = {label: [name for name in names if name in costs] for label, names in before.items()}
    bundles = {label: names for label, names in bundles.items() if names}
    new = sorted(costs.keys() - {name for names in bundles.values() for name in names}, key=lambda n: (-costs[n], n))
    if not new:
        return bundles
    size = start_up / START_SHARE
    load = {label: sum(costs[name] for name in names) for label, names in bundles.items()}
    wanted = _number(sum(costs.values()), size, start_up, cores, len(costs))
    labels = (str(number) for number in range(len(load) + wanted) if str(number) not in load)
    while len(load) < wanted:
        load[next(labels)] = 0.0
    # What is new goes to the bundles that have least, so that only those run again.
    count = _number(sum(costs[name] for name in new), size, start_up, cores, len(new))
    chosen = sorted(load, key=lambda label: (load[label], int(label)))[:count]
    added = dict.fromkeys(chosen, 0.0)
    for name in new:
        least = min(chosen, key=lambda label: (added[label], load[label], int(label)))
        bundles.setdefault(least, []).append(name)
        added[least] += costs[name]
    return {label: bundles[label] for label in sorted(bundles, key=int)}


def _number(seconds, size, start_up, cores, most):
    """Number of bundles for so many seconds of work: as many on each core, if there are more than cores."""
    count = round(seconds / size)
    if count > cores:
        count = cores * ceil(count / cores)
    return max(1, min(max(count, min(cores, ceil(seconds / (2 * start_up)))), most))


def work_of(folder):
    """Files of a study's jobs that say what their tasks cost."""
    return sorted(Path(folder).glob("done/*_*.json"))
