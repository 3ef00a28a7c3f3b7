rule solve:
    message:
        "Solving the networks of bundle {wildcards.bundle}"
    input:
        tasks=RESULTS / "tasks/solve_{bundle}.json",
        meshes=RESULTS / "done/mesh_{bundle}.json",
        references=REFERENCES,
        calibration=CALIBRATION,
        code=modules("kinds.scenes.solve"),
    output:
        RESULTS / "done/solve_{bundle}.json",
    log:
        RESULTS / "logs/solve_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/solve_{bundle}.tsv"
    shell:
        "python -m springtune.kinds.scenes.solve {input.tasks} {output} {input.calibration} > {log} 2>&1"
