"""Limits of tasks, kept by a child process that a task beyond them ends.

Seconds are processor time; memory is counted on top of the child's start. Systems without such limits run without.
"""

import ctypes
import mmap
import os
import resource
import signal
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from springtune.safe_io.inputs import virtual_memory

PLACES = 4096
"""Most bytes of the name of a task."""

STOPPED = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals from outside; a task causes all others itself."""

LIMITS_TOLD = "(`limits` of the study)"

PARENT_DEATH = 1
"""Linux's prctl option: signal a process when its parent ends."""


class Watch:
    """Limits of a job's tasks, and the current task."""

    def __init__(self, limits: Mapping[str, float]) -> None:
        self.seconds, self.memory = limits["seconds"], limits["memory"]
        self.words = f"at most {self.seconds:g} s and {self.memory / 1e9:g} GB for each {LIMITS_TOLD}"
        self.lost = 0
        self._name = mmap.mmap(-1, PLACES)  # shared with the child

    @contextmanager
    def over(self, key: str) -> Iterator[None]:
        """Context of a task."""
        self._write(key)
        before = resource.getrlimit(resource.RLIMIT_AS)
        used = virtual_memory()
        if used:
            # A limit that the user, or a cluster, has set for the whole job is kept.
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
        ctypes.CDLL(None).prctl(PARENT_DEATH, signal.SIGKILL)


def guarded(function: Callable[[], None], watch: Watch, lose: Callable[[str, str], None]) -> None:
    """Run a function in a child process, again after each task that ends the child."""
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
        beyond = number == signal.SIGPROF
        why = f"not done within {watch.seconds:g} s" if beyond else f"the program was ended by {number.name}"
        lose(key, f"{why}; {watch.words}")
        watch.lost += 1


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
