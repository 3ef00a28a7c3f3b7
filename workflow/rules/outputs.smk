"""Figures and tables from the dataset, one rule a job of outputs: those that share it share what it reads."""

from springtune.kinds.base import FORMATS

MADE = {}  # outputs that the study asks for, by the job that makes them
for one in outputs().values():
    if one.name in STUDY.outputs:
        MADE.setdefault(one.made_by, []).append(one)


def files(one):
    """Figures and tables of an output."""
    figures = [RESULTS / "figures" / f"{stem}.{ending}" for stem in one.figures(STUDY) for ending in FORMATS]
    return figures + [RESULTS / "tables" / name for name in plan.table_files(one, STUDY)]


def code(one):
    """Modules that an output is made by."""
    pages = ["campaign.page", *(f"kinds.{kind.name}.tables" for kind in kinds() if kind.tables)] if one.page else []
    found = modules("campaign.present", *filter(None, (one.module, one.write)), *pages)
    return [*found, PACKAGE / "output/page.html"] if one.page else list(found)


OUTPUTS = {job: [path for one in made for path in files(one)] for job, made in MADE.items()}

for job, made in MADE.items():

    rule:
        name:
            f"present_{job}"
        message:
            f"Drawing figures and writing tables: {', '.join(one.name for one in made)}"
        input:
            dataset=rules.collect.output,
            code=sorted({str(path) for one in made for path in code(one)}),
        output:
            OUTPUTS[job],
        params:
            folder=str(RESULTS),
            outputs=[one.name for one in made],
        log:
            RESULTS / f"logs/present_{job}.log",
        benchmark:
            RESULTS / f"benchmarks/present_{job}.tsv"
        shell:
            "python -m springtune.campaign.present {input.dataset} {params.folder} {params.outputs} > {log} 2>&1"
