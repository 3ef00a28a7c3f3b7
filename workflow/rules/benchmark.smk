"""The benchmark of run time against error."""


use rule mesh as benchmark with:
    message:
        "Timing approaches, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/benchmark_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("benchmark"),
    params:
        tasks=str(RESULTS / "tasks/benchmark_{bundle}.json"),
        digest=digest("benchmark_{bundle}"),
    # Other jobs would be in its seconds. On a cluster a node of its own is for the profile to ask for.
    threads: CORES
    resources:
        runtime=minutes("benchmark_{bundle}"),
        mem_mb=megabytes("benchmark_{bundle}"),
    log:
        RESULTS / "logs/benchmark_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/benchmark_{bundle}.tsv"
