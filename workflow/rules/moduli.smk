rule moduli:
    message:
        "Measuring effective moduli of bundle {wildcards.bundle}"
    input:
        tasks=RESULTS / "tasks/moduli_{bundle}.json",
        code=modules("kinds.moduli.stage"),
    output:
        RESULTS / "done/moduli_{bundle}.json",
    log:
        RESULTS / "logs/moduli_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/moduli_{bundle}.tsv"
    shell:
        "python -m springtune.kinds.moduli.stage {input.tasks} {output} > {log} 2>&1"
