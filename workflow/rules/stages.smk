"""From a study to its dataset: each job does a bundle of tasks, and solves those whose results are not stored.

`common.smk` reads the study. The begin of a run writes the tasks of each job to `tasks/`; `springtune.studies.runs.job`
solves them. HDF5 files store results by key, many in one file, so the output of a job is its record in `done/`.
`digest` changes with all that a job's results depend on: parameters, code, packages.

All rules inherit params, log and command from `mesh`. The wildcard `stage` of a rule can only be its own name. Rules
that read `mesh_{bundle}` share its bundles (`Stage.like`); of `done("reference")` they need all jobs.
"""


wildcard_constraints:
    bundle=bundles(),


# Beams and shapes.


rule mesh:
    message:
        "Stage {wildcards.stage}, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/{stage,mesh}_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/{stage}_{bundle}.json"),
        digest=digest,
        study=study,
    log:
        RESULTS / "logs/{stage}_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/{stage}_{bundle}.tsv"
    shell:
        "python -m springtune.studies.runs.job {params.tasks:q} {output:q} {params.digest:q} {params.study:q}"
        " > {log:q} 2>&1"


# One finite-element solution a unit problem.
use rule mesh as reference with:
    output:
        RESULTS / "done/{stage,reference}_{bundle}.json",


# Displacement against uniform stiffness.
use rule mesh as sensitivity with:
    input:
        RESULTS / "done/mesh_{bundle}.json",
        done("reference"),
    output:
        RESULTS / "done/{stage,sensitivity}_{bundle}.json",


# The uniform stiffness of each mesh type that suits its curves best.
use rule mesh as calibrate with:
    input:
        done("sensitivity"),
    output:
        RESULTS / "done/{stage,calibrate}_{bundle}.json",


# The mass-spring networks.
use rule mesh as solve with:
    input:
        RESULTS / "done/mesh_{bundle}.json",
        done("reference"),
        done("calibrate"),
    output:
        RESULTS / "done/{stage,solve}_{bundle}.json",


# Further study kinds.
use rule mesh as moduli with:
    output:
        RESULTS / "done/{stage,moduli}_{bundle}.json",


use rule mesh as laying with:
    output:
        RESULTS / "done/{stage,laying}_{bundle}.json",


use rule mesh as stability with:
    output:
        RESULTS / "done/{stage,stability}_{bundle}.json",


use rule mesh as interpolate with:
    output:
        RESULTS / "done/{stage,interpolate}_{bundle}.json",


use rule mesh as sample with:
    output:
        RESULTS / "done/{stage,sample}_{bundle}.json",


# These two measure seconds, so nothing runs beside them. On a cluster the profile must ask for a whole node.
use rule mesh as benchmark with:
    output:
        RESULTS / "done/{stage,benchmark}_{bundle}.json",
    threads: workflow.cores or 1


use rule mesh as engines with:
    output:
        RESULTS / "done/{stage,engines}_{bundle}.json",
    threads: workflow.cores or 1


# The dataset: the results of all stages, compared with their references.
rule collect:
    message:
        "Comparing, and collecting the dataset"
    input:
        [JOBS[name].record for name in BUNDLES],
    output:
        dataset=RESULTS / plan.DATASET,
        summary=report(
            RESULTS / plan.SUMMARY, caption="../report/summary.rst", category="summary", labels={"name": "summary"}
        ),
        done=JOBS["collect"].record,
    params:
        study=study,
        folder=lambda wildcards, output: str(Path(output.dataset).parent),
        digest=JOBS["collect"].digest,
    log:
        RESULTS / "logs/collect.log",
    benchmark:
        RESULTS / "benchmarks/collect.tsv"
    shell:
        "python -m springtune.studies.kinds.collect {params.study:q} {params.folder:q} {output.dataset:q}"
        " {output.done:q} {params.digest:q} > {log:q} 2>&1"
