"""What is made of the benchmark."""

from ..base import Output

PAGE = "speed.md"


def _lack(study):
    return "" if study.parts["benchmark"] else "shows a benchmark and the study has none; add a section 'benchmark'"


OUTPUTS = (
    Output(
        "benchmark",
        "figures and the page of the benchmark",
        tables=lambda study: [PAGE],
        write="kinds.benchmark.tables",
        lack=_lack,
    ),
)
