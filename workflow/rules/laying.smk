"""Strips laid on a trapezoid."""


use rule mesh as laying with:
    message:
        "Laying the strips, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/laying_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("laying"),
    params:
        tasks=str(RESULTS / "tasks/laying_{bundle}.json"),
        digest=digest("laying_{bundle}"),
    resources:
        runtime=minutes("laying_{bundle}"),
        mem_mb=megabytes("laying_{bundle}"),
    log:
        RESULTS / "logs/laying_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/laying_{bundle}.tsv"
