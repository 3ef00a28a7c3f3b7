"""Figure of the kind `lengths`."""

from springtune.studies.output import style
from springtune.studies.output.selection import group


@style.styled
def plot_lengths(data, ax=None):
    """Longest over shortest spring of each mesh type."""
    data = group(data, "lengths").dropna("mesh_type")
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN, 2.4), layout="constrained")
    panel.bar(data.mesh_type.values, data.longest / data.shortest, color=style.line(0)["color"])
    panel.set(ylabel="longest over shortest spring")
    return panel


def lengths(tree):
    """Stem, function that plots, and selection of each figure."""
    yield "lengths", plot_lengths, {}
