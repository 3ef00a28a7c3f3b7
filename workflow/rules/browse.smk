"""The page to browse a study's results with."""

VIEWS = [f"kinds.{name}.views" for name in KINDS if (PACKAGE / f"kinds/{name}/views.py").exists()]


rule browse:
    message:
        "Writing the page to browse: index.html"
    input:
        dataset=rules.collect.output.dataset,
        code=sorted(
            {
                *modules("campaign.browse", *VIEWS),
                *map(str, (PACKAGE / "browse/assets").iterdir()),
            }
        ),
    output:
        report(
            RESULTS / "index.html", caption="../report/browse.rst", category="browse", labels={"name": "page to browse"}
        ),
    params:
        # What the page links to; other jobs make it meanwhile.
        files=[
            str(path.relative_to(RESULTS))
            for path in map(Path, sum(OUTPUTS.values(), []))
            if path.suffix in (".png", ".html")
        ],
    log:
        RESULTS / "logs/browse.log",
    benchmark:
        RESULTS / "benchmarks/browse.tsv"
    shell:
        "python -m springtune.campaign.browse {input.dataset} {output} {params.files} > {log} 2>&1"
