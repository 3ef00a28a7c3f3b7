"""Figures and tables from the dataset, one rule a job of outputs: those that share it share what it reads."""

MADE = {}  # outputs that the study asks for, by the job that makes them
for one in outputs().values():
    if one.name in STUDY.outputs:
        MADE.setdefault(one.made_by, []).append(one)

REPORTED = {job: [path for one in made for path in files(one)] for job, made in MADE.items()}
OUTPUTS = {job: list(map(str, paths)) for job, paths in REPORTED.items()}  # plain: the report is to name the job's rule

for job, made in MADE.items():

    rule:
        name:
            f"present_{job}"
        message:
            f"Drawing figures and writing tables: {', '.join(one.name for one in made)}"
        input:
            dataset=rules.collect.output.dataset,
            code=sorted({str(path) for one in made for path in code(one)}),
        output:
            REPORTED[job],
        params:
            folder=lambda wildcards, output: str(Path(output[0]).parents[1]),
            outputs=[one.name for one in made],
        log:
            RESULTS / f"logs/present_{job}.log",
        benchmark:
            RESULTS / f"benchmarks/present_{job}.tsv"
        shell:
            "python -m springtune.campaign.present {input.dataset} {params.folder} {params.outputs} > {log} 2>&1"
