"""The stages before the dataset: each job does a bundle of tasks and solves those whose results are not stored.

`springtune.studies.runs.job` says how; which module does a job, such as kinds/scenes/solve.py, stands in its file of
tasks. That file is written when a run begins, so that reading the Snakefile writes nothing.
"""


wildcard_constraints:
    bundle=bundles(),


# Beams.


rule mesh:
    message:
        "Meshing, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/mesh_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/mesh_{bundle}.json"),
        digest=digest("mesh_{bundle}"),
    log:
        RESULTS / "logs/mesh_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/mesh_{bundle}.tsv"
    conda:
        ENVIRONMENT
    shell:
        "python -m springtune.studies.runs.job {params.tasks:q} {output:q} {params.digest:q} > {log:q} 2>&1"


use rule mesh as reference with:
    message:
        "Solving the finite-element references, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/reference_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/reference_{bundle}.json"),
        digest=digest("reference_{bundle}"),
    log:
        RESULTS / "logs/reference_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/reference_{bundle}.tsv"


use rule mesh as sensitivity with:
    message:
        "Tracing the sensitivity curves, bundle {wildcards.bundle}"
    input:
        RESULTS / "done/mesh_{bundle}.json",
        done("reference"),
    output:
        RESULTS / "done/sensitivity_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/sensitivity_{bundle}.json"),
        digest=digest("sensitivity_{bundle}"),
    log:
        RESULTS / "logs/sensitivity_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/sensitivity_{bundle}.tsv"


use rule mesh as calibrate with:
    message:
        "Calibrating the uniform stiffness, bundle {wildcards.bundle}"
    input:
        done("sensitivity"),
    output:
        RESULTS / "done/calibrate_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/calibrate_{bundle}.json"),
        digest=digest("calibrate_{bundle}"),
    log:
        RESULTS / "logs/calibrate_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/calibrate_{bundle}.tsv"


use rule mesh as solve with:
    message:
        "Solving the networks, bundle {wildcards.bundle}"
    input:
        RESULTS / "done/mesh_{bundle}.json",
        done("reference"),
        done("calibrate"),
    output:
        RESULTS / "done/solve_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/solve_{bundle}.json"),
        digest=digest("solve_{bundle}"),
    log:
        RESULTS / "logs/solve_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/solve_{bundle}.tsv"


# Shapes of any outline.


use rule mesh as shape_mesh with:
    message:
        "Meshing shapes, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/shape_mesh_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/shape_mesh_{bundle}.json"),
        digest=digest("shape_mesh_{bundle}"),
    log:
        RESULTS / "logs/shape_mesh_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/shape_mesh_{bundle}.tsv"


use rule mesh as shape_reference with:
    message:
        "Solving the references of shapes, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/shape_reference_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/shape_reference_{bundle}.json"),
        digest=digest("shape_reference_{bundle}"),
    log:
        RESULTS / "logs/shape_reference_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/shape_reference_{bundle}.tsv"


use rule mesh as shape_solve with:
    message:
        "Solving the networks of shapes, bundle {wildcards.bundle}"
    input:
        RESULTS / "done/shape_mesh_{bundle}.json",
    output:
        RESULTS / "done/shape_solve_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/shape_solve_{bundle}.json"),
        digest=digest("shape_solve_{bundle}"),
    log:
        RESULTS / "logs/shape_solve_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/shape_solve_{bundle}.tsv"


# Further study kinds.


use rule mesh as moduli with:
    message:
        "Measuring effective moduli, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/moduli_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/moduli_{bundle}.json"),
        digest=digest("moduli_{bundle}"),
    log:
        RESULTS / "logs/moduli_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/moduli_{bundle}.tsv"


use rule mesh as laying with:
    message:
        "Laying the strips, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/laying_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/laying_{bundle}.json"),
        digest=digest("laying_{bundle}"),
    log:
        RESULTS / "logs/laying_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/laying_{bundle}.tsv"


use rule mesh as stability with:
    message:
        "Experiments on stability, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/stability_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/stability_{bundle}.json"),
        digest=digest("stability_{bundle}"),
    log:
        RESULTS / "logs/stability_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/stability_{bundle}.tsv"


use rule mesh as interpolate with:
    message:
        "Interpolating the references of samples, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/interpolate_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/interpolate_{bundle}.json"),
        digest=digest("interpolate_{bundle}"),
    log:
        RESULTS / "logs/interpolate_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/interpolate_{bundle}.tsv"


use rule mesh as sample with:
    message:
        "Solving the networks of samples, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/sample_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/sample_{bundle}.json"),
        digest=digest("sample_{bundle}"),
    log:
        RESULTS / "logs/sample_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/sample_{bundle}.tsv"


use rule mesh as benchmark with:
    message:
        "Timing approaches, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/benchmark_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/benchmark_{bundle}.json"),
        digest=digest("benchmark_{bundle}"),
    # Other jobs would be in its seconds. On a cluster a node of its own is for the profile to ask for.
    threads: workflow.cores or 1
    log:
        RESULTS / "logs/benchmark_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/benchmark_{bundle}.tsv"


use rule mesh as engines with:
    message:
        "Running scenes in engines, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/engines_{bundle}.json",
    params:
        tasks=str(RESULTS / "tasks/engines_{bundle}.json"),
        digest=digest("engines_{bundle}"),
    # Other jobs would be in its seconds. On a cluster a node of its own is for the profile to ask for.
    threads: workflow.cores or 1
    log:
        RESULTS / "logs/engines_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/engines_{bundle}.tsv"
