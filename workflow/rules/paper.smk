"""The paper: `snakemake paper` runs the studies that it reads, where they are missing or out of date, and sets it."""

from springtune.publication import PaperError
from springtune.publication.build import check_typst

PAPER_STUDIES = ("paper", "definitions", "block", "laying", "stability", "benchmark")
PAPER_SOURCE = Path(workflow.basedir, "workflow/paper")


# Snakemake tells the targets after the Snakefile was read. Who wants neither the paper nor a job of a study that it reads
# need not read these studies.
WORDS = sys.argv[1:]
PAPER_WANTED = any(word == "paper" or Path(word).name == "paper.pdf" for word in WORDS)

if PAPER_WANTED:
    try:  # now, and not when the studies are done
        check_typst()
    except PaperError as error:
        print(error, file=sys.stderr)
        sys.exit(1)

if PAPER_WANTED or any(word.startswith(tuple(f"{name}_" for name in PAPER_STUDIES)) for word in WORDS):
    for name in PAPER_STUDIES:
        if name != STUDY.name:
            prefix = f"{name}_"
            beside = CONFIG.with_name(f"{name}.yaml")

            module:
                name: name
                snakefile: "../../Snakefile"
                config: {"study": str(beside if beside.exists() else Path("config", beside.name))}

            use rule * from name exclude all as prefix*


rule paper:
    message:
        "Setting the paper from the datasets of its studies"
    input:
        datasets=[Path("results") / name / "dataset.nc" for name in PAPER_STUDIES],
        source=[path for path in sorted(PAPER_SOURCE.iterdir()) if path.is_file()],
        # A function, so that only who wants the paper looks for them.
        code=lambda wildcards: modules(
            "publication.build", *(one.module for one in outputs().values() if one.module)
        ),
    output:
        report("results/paper/paper.pdf", caption="../report/paper.rst", category="paper", labels={"name": "paper"}),
    params:
        source=lambda wildcards, input: str(Path(input.source[0]).parent),
        folder=lambda wildcards, output: str(Path(output[0]).with_suffix("")),
    log:
        "results/paper/logs/paper.log",
    benchmark:
        "results/paper/benchmarks/paper.tsv"
    shell:
        "python -m springtune.publication.build {params.source} {params.folder} {output} {input.datasets} > {log} 2>&1"
