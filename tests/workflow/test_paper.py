"""`snakemake paper`: the studies that it reads in one run, and what it costs the others."""

import re

from tables import STUDIES

NAMES = ("paper", "definitions", "block", "laying", "stability", "benchmark", "shapes")


def write(run):
    """The studies of the paper, each of one scene, of which each has another beam."""
    for height, name in enumerate(NAMES, 10):
        run.write(f"{name}.yaml", STUDIES["smallest"].replace("height: 10", f"height: {height}"))


def jobs(output):
    """Rules of the jobs of a dry run."""
    return set(re.findall(r"^(\w+) +\d+$", output, re.MULTILINE))


def test_the_paper_takes_all_its_studies_and_another_target_takes_one(run):
    write(run)
    code, output = run.snakemake("paper.yaml", "-n", "paper")
    assert code == 0, output
    assert {"paper", "collect", *(f"{name}_collect" for name in NAMES[1:])} <= jobs(output)
    code, output = run.snakemake("definitions.yaml", "-n")
    assert code == 0, output
    assert {"collect", "mesh", "solve"} <= jobs(output) and not {"paper", "block_collect"} & jobs(output)
