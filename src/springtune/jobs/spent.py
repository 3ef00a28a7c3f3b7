"""What the tasks of a job cost."""

import time
from collections import defaultdict


class Spent:
    """What the tasks of a job cost, for the file that says it is done."""

    def __init__(self):
        self.start_up = time.process_time()  # spent on imports so far
        self.sums = defaultdict(lambda: [0, 0.0, 0.0])

    def add(self, kind, units, seconds):
        """Count a task of a kind, its particles (or what else its cost grows with) and its seconds."""
        sums = self.sums[kind]
        sums[0] += 1
        sums[1] += units
        sums[2] += seconds

    def summary(self):
        """Number of tasks, sum of their units and of their seconds by kind."""
        return {"start_up": self.start_up, "work": dict(self.sums)}
