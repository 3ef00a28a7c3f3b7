"""A parameter study of mass-spring models: from config/<study>.yaml to results/<study>/dataset.nc and what is read from it.

    snakemake                                          the paper's study
    snakemake --configfile config/quick.yaml           another one
"""

include: "workflow/rules/common.smk"
include: "workflow/rules/mesh.smk"
include: "workflow/rules/reference.smk"
include: "workflow/rules/sensitivity.smk"
include: "workflow/rules/solve.smk"
include: "workflow/rules/moduli.smk"
include: "workflow/rules/laying.smk"
include: "workflow/rules/stability.smk"
include: "workflow/rules/benchmark.smk"
include: "workflow/rules/collect.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/tables.smk"


rule all:
    default_target: True
    message:
        f"The study is in {RESULTS}: dataset.nc, figures, tables/index.html"
    input:
        # Stages before the dataset, too: what they store is made again where it is missing.
        REFERENCES,
        expand(RESULTS / "done/{stage}_{bundle}.json", stage=["mesh", "solve"], bundle=BUNDLES["solve"]),
        rules.collect.input.curves,
        rules.collect.input.moduli,
        rules.collect.input.laying,
        rules.collect.input.stability,
        rules.collect.input.benchmark,
        rules.collect.output,
        rules.figures_all.input,
        TABLES.values(),
