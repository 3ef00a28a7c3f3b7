rule collect:
    message:
        "Comparing, and collecting the dataset"
    input:
        config=CONFIG,
        done=DONE,
        printed=STUDY.printed_path or [],
        code=modules(
            "campaign.collect",
            *(f"kinds.{name}.{part}" for name in KINDS for part in ("kind", "collect")),
            *(made.collect for made in outputs().values() if made.collect and made.name in STUDY.outputs),
        ),
    output:
        RESULTS / "dataset.nc",
    params:
        folder=str(RESULTS),
    log:
        RESULTS / "logs/collect.log",
    benchmark:
        RESULTS / "benchmarks/collect.tsv"
    shell:
        "python -m springtune.campaign.collect {input.config} {params.folder} {output} > {log} 2>&1 && cat {log}"
