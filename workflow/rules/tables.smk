from springtune.tables import names as table_names


rule tables:
    message:
        "Writing the tables"
    input:
        dataset=rules.collect.output,
        code=modules("tables"),
        page=PACKAGE / "tables/page.html",
    output:
        [RESULTS / "tables" / f"{stem}.csv" for stem in table_names.of_study(STUDY)],
        RESULTS / "tables/index.html",
    params:
        folder=str(RESULTS / "tables"),
    log:
        RESULTS / "logs/tables.log",
    benchmark:
        RESULTS / "benchmarks/tables.tsv"
    shell:
        "python -m springtune.stages.tables {input.dataset} {params.folder} > {log} 2>&1"
