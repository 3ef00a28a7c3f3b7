"""The dataset: everything that the stages stored, compared with its references."""


rule collect:
    message:
        "Comparing, and collecting the dataset"
    input:
        done=DONE,
        again=looked_at(JOBS, due.COLLECT),
    output:
        dataset=RESULTS / due.DATASET,
        summary=report(
            RESULTS / due.SUMMARY, caption="../report/summary.rst", category="summary", labels={"name": "summary"}
        ),
        done=JOBS["collect"].record,
    params:
        # As it is: braces in it are no wildcards.
        config=lambda wildcards: str(CONFIG),
        folder=lambda wildcards, output: str(Path(output.dataset).parent),
        digest=JOBS["collect"].digest,
        untold=due.untold(RESULTS, UNTOLD),
    resources:
        runtime=minutes(due.COLLECT),
        mem_mb=megabytes(due.COLLECT),
    log:
        RESULTS / "logs/collect.log",
    benchmark:
        RESULTS / "benchmarks/collect.tsv"
    shell:
        "python -m springtune.campaign.collect {params.config:q} {params.folder:q} {output.dataset:q}"
        " {output.done:q} {params.digest:q} {params.untold:q} > {log:q} 2>&1"
