"""The stages before the dataset, one rule each: every study kind declares its own."""

import re

for stage in plan.stages():

    rule:
        name:
            stage.name
        message:
            f"{stage.message}, bundle {{wildcards.bundle}}"
        input:
            tasks=RESULTS / "tasks" / f"{stage.name}_{{bundle}}.json",
            same=[RESULTS / "done" / f"{other}_{{bundle}}.json" for other in stage.same],
            every=[path for other in stage.every for path in done(other)],
            code=modules(stage.module, definitions=stage.definitions, mesh_types=stage.mesh_types),
        output:
            RESULTS / "done" / f"{stage.name}_{{bundle}}.json",
        wildcard_constraints:
            bundle="|".join(map(re.escape, BUNDLES[stage.name])) or "none",
        params:
            module=f"springtune.{stage.module}",
        threads: workflow.cores if stage.alone else 1
        log:
            RESULTS / "logs" / f"{stage.name}_{{bundle}}.log",
        benchmark:
            RESULTS / "benchmarks" / f"{stage.name}_{{bundle}}.tsv"
        shell:
            "python -m {params.module} {input.tasks} {output} > {log} 2>&1"


DONE = [path for stage in plan.stages() for path in done(stage.name)]
