"""Figures, table and browse views of samples."""

from ...config.kind import Output, stem
from .designs import SOBOL_INDICES

QUANTITIES = {
    "displacement": "displacement of the network",
    "deformation_error": "deformation error",
    "best_stiffness": "uniform stiffness without an error",
}
"""Quantities with Sobol indices."""


def _lack(study):
    sample = study.parts["samples"]
    if sample and sample.design != SOBOL_INDICES:
        return f"shows Sobol indices, which the design '{sample.design}' lacks; give design: {SOBOL_INDICES}"
    return ""


def _figures(study):
    sample = study.parts["samples"]
    return {stem("sobol", {"load": load}): {"load": load} for load in sample.loads} if sample else {}


OUTPUTS = (
    Output(
        "sobol",
        "Sobol indices",
        figures=_figures,
        plot="studies.kinds.samples.figures:sobol",
        shows="sampled scenes",
        lack=_lack,
    ),
)


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    if "sobol" not in tree:
        return []
    found = tree["sobol"].to_dataset()
    labels = ["quantity", "load", "definition", "parameter"]
    columns = [f"{order}_order{end}" for order in ("first", "total") for end in ("", "_low", "_high")]
    columns.append("base_samples")
    frame = found[columns].to_dataframe(dim_order=labels).reset_index()[[*labels, *columns]]
    frame = frame[frame.base_samples > 0]
    frame["definition"] = frame["definition"].mask(frame["quantity"] == "best_stiffness", "")  # one of all definitions
    rows = frame.drop_duplicates(labels).to_dict("records")
    first, second, third = QUANTITIES.values()
    note = (
        f"{first.capitalize()}, {second} and {third}: shares of their variance by each parameter alone (first order) "
        f"and in all that it takes part in (total order). Bands: {found.attrs['bands']}. "
        f"Failures: {found.attrs['failures']}."
    )
    return [{"stem": "sobol", "title": "Sobol indices", "note": note, "rows": rows}]
