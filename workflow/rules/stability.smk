rule stability:
    message:
        "Experiments on stability, bundle {wildcards.bundle}"
    input:
        tasks=RESULTS / "tasks/stability_{bundle}.json",
        code=modules("kinds.stability.stage"),
    output:
        RESULTS / "done/stability_{bundle}.json",
    log:
        RESULTS / "logs/stability_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/stability_{bundle}.tsv"
    shell:
        "python -m springtune.kinds.stability.stage {input.tasks} {output} > {log} 2>&1"
