from springtune.output.names import FORMATS, of_study

FIGURES = {
    kind: [RESULTS / "figures" / f"{stem}.{ending}" for stem in stems for ending in FORMATS]
    for kind, stems in of_study(STUDY).items()
}


rule figures_sensitivity:
    message:
        "Drawing the sensitivity curves"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.figures_sensitivity"),
    output:
        FIGURES["sensitivity"],
    params:
        folder=str(RESULTS / "figures"),
    log:
        RESULTS / "logs/figures_sensitivity.log",
    benchmark:
        RESULTS / "benchmarks/figures_sensitivity.tsv"
    shell:
        "python -m springtune.campaign.figures_sensitivity {input.dataset} {params.folder} > {log} 2>&1"


rule figures_scenes:
    message:
        "Drawing errors against mesh size and deformed networks"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.figures_scenes"),
    output:
        FIGURES["size"],
        FIGURES["deformed"],
    params:
        folder=str(RESULTS / "figures"),
        kinds=[kind for kind in ("size", "deformed") if FIGURES[kind]],
    log:
        RESULTS / "logs/figures_scenes.log",
    benchmark:
        RESULTS / "benchmarks/figures_scenes.tsv"
    shell:
        "python -m springtune.campaign.figures_scenes {input.dataset} {params.folder} {params.kinds} > {log} 2>&1"


rule figures_definitions:
    message:
        "Drawing the comparison of definitions"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.figures_definitions"),
    output:
        FIGURES["definitions"],
    params:
        folder=str(RESULTS / "figures"),
    log:
        RESULTS / "logs/figures_definitions.log",
    benchmark:
        RESULTS / "benchmarks/figures_definitions.tsv"
    shell:
        "python -m springtune.campaign.figures_definitions {input.dataset} {params.folder} > {log} 2>&1"


rule figures_block:
    message:
        "Drawing the pressed block"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.figures_block"),
    output:
        FIGURES["block"],
    params:
        folder=str(RESULTS / "figures"),
    log:
        RESULTS / "logs/figures_block.log",
    benchmark:
        RESULTS / "benchmarks/figures_block.tsv"
    shell:
        "python -m springtune.campaign.figures_block {input.dataset} {params.folder} > {log} 2>&1"


rule figures_laying:
    message:
        "Drawing the laid strips"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.figures_laying"),
    output:
        FIGURES["laying"],
    params:
        folder=str(RESULTS / "figures"),
    log:
        RESULTS / "logs/figures_laying.log",
    benchmark:
        RESULTS / "benchmarks/figures_laying.tsv"
    shell:
        "python -m springtune.campaign.figures_laying {input.dataset} {params.folder} > {log} 2>&1"


rule figures_stability:
    message:
        "Drawing the experiments on stability"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.figures_stability"),
    output:
        FIGURES["stability"],
    params:
        folder=str(RESULTS / "figures"),
    log:
        RESULTS / "logs/figures_stability.log",
    benchmark:
        RESULTS / "benchmarks/figures_stability.tsv"
    shell:
        "python -m springtune.campaign.figures_stability {input.dataset} {params.folder} > {log} 2>&1"


rule figures_benchmark:
    message:
        "Drawing the benchmark"
    input:
        dataset=rules.collect.output,
        code=modules("campaign.figures_benchmark"),
    output:
        FIGURES["benchmark"],
    params:
        folder=str(RESULTS / "figures"),
    log:
        RESULTS / "logs/figures_benchmark.log",
    benchmark:
        RESULTS / "benchmarks/figures_benchmark.tsv"
    shell:
        "python -m springtune.campaign.figures_benchmark {input.dataset} {params.folder} > {log} 2>&1"


rule figures_all:
    input:
        FIGURES.values(),
