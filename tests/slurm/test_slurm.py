"""Studies on a cluster: the same bytes as on one machine, whatever becomes of nodes and jobs on the way."""

import re
import signal
import sys
from pathlib import Path

import psutil
import pytest
from cluster import NODES, PATIENCE, asked, until
from studies import REPOSITORY, jobs

sys.path.insert(0, str(REPOSITORY / "tests/faults"))
from driven import contents, differences

pytestmark = pytest.mark.slow

OF_THE_RUN = ("tasks", "done", "logs", "benchmarks")
"""Folders of what a run notes of its jobs: there are others on a cluster."""

TIMED = re.compile("benchmark|speed|which_definition.md|summary.txt")
"""Files, and the group of a dataset, that tell how fast the machine was."""


def made(copy, study):
    """What files of a study hold, without times and without what depends on them."""
    found = contents(copy.folder / "results" / study)
    found["dataset.nc"] = {name: one for name, one in found["dataset.nc"].items() if not TIMED.search(name)}
    return {
        path: one for path, one in found.items() if Path(path).parts[0] not in OF_THE_RUN and not TIMED.search(path)
    }


@pytest.fixture(scope="module")
def here(copies):
    """A copy in which studies are run without Slurm."""
    return copies("here")


@pytest.fixture
def there(copies, slurm):
    """A fresh copy, for studies on the cluster."""
    return copies("there")


def test_the_quick_study_is_the_same_there(here, there):
    here.run("quick")
    output = there.run("quick", "--workflow-profile", "slurm")
    assert "exit" not in output
    found = made(there, "quick")
    assert differences(found, made(here, "quick")) == [] and "dataset.nc" in found
    # Each job ran once, and on both nodes.
    mine = jobs()
    assert {job.state for job in mine} == {"COMPLETED"} and {job.node for job in mine} == {*NODES}
    # What was made there is not made again here, although bundles would be others.
    assert "Nothing to be done" in there.run("quick")
    assert "Nothing to be done" in there.run("quick", "--workflow-profile", "slurm")


def running(rule, besides, nodes=NODES):
    """A job of a rule that runs on one of some nodes."""

    def found():
        active = (job for job in jobs() if job.state == "RUNNING" and job.number not in besides)
        return next((job for job in active if rule in job.rule and job.node in nodes), None)

    return until(found)


def state(number):
    return next(job.state for job in jobs() if job.number == number)


def stop(number):
    """Stop the processes of a job, which then does not end by itself."""
    for process in psutil.process_iter():
        try:
            if process.environ().get("SLURM_JOB_ID") == number and "snakemake" in process.cmdline():
                process.send_signal(signal.SIGSTOP)
        except psutil.Error:
            continue


def test_two_thousand_scenes_survive_drains_cancels_failures_and_limits(here, there):
    before = {job.number for job in jobs()}
    short = ("--config", "job_minutes=0.0005")
    with there.running("two_thousand", "--workflow-profile", "slurm", *short) as (process, log):
        # A job that does not end within its time.
        hung = running("rule_mesh", before)
        until(lambda: stop(hung.number) or _is_stopped(hung.number))
        asked("scontrol", "update", f"JobId={hung.number}", "TimeLimit=1")
        # A node that fails: Slurm has its jobs in the queue again, and lets them wait for two minutes.
        (failing,) = {*NODES} - {hung.node}
        lost = running("rule_", before, [failing])
        asked("scontrol", "update", f"NodeName={failing}", "State=DOWN", "Reason=test")
        until(lambda: state(lost.number) == "PENDING")
        asked("scontrol", "update", f"NodeName={failing}", "State=RESUME")
        # A node that is drained: no other job comes. A job that somebody cancels.
        asked("scontrol", "update", f"NodeName={hung.node}", "State=DRAIN", "Reason=test")
        cancelled = running("rule_", {*before, hung.number, lost.number}, [failing])
        asked("scancel", cancelled.number)
        until(lambda: state(hung.number) == "TIMEOUT")
        asked("scontrol", "update", f"NodeName={hung.node}", "State=RESUME")
        assert process.wait(PATIENCE) == 0, log.read_text()
    here.run("two_thousand")
    found = made(there, "two_thousand")
    assert differences(found, made(here, "two_thousand")) == [] and "dataset.nc" in found
    assert not list(there.folder.rglob("*.unfinished"))

    mine = [job for job in jobs() if job.number not in before]
    ended = {job.number: job.state for job in mine if job.state != "COMPLETED"}
    assert ended == {hung.number: "TIMEOUT", cancelled.number: "CANCELLED"}
    for failed in (hung, cancelled):
        (again,) = (job for job in mine if job.rule == failed.rule and job.number != failed.number)
        assert _seconds(again.limit) == 2 * _seconds(failed.limit)
        assert int(again.memory.rstrip("M")) == 2 * int(failed.memory.rstrip("M"))


def _is_stopped(number):
    found = []
    for process in psutil.process_iter():
        try:
            if process.environ().get("SLURM_JOB_ID") == number and "snakemake" in process.cmdline():
                found.append(process.status() == psutil.STATUS_STOPPED)
        except psutil.Error:
            continue
    return found and all(found)


def _seconds(text):
    """Seconds of a time as Slurm tells it: days-hours:minutes:seconds, from the right on."""
    days, _, rest = text.rpartition("-")
    parts = [int(part) for part in rest.split(":")]
    return 86400 * int(days or 0) + sum(part * 60**place for place, part in enumerate(reversed(parts)))
