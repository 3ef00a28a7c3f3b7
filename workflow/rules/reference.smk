rule reference:
    message:
        "Solving the finite-element references"
    input:
        tasks=RESULTS / "tasks/reference.json",
        code=modules("reference"),
    output:
        RESULTS / "done/reference.json",
    log:
        RESULTS / "logs/reference.log",
    benchmark:
        RESULTS / "benchmarks/reference.tsv"
    shell:
        "python -m springtune.stages.reference {input.tasks} {output} > {log} 2>&1"
