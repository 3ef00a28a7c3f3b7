"""Write the dataset of a study, all stages in this process: ``python computed.py STUDY OUTPUT``.

Any Python that has the packages runs it.
"""

import sys
import tempfile
from pathlib import Path

import springtune as st
from springtune.studies.kinds import collect
from springtune.studies.runs import attempts
from springtune.studies.runs.plan import stage_jobs

if __name__ == "__main__":
    study, output = map(Path, sys.argv[1:])
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "results"
        for job in stage_jobs(st.load_study(study), folder).values():
            attempts.do_tasks(job.stage.module, job.content)
        collect.run(st.load_study(study), folder, output)
