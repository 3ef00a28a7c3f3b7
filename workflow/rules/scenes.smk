"""Scenes of beams: meshes, references, sensitivity curves, calibration, and networks in equilibrium.

All rules run `run_tasks`: which module does a job, such as kinds/scenes/solve.py, stands in its file of tasks.
"""


rule mesh:
    message:
        "Meshing, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/mesh_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("mesh"),
    params:
        # The file of tasks is written when a run begins, so that reading the Snakefile writes nothing.
        tasks=str(RESULTS / "tasks/mesh_{bundle}.json"),
        digest=digest("mesh_{bundle}"),
    threads: 1
    resources:
        runtime=minutes("mesh_{bundle}"),
        mem_mb=megabytes("mesh_{bundle}"),
    log:
        RESULTS / "logs/mesh_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/mesh_{bundle}.tsv"
    conda:
        ENVIRONMENT
    shell:
        "python -m springtune.studies.runs.run_tasks {params.tasks:q} {output:q} {params.digest:q} > {log:q} 2>&1"


use rule mesh as reference with:
    message:
        "Solving the finite-element references, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/reference_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("reference"),
    params:
        tasks=str(RESULTS / "tasks/reference_{bundle}.json"),
        digest=digest("reference_{bundle}"),
    resources:
        runtime=minutes("reference_{bundle}"),
        mem_mb=megabytes("reference_{bundle}"),
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
    wildcard_constraints:
        bundle=bundles("sensitivity"),
    params:
        tasks=str(RESULTS / "tasks/sensitivity_{bundle}.json"),
        digest=digest("sensitivity_{bundle}"),
    resources:
        runtime=minutes("sensitivity_{bundle}"),
        mem_mb=megabytes("sensitivity_{bundle}"),
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
    wildcard_constraints:
        bundle=bundles("calibrate"),
    params:
        tasks=str(RESULTS / "tasks/calibrate_{bundle}.json"),
        digest=digest("calibrate_{bundle}"),
    resources:
        runtime=minutes("calibrate_{bundle}"),
        mem_mb=megabytes("calibrate_{bundle}"),
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
    wildcard_constraints:
        bundle=bundles("solve"),
    params:
        tasks=str(RESULTS / "tasks/solve_{bundle}.json"),
        digest=digest("solve_{bundle}"),
    resources:
        runtime=minutes("solve_{bundle}"),
        mem_mb=megabytes("solve_{bundle}"),
    log:
        RESULTS / "logs/solve_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/solve_{bundle}.tsv"
