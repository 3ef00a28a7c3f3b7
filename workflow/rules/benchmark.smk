# A race has the machine to itself: other jobs would be in its seconds.
rule benchmark:
    message:
        "Racing scene {wildcards.race}"
    input:
        tasks=RESULTS / "tasks/benchmark_{race}.json",
        code=modules("kinds.benchmark.stage"),
    output:
        RESULTS / "done/benchmark_{race}.json",
    threads: workflow.cores
    log:
        RESULTS / "logs/benchmark_{race}.log",
    benchmark:
        RESULTS / "benchmarks/benchmark_{race}.tsv"
    shell:
        "python -m springtune.kinds.benchmark.stage {input.tasks} {output} > {log} 2>&1"
