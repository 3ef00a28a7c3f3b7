"""Stages of a study, one module a Snakemake rule: read files, call the library, write files."""
