"""Snakemake in forks of this program, which has imported it: importing costs more than most runs do."""

import json
import os
import runpy
import sys

import snakemake.api
import snakemake.report.html_reporter  # noqa: F401
from snakemake.cli import get_argument_parser

# noqa: F401
from springtune.studies.runs import plan  # noqa: F401
from springtune.studies.runs.keys import stage_key
from springtune.studies.runs.plan import stages


def run(arguments, folder, environment, log):
    """Be Snakemake."""
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    for stream in (1, 2):
        os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.argv = ["snakemake", *arguments]
    runpy.run_module("snakemake", run_name="__main__")


if __name__ == "__main__":
    get_argument_parser()  # imports all plugins
    for stage in stages():
        stage_key(stage.module)  # reads the source
    for line in sys.stdin:
        if not (child := os.fork()):
            run(**json.loads(line))
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
