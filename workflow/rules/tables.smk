from springtune.output import table_names

TABLES = {
    kind: [RESULTS / "tables" / name for name in names] for kind, names in table_names.of_study(STUDY).items()
}


rule tables:
    message:
        "Writing the tables"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.tables"),
        page=PACKAGE / "output/page.html",
    output:
        TABLES["tables"],
    params:
        folder=str(RESULTS / "tables"),
    log:
        RESULTS / "logs/tables.log",
    benchmark:
        RESULTS / "benchmarks/tables.tsv"
    shell:
        "python -m springtune.campaign.tables {input.dataset} {params.folder} > {log} 2>&1"


rule tables_definitions:
    message:
        "Writing the tables of definitions"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.tables_definitions"),
    output:
        TABLES["definitions"],
    params:
        folder=str(RESULTS / "tables"),
    log:
        RESULTS / "logs/tables_definitions.log",
    benchmark:
        RESULTS / "benchmarks/tables_definitions.tsv"
    shell:
        "python -m springtune.campaign.tables_definitions {input.dataset} {params.folder} > {log} 2>&1"


rule tables_stability:
    message:
        "Writing the page of the experiments on stability"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.tables_stability"),
    output:
        TABLES["stability"],
    params:
        folder=str(RESULTS / "tables"),
    log:
        RESULTS / "logs/tables_stability.log",
    benchmark:
        RESULTS / "benchmarks/tables_stability.tsv"
    shell:
        "python -m springtune.campaign.tables_stability {input.dataset} {params.folder} > {log} 2>&1"


rule tables_benchmark:
    message:
        "Writing the page of the benchmark"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.tables_benchmark"),
    output:
        TABLES["benchmark"],
    params:
        folder=str(RESULTS / "tables"),
    log:
        RESULTS / "logs/tables_benchmark.log",
    benchmark:
        RESULTS / "benchmarks/tables_benchmark.tsv"
    shell:
        "python -m springtune.campaign.tables_benchmark {input.dataset} {params.folder} > {log} 2>&1"
