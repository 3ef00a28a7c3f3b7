"""The tasks of a job: what each costs, which limits it has, and what becomes of one that fails."""

import resource
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .task_limits import Watch


KIBI = 1024
"""Bytes in which Linux tells the memory of a process."""

LOST = "beyond limits"
"""What tasks are counted as that went beyond their limits."""


class TaskCosts:
    """What the tasks of a job cost, for the record that says it is done.

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
        """Limits of a task in words, which the failed result of one beyond them notes."""
        return self.watch.words if self.watch else ""

    def attempt(self, key: str, function: Callable[[], Any], failed: Callable[[str], dict[str, Any]]) -> Any:
        """Result of a task, a failed one where it fails for reasons of its own; None where the program is broken."""
        from .failures import own_reason  # here: what counts alone needs no definitions

        try:
            if self.watch is None:
                return function()
            with self.watch.over(key):
                return function()
        except MemoryError:
            return failed(f"not enough memory: {self.limits or 'the machine has no more'}") | {"limits": self.limits}
        except Exception as error:
            from .damage import DamagedError

            if isinstance(error, DamagedError):
                raise
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
        """What to write to the record."""
        lost = self.watch.lost if self.watch else 0
        work = dict(self.sums) | ({LOST: [lost, 0.0, 0.0]} if lost else {})
        return {"start_up": self.start_up, "work": work, "memory": most_memory()}


def most_memory() -> int:
    """Most memory that this process, or a child of it that is done, had so far [byte]."""
    most = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return most if sys.platform == "darwin" else KIBI * most
