"""The dataset: the results of all stages, compared with their references."""


rule collect:
    message:
        "Comparing, and collecting the dataset"
    input:
        done=STORED,
    output:
        dataset=RESULTS / rerun.DATASET,
        summary=report(
            RESULTS / rerun.SUMMARY, caption="../report/summary.rst", category="summary", labels={"name": "summary"}
        ),
        done=JOBS["collect"].record,
    params:
        # A function, so that braces in the path are not wildcards.
        config=lambda wildcards: str(CONFIG),
        folder=lambda wildcards, output: str(Path(output.dataset).parent),
        digest=JOBS["collect"].digest,
    log:
        RESULTS / "logs/collect.log",
    benchmark:
        RESULTS / "benchmarks/collect.tsv"
    conda:
        ENVIRONMENT
    shell:
        "python -m springtune.studies.kinds.collect {params.config:q} {params.folder:q} {output.dataset:q}"
        " {output.done:q} {params.digest:q} > {log:q} 2>&1"
