"""Measure how the workflow scales with the number of scenes, see docs/scale.md; `make scale`.

Studies of a thousand, of ten thousand and of a hundred thousand scenes are planned, run and collected, each step in a
process of its own, whose seconds and memory the system tells. The largest one is not solved: its results are written
by the store's own writer, in the layout of a run.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
"""The checkout."""

SIZES = {1_000: (5, 5, 1), 10_000: (10, 5, 5), 100_000: (50, 5, 10)}
"""Beams, Poisson's ratios and forces of a study by its number of scenes: 40 for each of their combinations."""

MESH_SIZES = "[5 mm, 4 mm, 3 mm, 2.5 mm, 2 mm]"


def study(beams: int, ratios: int, forces: int) -> str:
    """A study of so many beams, Poisson's ratios and forces, as YAML."""
    bodies = {f"b{number}": (50 + 2 * number, 10 + 5 * (number % 5)) for number in range(beams)}
    declared = "\n".join(f"  {name}: {{length: {x} mm, height: {y} mm}}" for name, (x, y) in bodies.items())
    force = f"{{from: 100 N, to: 1 kN, points: {forces}}}" if forces > 1 else "1 kN"
    return f"""title: How far this goes
beams:
{declared}
materials:
  steel: {{young_modulus: 210 GPa, poisson_ratio: 0.3}}
outputs: tables
grids:
  all:
    beam: [{", ".join(bodies)}]
    mesh_type: structured
    mesh_size: {MESH_SIZES}
    material: steel
    poisson_ratio: {{from: 0.1, to: 0.5, points: {ratios}}}
    load: [traction, compression]
    force: {force}
    definition: [uniform, area]
    kinematics: [nonlinear, linear]
    sensitivity: false
"""


def measured(command: list[str], folder: Path) -> dict[str, float]:
    """Seconds by the clock and of the processor, and peak memory [MB] of a process and of those that it waits for."""
    begin = time.perf_counter()
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)}: ended with status {process.returncode}")
    seconds = time.perf_counter() - begin
    return {"seconds": seconds, "processor": usage.ru_utime + usage.ru_stime, "memory": usage.ru_maxrss / 1e3}


if __name__ == "__main__":
    pass
