rule collect:
    message:
        "Comparing, and collecting the dataset"
    input:
        config=CONFIG,
        references=REFERENCES,
        calibration=CALIBRATION,
        curves=expand(RESULTS / "done/sensitivity_{bundle}.json", bundle=BUNDLES["sensitivity"]),
        scenes=expand(RESULTS / "done/solve_{bundle}.json", bundle=BUNDLES["solve"]),
        laying=expand(RESULTS / "done/laying_{bundle}.json", bundle=BUNDLES["laying"]),
        stability=expand(RESULTS / "done/stability_{bundle}.json", bundle=BUNDLES["stability"]),
        benchmark=expand(RESULTS / "done/benchmark_{race}.json", race=BUNDLES["benchmark"]),
        moduli=expand(RESULTS / "done/moduli_{bundle}.json", bundle=BUNDLES["moduli"]),
        printed=STUDY.printed_path or [],
        code=modules("campaign.collect"),
    output:
        RESULTS / "dataset.nc",
    params:
        folder=str(RESULTS),
    log:
        RESULTS / "logs/collect.log",
    benchmark:
        RESULTS / "benchmarks/collect.tsv"
    shell:
        "python -m springtune.campaign.collect {input.config} {params.folder} {output} > {log} 2>&1 && cat {log}"
