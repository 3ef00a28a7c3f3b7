rule mesh:
    message:
        "Meshing bundle {wildcards.bundle}"
    input:
        tasks=RESULTS / "tasks/mesh_{bundle}.json",
        code=modules("kinds.scenes.mesh"),
    output:
        RESULTS / "done/mesh_{bundle}.json",
    log:
        RESULTS / "logs/mesh_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/mesh_{bundle}.tsv"
    shell:
        "python -m springtune.kinds.scenes.mesh {input.tasks} {output} > {log} 2>&1"
