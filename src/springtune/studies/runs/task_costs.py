"""Limits and costs of a job's tasks, and what becomes of a task that fails.

A child process keeps the limits; a task beyond them ends it. Seconds are processor time; memory is counted on top of
the child's start. Systems without such limits run without.
"""

import ctypes
import mmap
import os
import resource
import signal
import sys
import time
import traceback
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from springtune.safe_io.inputs import virtual_memory

from .checked_json import DamagedError

PLACES = 4096
"""Most bytes of a task's key."""

STOPPED = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals from outside; a task causes all others itself."""

LIMITS_TOLD = "(`limits` of the study)"


class Watch:
    """Limits of a job's tasks, and the current task."""

    def __init__(self, limits: Mapping[str, float]) -> None:
        self.seconds, self.memory = limits["seconds"], limits["memory"]
        self.words = f"at most {self.seconds:g} s and {self.memory / 1e9:g} GB for each {LIMITS_TOLD}"
        self.beyond = 0
        self._name = mmap.mmap(-1, PLACES)  # shared with the child

    @contextmanager
    def over(self, key: str) -> Iterator[None]:
        """Context of a task."""
        self._write(key)
        before = resource.getrlimit(resource.RLIMIT_AS)
        used = virtual_memory()
        if used:
            # A tighter limit that a user or a cluster set for the whole job stays.
            most = [limit for limit in before if limit != resource.RLIM_INFINITY]
            resource.setrlimit(resource.RLIMIT_AS, (min([used + int(self.memory), *most]), before[1]))
        signal.setitimer(signal.ITIMER_PROF, self.seconds)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            resource.setrlimit(resource.RLIMIT_AS, before)
            self._write("")

    def under_way(self) -> str:
        """Key of the current task, or an empty string."""
        return self._name[:PLACES].rstrip(b"\0").decode()

    def _write(self, key: str) -> None:
        self._name[:PLACES] = key.encode().ljust(PLACES, b"\0")


def go_with_parent() -> None:
    """Let the kernel end this process with its parent, where it can."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def run_limited(function: Callable[[], None], watch: Watch, store_failed: Callable[[str, str], None]) -> None:
    """Run a function in a child process, and again after each task that ended the child."""
    while True:
        child = _begin(function)
        with _passed_on(child):
            _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status):
            if os.WEXITSTATUS(status):
                raise SystemExit(os.WEXITSTATUS(status))
            return
        number = signal.Signals(os.WTERMSIG(status))
        key = watch.under_way()
        if not key or number in STOPPED:
            hint = ": is the machine's memory short?" if number == signal.SIGKILL else ""
            print(f"stopped by {number.name}{hint}", file=sys.stderr)
            raise SystemExit(128 + number)
        too_long = number == signal.SIGPROF
        why = f"not done within {watch.seconds:g} s" if too_long else f"the program was ended by {number.name}"
        store_failed(key, f"{why}; {watch.words}")
        watch.beyond += 1


def _begin(function: Callable[[], None]) -> int:
    """Start a child that ends with this process."""
    parent = os.getpid()
    sys.stdout.flush()
    sys.stderr.flush()
    child = os.fork()
    if child:
        return child
    code = 1
    try:
        go_with_parent()
        if os.getppid() == parent:
            function()
            code = 0
    except SystemExit as error:
        if isinstance(error.code, str):
            print(error.code, file=sys.stderr)
        code = error.code if isinstance(error.code, int) else 1
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


@contextmanager
def _passed_on(child: int) -> Iterator[None]:
    """Context that forwards termination signals to the child."""

    def stop(number: int, frame: object) -> None:
        os.kill(child, number)

    before = {number: signal.signal(number, stop) for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def own_reason(error: Exception) -> str:
    """Return the reason of a failed task, or an empty string if the program is broken.

    Examples
    --------
    >>> own_reason(ZeroDivisionError("division by zero"))
    'ZeroDivisionError: division by zero'
    >>> own_reason(TypeError("unsupported operand"))
    ''
    """
    from springtune.mesh import MeshError  # here: most jobs have no failed task
    from springtune.springs import DefinitionError

    if isinstance(error, DefinitionError | MeshError):
        return str(error)
    told = f"{type(error).__name__}: {error}"
    if isinstance(error, RuntimeError):
        return "" if isinstance(error, NotImplementedError | RecursionError) else told
    # numpy's LinAlgError is a ValueError, and so is what scipy raises for numbers that are not finite.
    named = type(error).__name__ == "LinAlgError" or "infs or NaNs" in str(error)
    return told if named or isinstance(error, ArithmeticError) else ""


BEYOND_LIMITS = "beyond limits"
"""Name under which records count the tasks that went beyond their limits."""


class TaskCosts:
    """Costs of a job's tasks, for its record.

    Examples
    --------
    >>> costs = TaskCosts()
    >>> costs.add("linear", 231, 0.5)
    >>> costs.add("linear", 19, 0.25)
    >>> costs.summary()["work"]
    {'linear': [2, 250.0, 0.75]}
    """

    def __init__(self, watch: "Watch | None" = None) -> None:
        self.start_up = time.process_time()  # spent on imports so far
        self.sums: dict[str, list[float]] = defaultdict(lambda: [0, 0.0, 0.0])
        self.watch = watch
        self.broken: list[Exception] = []

    @property
    def limits(self) -> str:
        """Limits of a task in words; the failed result of a task beyond them stores these."""
        return self.watch.words if self.watch else ""

    def attempt(self, key: str, function: Callable[[], Any], failed: Callable[[str], dict[str, Any]]) -> Any:
        """Return the result of a task, a failed result for a reason of the task, or None if the program is broken."""
        try:
            if self.watch is None:
                return function()
            with self.watch.over(key):
                return function()
        except MemoryError:
            return failed(f"not enough memory: {self.limits or 'the machine has no more'}") | {"limits": self.limits}
        except DamagedError:
            raise
        except Exception as error:
            why = own_reason(error)
            if not why:
                self.broken.append(error)
                return None
            return failed(why)

    def add(self, kind: str, units: float, seconds: float, count: int = 1) -> None:
        """Count tasks."""
        sums = self.sums[kind]
        sums[0] += count
        sums[1] += units
        sums[2] += seconds

    def summary(self) -> dict[str, Any]:
        """Entries of the record."""
        beyond = self.watch.beyond if self.watch else 0
        work = dict(self.sums) | ({BEYOND_LIMITS: [beyond, 0.0, 0.0]} if beyond else {})
        return {"start_up": self.start_up, "work": work, "memory": most_memory()}


def most_memory() -> int:
    """Largest memory so far of this process or a finished child [byte]."""
    most = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return most if sys.platform == "darwin" else 1024 * most  # Linux reports KiB
