# A parameter study of mass-spring models: from config/<study>.yaml to results/<study>/dataset.nc and what is read from it.
#
#     snakemake                                          the paper's study
#     snakemake --configfile config/quick.yaml           another one
#     snakemake paper                                    the paper, and the studies that it reads
#
# Jobs run on the packages that Snakemake sees, since keys of results have their versions; so rules name no environment.


from snakemake.utils import min_version

min_version("9.8")


include: "workflow/rules/common.smk"


rule all:
    message:
        f"{RESULTS} is complete"
    input:
        # Stages, too, so that missing stored results are made again.
        [job.record for job in JOBS.values()],
        [job.products for job in JOBS.values() if not job.stage],


include: "workflow/rules/stages.smk"
include: "workflow/rules/outputs.smk"


if Path(rules.collect.output.dataset) != RESULTS / plan.DATASET:
    refused("module of springtune: results are in results/<study> and take no other prefix; leave the prefix out")


if config.get("paper", True):  # a study that is read for the paper has none of its own

    include: "workflow/rules/paper.smk"


if not IS_MODULE:

    report: "workflow/report/study.rst"


onstart:
    begin()


onsuccess:
    end("success_report")


onerror:
    end("failure_report")
