"""Experiments on numerical stability."""


use rule mesh as stability with:
    message:
        "Experiments on stability, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/stability_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("stability"),
    params:
        tasks=str(RESULTS / "tasks/stability_{bundle}.json"),
        digest=digest("stability_{bundle}"),
    resources:
        runtime=minutes("stability_{bundle}"),
        mem_mb=megabytes("stability_{bundle}"),
    log:
        RESULTS / "logs/stability_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/stability_{bundle}.tsv"
