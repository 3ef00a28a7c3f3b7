"""Limits of a task, by the processor's seconds and by what it takes of memory; who stops whom."""

import faulthandler
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from springtune.studies.runs.task_costs import BEYOND_LIMITS, TaskCosts, Watch, run_limited

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits are the kernel's, and another one's differ")


def spin():
    while True:
        pass


def fill():
    return bytearray(10**9)


def crash():
    faulthandler.disable()  # what pytest would say of it
    os.kill(os.getpid(), signal.SIGSEGV)


class Job:
    """Tasks with results in files, as a stage stores them."""

    def __init__(self, folder, tasks, **limits):
        self.folder, self.tasks = folder, tasks
        self.watch = Watch({"seconds": 60.0, "memory": 4e9} | limits)
        self.spent = TaskCosts(self.watch)

    def run(self):
        for key, task in self.tasks.items():
            if not (self.folder / key).exists():
                result = self.spent.attempt(key, task, lambda why: {"message": why})
                self.store(key, result)
        self.store("work", self.spent.summary()["work"])

    def store(self, key, result):
        (self.folder / key).write_text(str(result))

    def lose(self, key, why):
        self.store(key, why)

    def __call__(self):
        run_limited(self.run, self.watch, self.lose)
        return {path.name: path.read_text() for path in self.folder.iterdir()}


def test_tasks_within_limits_are_done(tmp_path):
    assert Job(tmp_path, {"a": lambda: 1, "b": lambda: 2})() == {"a": "1", "b": "2", "work": "{}"}


def test_a_task_that_does_not_end_is_lost_and_the_others_are_done(tmp_path):
    found = Job(tmp_path, {"a": lambda: 1, "endless": spin, "b": lambda: 2}, seconds=0.2)()
    assert (found["a"], found["b"]) == ("1", "2")
    assert found["endless"].startswith("not done within 0.2 s; at most 0.2 s and 4 GB for each (`limits`")
    assert BEYOND_LIMITS in found["work"]


def test_waiting_is_no_work(tmp_path):
    """Seconds are the processor's: a machine that is busy elsewhere makes no holes."""
    assert Job(tmp_path, {"waits": lambda: time.sleep(0.5)}, seconds=0.1)()["waits"] == "None"


def test_a_task_that_takes_all_memory_is_a_hole_and_the_others_are_done(tmp_path):
    found = Job(tmp_path, {"a": lambda: 1, "large": fill, "b": lambda: 2}, memory=2e8)()
    assert (found["a"], found["b"]) == ("1", "2")
    assert "not enough memory: at most 60 s and 0.2 GB" in found["large"]


def test_what_a_task_may_take_is_on_top_of_what_is_there(tmp_path):
    kept = bytearray(3 * 10**8)
    assert Job(tmp_path, {"small": lambda: len(bytearray(10**8))}, memory=2e8)()["small"] == str(10**8)
    assert len(kept) == 3 * 10**8


def test_a_limit_of_the_whole_job_is_kept(tmp_path):
    """As clusters set it (ulimit -v): what a task may take on top would be more."""
    program = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (3 * 10**9, 3 * 10**9))\n"
        "from springtune.studies.runs.task_costs import Watch\n"
        "with Watch({'seconds': 60.0, 'memory': 4e9}).over('key'):\n"
        "    print(resource.getrlimit(resource.RLIMIT_AS))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "(3000000000, 3000000000)\n", done.stderr


def test_a_crash_is_a_hole(tmp_path):
    found = Job(tmp_path, {"a": lambda: 1, "crash": crash, "b": lambda: 2})()
    assert (found["a"], found["b"]) == ("1", "2") and found["crash"].startswith("the program was ended by SIGSEGV")


def test_a_task_that_is_stopped_by_somebody_is_no_hole(tmp_path):
    job = Job(tmp_path, {"a": lambda: 1, "killed": lambda: os.kill(os.getpid(), signal.SIGKILL)})
    with pytest.raises(SystemExit) as caught:
        job()
    assert caught.value.code == 128 + signal.SIGKILL
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a"]


def test_a_crash_outside_of_tasks_ends_the_job(tmp_path):
    watch = Watch({"seconds": 60.0, "memory": 4e9})
    with pytest.raises(SystemExit):
        run_limited(crash, watch, lambda key, why: pytest.fail(key))


@pytest.mark.parametrize("error", [SystemExit("the message"), SystemExit(3), TypeError("broken")], ids=repr)
def test_errors_end_the_job(tmp_path, capfd, error):
    def fail():
        raise error

    with pytest.raises(SystemExit) as caught:
        run_limited(fail, Watch({"seconds": 60.0, "memory": 4e9}), lambda key, why: pytest.fail(key))
    assert caught.value.code == (3 if error.args == (3,) else 1)
    assert all(str(word) in capfd.readouterr().err for word in error.args if isinstance(word, str))


SLEEPER = """
import sys, time
from pathlib import Path
from springtune.studies.runs.task_costs import Watch, run_limited

def sleep():
    Path(sys.argv[1]).write_text(str(__import__("os").getpid()))
    time.sleep(600)

run_limited(sleep, Watch({"seconds": 60.0, "memory": 4e9}), print)
"""


POLLS = 12_000
"""Looks at a process before something is wrong: minutes, where it takes milliseconds."""


def gone(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT], ids=lambda one: one.name)
def test_the_child_goes_with_the_job(tmp_path, number):
    started = tmp_path / "child"
    job = subprocess.Popen([sys.executable, "-c", SLEEPER, started], stderr=subprocess.DEVNULL)
    for _ in range(POLLS):
        if started.exists() and started.read_text():
            break
        assert job.poll() is None
        time.sleep(0.01)
    child = int(started.read_text())
    job.send_signal(number)
    assert job.wait() != 0
    for _ in range(POLLS):  # the kernel's signal is on its way
        if gone(child):
            return
        time.sleep(0.01)
    pytest.fail("the child lives")
