# Stiffnesses of calibrated scenes; a study may have none.
CALIBRATION = expand(RESULTS / "done/{name}.json", name=BUNDLES["calibrate"])


rule sensitivity:
    message:
        "Tracing the sensitivity curves of bundle {wildcards.bundle}"
    input:
        tasks=RESULTS / "tasks/sensitivity_{bundle}.json",
        meshes=RESULTS / "done/mesh_{bundle}.json",
        references=REFERENCES,
        code=modules("kinds.scenes.sensitivity"),
    output:
        RESULTS / "done/sensitivity_{bundle}.json",
    log:
        RESULTS / "logs/sensitivity_{bundle}.log",
    benchmark:
        RESULTS / "benchmarks/sensitivity_{bundle}.tsv"
    shell:
        "python -m springtune.kinds.scenes.sensitivity {input.tasks} {output} > {log} 2>&1"


rule calibrate:
    message:
        "Calibrating the uniform stiffness"
    input:
        tasks=RESULTS / "tasks/calibrate.json",
        curves=expand(RESULTS / "done/sensitivity_{bundle}.json", bundle=BUNDLES["sensitivity"]),
        code=modules("kinds.scenes.calibrate"),
    output:
        RESULTS / "done/calibrate.json",
    log:
        RESULTS / "logs/calibrate.log",
    benchmark:
        RESULTS / "benchmarks/calibrate.tsv"
    shell:
        "python -m springtune.kinds.scenes.calibrate {input.tasks} {output} > {log} 2>&1"
