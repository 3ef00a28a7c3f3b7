"""The page to browse a study's results with."""


rule browse:
    message:
        "Writing the page to browse: index.html"
    input:
        dataset=rules.collect.output.dataset,
    output:
        page=report(
            RESULTS / rerun.PAGE, caption="../report/browse.rst", category="browse", labels={"name": "page to browse"}
        ),
        done=JOBS["browse"].record,
    params:
        digest=JOBS["browse"].digest,
        # What the page links to; other jobs make it meanwhile.
        files=rerun.linked(STUDY),
    log:
        RESULTS / "logs/browse.log",
    benchmark:
        RESULTS / "benchmarks/browse.tsv"
    conda:
        ENVIRONMENT
    shell:
        "python -m springtune.studies.output.browse.page {input.dataset:q} {output.page:q} {output.done:q}"
        " {params.digest:q} {params.files:q} > {log:q} 2>&1"
