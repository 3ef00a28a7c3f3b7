"""What the tasks of a job cost."""

import time
from collections import defaultdict
from typing import Any


class Spent:
    """What the tasks of a job cost, for the file that says it is done.

    Examples
    --------
    >>> spent = Spent()
    >>> spent.add("linear", 231, 0.5)
    >>> spent.add("linear", 19, 0.25)
    >>> spent.summary()["work"]
    {'linear': [2, 250.0, 0.75]}
    """

    def __init__(self) -> None:
        self.start_up = time.process_time()  # spent on imports so far
        self.sums: dict[str, list[float]] = defaultdict(lambda: [0, 0.0, 0.0])

    def add(self, kind: str, units: float, seconds: float) -> None:
        """Count a task.

        Parameters
        ----------
        kind : str
        units : float
            Its particles, or what else its cost grows with.
        seconds : float
        """
        sums = self.sums[kind]
        sums[0] += 1
        sums[1] += units
        sums[2] += seconds

    def summary(self) -> dict[str, Any]:
        """What to write to the file.

        Returns
        -------
        dict
            ``start_up``, seconds spent on imports; ``work``, by kind: number of tasks, sums of their units and seconds.
        """
        return {"start_up": self.start_up, "work": dict(self.sums)}
