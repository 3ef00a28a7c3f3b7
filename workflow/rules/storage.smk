"""Results on object storage: `publish` runs a study and uploads it, `fetch` adds what is there to what is here.

What stages store is no output that Snakemake knows of, so a stage is one pack; storage is Snakemake's plugin's.
"""

from importlib.util import find_spec

from springtune.studies.archive.parts import ENDING
from springtune.registry import how_to_install

PLUGIN = "snakemake_storage_plugin_s3"
STORAGE = str(config.get("storage", "")).rstrip("/")


if not STORAGE:
    refused("publish, fetch: where? give --config storage=s3://bucket/folder")
if not re.fullmatch(r"s3://[^/{}]+(/[^{}]+)?", STORAGE):
    refused(f"storage: '{STORAGE}' is no place for results; give one such as s3://bucket/folder")
if find_spec(PLUGIN) is None:
    refused(f"storage: Snakemake's plugin for s3:// is not installed; {how_to_install('s3')}")


def stored(name):
    """An object of this study in the storage."""
    return storage.s3(f"{STORAGE}/{STUDY.name}/{name}")


PACKED = [stage.name for stage in stages() if done(stage.name)]
SHOWN_FILES = [file for job in JOBS.values() if job.reads or job.name == rerun.COLLECT for file in job.products]


if "fetch" in WORDS:  # what makes packs is not to be asked for them; targets are not known yet

    def packs_there(wildcards):
        """Packs of this study that the storage has."""
        packs = [stored(f"{name}{ENDING}") for name in PACKED]
        try:
            # Not Snakemake's exists(): it cannot be called while the graph is built.
            there = [one for one in packs if one.flags["storage_object"].exists()]
        except Exception as error:
            refused(
                f"{STORAGE}: {error}; correct access key, secret key or endpoint, or see whether the storage is there"
            )
        if not there:
            refused(f"{STORAGE}/{STUDY.name} holds no results of this study; correct the place, or publish first")
        return there

    rule fetch:
        message:
            f"Adding the results on {STORAGE}/{STUDY.name}"
        input:
            packs_there,
        params:
            # As it is: braces in it are no wildcards.
            config=lambda wildcards: str(CONFIG),
        benchmark:
            RESULTS / "benchmarks/fetch.tsv"
        conda:
            ENVIRONMENT
        shell:
            "python -m springtune.studies.archive.parts fetch {params.config:q} {input:q}"

else:

    rule publish:
        message:
            f"{STORAGE}/{STUDY.name} has all results of {STUDY.name}"
        input:
            rules.all.input,
            [stored(f"{name}{ENDING}") for name in PACKED],
            [stored(Path(file).relative_to(RESULTS)) for file in SHOWN_FILES],

    for stage in PACKED:

        rule:
            name:
                f"pack_{stage}"
            message:
                f"Packing what {stage} stored"
            input:
                done(stage),
            output:
                stored(f"{stage}{ENDING}"),
            params:
                folder=str(RESULTS),
            log:
                RESULTS / f"logs/pack_{stage}.log",
            benchmark:
                RESULTS / f"benchmarks/pack_{stage}.tsv"
            conda:
                ENVIRONMENT
            shell:
                "python -m springtune.studies.archive.parts pack {params.folder:q} {output:q} {input:q} > {log:q} 2>&1"

    rule upload:
        message:
            "Uploading dataset, page, tables and figures"
        input:
            SHOWN_FILES,
        output:
            [stored(Path(file).relative_to(RESULTS)) for file in SHOWN_FILES],
        log:
            RESULTS / "logs/upload.log",
        benchmark:
            RESULTS / "benchmarks/upload.tsv"
        conda:
            ENVIRONMENT
        shell:
            "python -m springtune.studies.archive.parts copy {output:q} {input:q} > {log:q} 2>&1"
