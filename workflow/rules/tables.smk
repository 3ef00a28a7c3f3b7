"""Tables and pages of text, one rule an output that has any."""

TABLES = []
PAGE_TABLES = [f"kinds.{kind.name}.tables" for kind in kinds() if kind.tables]

for made in plan.outputs():
    if made.tables(STUDY) and made.name in STUDY.outputs:
        TABLES += [RESULTS / "tables" / name for name in made.tables(STUDY)]

        rule:
            name:
                f"tables_{made.name}"
            message:
                f"Writing the tables of {made.name}"
            input:
                dataset=rules.collect.output,
                code=modules("campaign.tabulate", made.write, *(PAGE_TABLES if made.write == "campaign.page" else [])),
                template=PACKAGE / "output/page.html",
            output:
                [RESULTS / "tables" / name for name in made.tables(STUDY)],
            params:
                folder=str(RESULTS / "tables"),
                module=made.write,
            log:
                RESULTS / "logs" / f"tables_{made.name}.log",
            benchmark:
                RESULTS / "benchmarks" / f"tables_{made.name}.tsv"
            shell:
                "python -m springtune.campaign.tabulate {input.dataset} {params.folder} {params.module} > {log} 2>&1"
