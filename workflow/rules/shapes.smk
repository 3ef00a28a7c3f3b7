"""Shapes of any outline: meshes, references and networks."""


use rule mesh as shape_reference with:
    message:
        "Solving the references of shapes, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/shape_reference_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("shape_reference"),
    params:
        tasks=str(RESULTS / "tasks/shape_reference_{bundle}.json"),
        digest=digest("shape_reference_{bundle}"),
    resources:
        runtime=minutes("shape_reference_{bundle}"),
        mem_mb=megabytes("shape_reference_{bundle}"),
    log:
        RESULTS / "logs/shape_reference_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/shape_reference_{bundle}.tsv"


use rule mesh as shape_mesh with:
    message:
        "Meshing shapes, bundle {wildcards.bundle}"
    output:
        RESULTS / "done/shape_mesh_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("shape_mesh"),
    params:
        tasks=str(RESULTS / "tasks/shape_mesh_{bundle}.json"),
        digest=digest("shape_mesh_{bundle}"),
    resources:
        runtime=minutes("shape_mesh_{bundle}"),
        mem_mb=megabytes("shape_mesh_{bundle}"),
    log:
        RESULTS / "logs/shape_mesh_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/shape_mesh_{bundle}.tsv"


use rule mesh as shape_solve with:
    message:
        "Solving the networks of shapes, bundle {wildcards.bundle}"
    input:
        RESULTS / "done/shape_mesh_{bundle}.json",
    output:
        RESULTS / "done/shape_solve_{bundle}.json",
    wildcard_constraints:
        bundle=bundles("shape_solve"),
    params:
        tasks=str(RESULTS / "tasks/shape_solve_{bundle}.json"),
        digest=digest("shape_solve_{bundle}"),
    resources:
        runtime=minutes("shape_solve_{bundle}"),
        mem_mb=megabytes("shape_solve_{bundle}"),
    log:
        RESULTS / "logs/shape_solve_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/shape_solve_{bundle}.tsv"
