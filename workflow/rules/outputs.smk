"""Figures and tables from the dataset, one rule a job of outputs: those that share it share what it reads."""

MADE = rerun.output_jobs(STUDY)
REPORTED = {job: [path for one in made for path in files(one)] for job, made in MADE.items()}
OUTPUTS = {job: list(JOBS[job].products) for job in MADE}  # plain: the report is to name the job's rule

for job, made in MADE.items():

    rule:
        name:
            job
        message:
            f"Drawing figures and writing tables: {', '.join(one.name for one in made)}"
        input:
            dataset=rules.collect.output.dataset,
        output:
            *REPORTED[job],
            done=JOBS[job].record,
        params:
            folder=lambda wildcards, output: str(Path(output.done).parents[1]),
            digest=JOBS[job].digest,
            outputs=[one.name for one in made],
        log:
            RESULTS / f"logs/{job}.log",
        benchmark:
            RESULTS / f"benchmarks/{job}.tsv"
        conda:
            ENVIRONMENT
        shell:
            "python -m springtune.studies.output.present {input.dataset:q} {params.folder:q} {output.done:q} {params.digest:q}"
            " {params.outputs:q} > {log:q} 2>&1"
