# A workflow of others, which uses this one; test_elsewhere.py fills in what is in braces.
rule all:
    input:
        "told.txt",
        "results/mine/index.html",


module springtune:
    snakefile:
        {snakefile}
    config:
        {config}


{further}


use rule * from springtune as springtune_*


rule tell:
    input:
        "results/mine/dataset.nc",
    output:
        "told.txt",
    shell:
        "echo told > {{output}}"
