rule laying:
    message:
        "Laying the strips of bundle {wildcards.bundle}"
    input:
        tasks=RESULTS / "tasks/laying_{bundle}.json",
        code=modules("kinds.laying.stage"),
    output:
        RESULTS / "done/laying_{bundle}.json",
    log:
        RESULTS / "logs/laying_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/laying_{bundle}.tsv"
    shell:
        "python -m springtune.kinds.laying.stage {input.tasks} {output} > {log} 2>&1"
