"""The page to browse a study's results with."""


rule browse:
    message:
        "Writing the page to browse: index.html"
    input:
        dataset=rules.collect.output.dataset,
        again=looked_at(JOBS, due.BROWSE),
    output:
        page=report(
            RESULTS / due.PAGE, caption="../report/browse.rst", category="browse", labels={"name": "page to browse"}
        ),
        done=JOBS["browse"].record,
    params:
        digest=JOBS["browse"].digest,
        # What the page links to; other jobs make it meanwhile.
        files=due.linked(STUDY),
    resources:
        runtime=minutes(due.BROWSE),
        mem_mb=megabytes(due.BROWSE),
    log:
        RESULTS / "logs/browse.log",
    benchmark:
        RESULTS / "benchmarks/browse.tsv"
    shell:
        "python -m springtune.campaign.browse {input.dataset:q} {output.page:q} {output.done:q}"
        " {params.digest:q} {params.files:q} > {log:q} 2>&1"
