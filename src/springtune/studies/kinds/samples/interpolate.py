"""Stage `interpolate`: references of a sample's beams as a function of aspect and Poisson's ratio, or one by one."""

from pathlib import Path

from ..bodies.reference import make_interpolant
from . import draw, problem_key


def run(content, attempts):
    """Build the missing interpolants."""
    for file in content["files"]:
        (task,), pairs = file["tasks"], set()
        if file["sample"]:
            drawn = draw(**file["sample"])
            pairs = set(zip((drawn["length"] / drawn["height"]).tolist(), drawn["poisson_ratio"].tolist()))
        problems = {problem_key(task["key"], *pair): pair for pair in sorted(pairs)}
        make_interpolant(Path(content["folder"]) / f"{task['key']}.h5", task | {"problems": problems}, attempts)
