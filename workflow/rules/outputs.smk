"""Figures, tables and the page to browse, from the dataset."""

MADE = plan.output_jobs(STUDY)
FIGURES_AND_TABLES = {job: [path for one in made for path in in_report(one)] for job, made in MADE.items()}

for job, made in MADE.items():  # outputs of one job share the dataset that it reads

    rule:
        name:
            job
        message:
            f"Drawing figures and writing tables: {', '.join(one.name for one in made)}"
        input:
            dataset=rules.collect.output.dataset,
        output:
            *FIGURES_AND_TABLES[job],
            done=JOBS[job].record,
        params:
            folder=lambda wildcards, output: str(Path(output.done).parents[1]),
            digest=JOBS[job].digest,
            outputs=[one.name for one in made],
        log:
            RESULTS / f"logs/{job}.log",
        benchmark:
            RESULTS / f"benchmarks/{job}.tsv"
        shell:
            "python -m springtune.studies.output.present {input.dataset:q} {params.folder:q} {output.done:q} {params.digest:q}"
            " {params.outputs:q} > {log:q} 2>&1"


rule browse:
    message:
        "Writing the page to browse: index.html"
    input:
        dataset=rules.collect.output.dataset,
    output:
        page=report(
            RESULTS / plan.PAGE, caption="../report/browse.rst", category="browse", labels={"name": "page to browse"}
        ),
        done=JOBS["browse"].record,
    params:
        digest=JOBS["browse"].digest,
        # What the page links to; other jobs make it meanwhile.
        files=plan.linked_files(STUDY),
    log:
        RESULTS / "logs/browse.log",
    benchmark:
        RESULTS / "benchmarks/browse.tsv"
    shell:
        "python -m springtune.studies.output.browse {input.dataset:q} {output.page:q} {output.done:q}"
        " {params.digest:q} {params.files:q} > {log:q} 2>&1"
