"""Tables and pages of text, one rule an output that has any."""

TABLES = []
PAGE = ["campaign.page", *(f"kinds.{kind.name}.tables" for kind in kinds() if kind.tables)]

for made in outputs().values():
    files = plan.table_files(made, STUDY)
    if files and made.name in STUDY.outputs:
        TABLES += [RESULTS / "tables" / name for name in files]

        rule:
            name:
                f"tables_{made.name}"
            message:
                f"Writing the tables of {made.name}"
            input:
                dataset=rules.collect.output,
                code=modules("campaign.tabulate", *(PAGE if made.page else [made.write])),
                template=PACKAGE / "output/page.html" if made.page else [],
            output:
                [RESULTS / "tables" / name for name in files],
            params:
                folder=str(RESULTS / "tables"),
                module=PAGE[0] if made.page else made.write,
            log:
                RESULTS / "logs" / f"tables_{made.name}.log",
            benchmark:
                RESULTS / "benchmarks" / f"tables_{made.name}.tsv"
            shell:
                "python -m springtune.campaign.tabulate {input.dataset} {params.folder} {params.module} > {log} 2>&1"
