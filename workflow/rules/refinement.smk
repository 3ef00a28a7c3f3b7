"""Refinement of a sweep where errors matter."""


use rule mesh as refinement with:
    message:
        "Refining where errors matter, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/refinement_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("refinement"),
    params:
        tasks=str(RESULTS / "tasks/refinement_{bundle}.json"),
        digest=digest("refinement_{bundle}"),
    resources:
        runtime=minutes("refinement_{bundle}"),
        mem_mb=megabytes("refinement_{bundle}"),
    log:
        RESULTS / "logs/refinement_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/refinement_{bundle}.tsv"
