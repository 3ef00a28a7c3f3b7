# A parameter study of mass-spring models: from config/<study>.yaml to results/<study>/dataset.nc and what is read from it.
#
#     snakemake                                          the paper's study
#     snakemake --configfile config/quick.yaml           another one
#     snakemake paper                                    the paper, and the studies that it reads


from snakemake.utils import min_version

min_version("9.8")


include: "workflow/rules/environment.smk"
include: "workflow/rules/internals.smk"
include: "workflow/rules/common.smk"
include: "workflow/rules/hooks.smk"
include: "workflow/rules/stages.smk"
include: "workflow/rules/collect.smk"
include: "workflow/rules/outputs.smk"
include: "workflow/rules/browse.smk"


if config.get("paper", True):  # a study that is read for the paper has none of its own

    include: "workflow/rules/paper.smk"


if not MODULE:

    report: "workflow/report/study.rst"


rule all:
    default_target: not HAS_TARGET
    message:
        f"{RESULTS} is complete"
    input:
        # Stages, too, so that missing stored results are made again.
        STORED,
        rules.collect.output,
        OUTPUTS.values(),
        str(RESULTS / rerun.PAGE),  # no report(): the report names the rule that made it


onstart:
    begin()


onsuccess:
    log_end("ending")


onerror:
    log_end("broken")


if MODULE:
    add_hooks(onstart=begin, onsuccess=lambda: log_end("ending"), onerror=lambda: log_end("broken"))
