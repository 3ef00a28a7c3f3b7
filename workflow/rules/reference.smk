REFERENCES = expand(RESULTS / "done/reference_{bundle}.json", bundle=BUNDLES["reference"])


rule reference:
    message:
        "Solving the finite-element references of bundle {wildcards.bundle}"
    input:
        tasks=RESULTS / "tasks/reference_{bundle}.json",
        code=modules("kinds.scenes.reference"),
    output:
        RESULTS / "done/reference_{bundle}.json",
    log:
        RESULTS / "logs/reference_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/reference_{bundle}.tsv"
    shell:
        "python -m springtune.kinds.scenes.reference {input.tasks} {output} > {log} 2>&1"
