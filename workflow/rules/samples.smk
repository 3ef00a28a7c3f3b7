"""Samples of continuous parameters."""


use rule mesh as interpolate with:
    message:
        "Interpolating the references of samples, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/interpolate_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("interpolate"),
    params:
        tasks=str(RESULTS / "tasks/interpolate_{bundle}.json"),
        digest=digest("interpolate_{bundle}"),
    resources:
        runtime=minutes("interpolate_{bundle}"),
        mem_mb=megabytes("interpolate_{bundle}"),
    log:
        RESULTS / "logs/interpolate_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/interpolate_{bundle}.tsv"


use rule mesh as sample with:
    message:
        "Solving the networks of samples, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/sample_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("sample"),
    params:
        tasks=str(RESULTS / "tasks/sample_{bundle}.json"),
        digest=digest("sample_{bundle}"),
    resources:
        runtime=minutes("sample_{bundle}"),
        mem_mb=megabytes("sample_{bundle}"),
    log:
        RESULTS / "logs/sample_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/sample_{bundle}.tsv"
