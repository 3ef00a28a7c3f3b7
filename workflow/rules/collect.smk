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
        dataset=RESULTS / "dataset.nc",
        summary=report(
            RESULTS / "summary.txt", caption="../report/summary.rst", category="summary", labels={"name": "summary"}
        ),
    params:
        folder=lambda wildcards, output: str(Path(output.dataset).parent),
    log:
        RESULTS / "logs/collect.log",
    benchmark:
        RESULTS / "benchmarks/collect.tsv"
    shell:
        "python -m springtune.campaign.collect {input.config} {params.folder} {output.dataset} > {log} 2>&1"
