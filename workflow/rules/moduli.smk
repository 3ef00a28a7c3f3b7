"""Effective moduli of definitions."""


use rule mesh as moduli with:
    message:
        "Measuring effective moduli, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/moduli_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("moduli"),
    params:
        tasks=str(RESULTS / "tasks/moduli_{bundle}.json"),
        digest=digest("moduli_{bundle}"),
    resources:
        runtime=minutes("moduli_{bundle}"),
        mem_mb=megabytes("moduli_{bundle}"),
    log:
        RESULTS / "logs/moduli_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/moduli_{bundle}.tsv"
