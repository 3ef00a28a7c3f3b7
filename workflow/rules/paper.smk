"""The paper: `snakemake paper` runs its studies if they are missing or outdated, and typesets it."""

from springtune.studies.paper import PaperError, check_typst

PAPER_SOURCE = SOURCE / "workflow/paper"
PAPER_DATASETS = [Path("results") / name / plan.DATASET for name in plan.PAPER_STUDIES]


# By the words of the command, since Snakemake has the targets after the Snakefile was read. Who wants neither the paper
# nor a job of a study that it reads need not read these studies.
TARGETS = sys.argv[1:]
PAPER_WANTED = any(word == "paper" or word.endswith("_paper") or Path(word).name == "paper.pdf" for word in TARGETS)

if PAPER_WANTED:
    PAPER = plan.paper_job(PAPER_SOURCE, PAPER_DATASETS, Path("results/paper"))
    try:  # now, and not when the studies are done
        check_typst()
    except PaperError as error:
        refused(error)

if PAPER_WANTED or any(word.startswith(tuple(f"{name}_" for name in plan.PAPER_STUDIES)) for word in TARGETS):
    for name in plan.PAPER_STUDIES:
        if name != STUDY.name:
            prefix = f"{name}_"

            module:
                name: name
                snakefile:
                    "../../Snakefile"
                config:
                    {"study": str(config_file(f"{name}.yaml", CONFIG.parent)), "paper": False}

            use rule * from name exclude all as prefix*


rule paper:
    message:
        "Setting the paper from the datasets of its studies"
    input:
        datasets=PAPER_DATASETS,
    output:
        paper=report(
            "results/paper/paper.pdf", caption="../report/paper.rst", category="paper", labels={"name": "paper"}
        ),
        done="results/paper/done/paper.json",
    params:
        # As it is: braces in it are no wildcards.
        source=lambda wildcards: str(PAPER_SOURCE),
        folder=lambda wildcards, output: str(Path(output.paper).with_suffix("")),
        digest=PAPER.digest if PAPER_WANTED else "none",
    log:
        "results/paper/logs/paper.log",
    benchmark:
        "results/paper/benchmarks/paper.tsv"
    shell:
        "python -m springtune.studies.paper.build {params.source:q} {params.folder:q} {output.paper:q}"
        " {output.done:q} {params.digest:q} {input.datasets:q} > {log:q} 2>&1"
