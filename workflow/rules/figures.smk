from springtune.kinds.base import FORMATS

DRAWN = {}  # outputs with figures by the job that draws them
for one in outputs().values():
    if one.plot:
        DRAWN.setdefault(one.drawn_by, []).append(one)

FIGURES = {
    job: [RESULTS / "figures" / f"{stem}.{ending}" for one in made for stem in one.stems(STUDY) for ending in FORMATS]
    for job, made in DRAWN.items()
}


for job, made in DRAWN.items():

    rule:
        name:
            f"figures_{job}"
        message:
            f"Drawing figures: {', '.join(one.name for one in made)}"
        input:
            dataset=rules.collect.output,
            code=sorted({path for one in made for path in (*modules("campaign.draw"), *modules(one.module))}),
        output:
            FIGURES[job],
        params:
            folder=str(RESULTS / "figures"),
            outputs=[one.name for one in made if one.name in STUDY.outputs],
        log:
            RESULTS / f"logs/figures_{job}.log",
        benchmark:
            RESULTS / f"benchmarks/figures_{job}.tsv"
        priority: 1  # before the tables: what takes longest comes first
        shell:
            "python -m springtune.campaign.draw {input.dataset} {params.folder} {params.outputs} > {log} 2>&1"


rule figures_all:
    input:
        FIGURES.values(),
