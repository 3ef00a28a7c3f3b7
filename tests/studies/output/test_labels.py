"""Texts, fonts and colours of figures: what a journal takes, and what a reader can tell apart."""

import io
from itertools import combinations

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from pypdf import PdfReader
from test_figures import EVERY_PLOT, closed, each  # noqa: F401  # a fixture of that file

from springtune.studies.output import style
from springtune.studies.output.style import png_and_pdf

from synthetic import dataset


@pytest.fixture(scope="module")
def tree():
    return dataset()


# -- texts of others ---------------------------------------------------------------------------------------------------

HOSTILE = "$x_{$ </text><script>"

RENAMED = ("beam", "mesh_type", "material", "definition", "shape", "quantity")
"""Dimensions whose labels are somebody's, and not chosen by name in a figure."""


def foreign(data):
    """A group whose labels, messages and sources end in what matplotlib takes for mathematics, and cannot set."""
    names = {name: [f"{label} {HOSTILE}" for label in data[name].values] for name in RENAMED if name in data.coords}
    texts = {
        name: one.copy(data=one.values + f" {HOSTILE}")
        for name, one in data.data_vars.items()
        if str(name).endswith(("message", "scene", "source", "remark", *(f"{one}_name" for one in RENAMED)))
    }
    return data.assign(texts).assign_coords(names)


@each
def test_a_dollar_sign_in_a_text_is_one(tree, plot):
    other = xr.DataTree.from_dict({node.path: foreign(node.to_dataset(inherit=False)) for node in tree.subtree})
    chosen = {name: f"{label} {HOSTILE}" if name in RENAMED else label for name, label in EVERY_PLOT[plot][0].items()}
    figure = np.ravel(plot(other, **chosen))[0].figure
    content = io.StringIO()
    figure.savefig(content, format="svg")  # no exception
    assert "<script>" not in content.getvalue()


# -- what a journal takes ----------------------------------------------------------------------------------------------


def files(figure):
    """Files of a figure, and the boxes of the texts drawn upright or sideways [pt]."""
    drawn, draw = {}, Text.draw

    def noted(self, renderer):
        if self.get_visible() and self.get_text().strip() and self.get_rotation() % 90 == 0:
            drawn[self] = self.get_window_extent(renderer)
        draw(self, renderer)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Text, "draw", noted)
        return png_and_pdf(figure), drawn


def check_fonts(content):
    """IEEE and ACM refuse Type 3 and fonts that are not in the file."""
    (page,) = PdfReader(io.BytesIO(content)).pages
    assert page["/Resources"]["/Font"]
    for font in page["/Resources"]["/Font"].values():
        assert font.get_object()["/Subtype"] == "/Type0"
        (inner,) = (one.get_object() for one in font.get_object()["/DescendantFonts"])
        assert inner["/Subtype"] == "/CIDFontType2"
        assert len(inner["/FontDescriptor"].get_object()["/FontFile2"].get_object().get_data()) > 500


def check_texts(figure, boxes):
    """No text leaves the figure, none is smaller than journals take, and no two lie on each other."""
    width, height = 72 * figure.get_size_inches()
    for text, box in boxes.items():
        said = repr(text.get_text())
        assert text.get_fontsize() >= style.SMALL_TEXT, said
        assert box.x0 >= -1 and box.x1 <= width + 1 and box.y0 >= -1 and box.y1 <= height + 1, said
    for one, other in combinations(boxes, 2):
        a, b = boxes[one], boxes[other]
        wide, high = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        # The box of a text is higher than its letters.
        assert wide < 1 or high < 0.2 * min(a.height, b.height), (one.get_text(), other.get_text())


@each
def test_a_figure_is_what_a_journal_takes(tree, plot):
    figure = np.ravel(plot(tree, **EVERY_PLOT[plot][0]))[0].figure
    assert figure.get_size_inches()[0] in (style.COLUMN_WIDTH, style.PAGE_WIDTH)
    made, boxes = files(figure)
    check_fonts(made["pdf"])
    check_texts(figure, boxes)


# -- texts -------------------------------------------------------------------------------------------------------------


# -- colours -----------------------------------------------------------------------------------------------------------

# Machado, Oliveira and Fernandes 2009, severity 1, on linear RGB.
BLIND = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    "none": np.eye(3),
}


def lab(colour, sight):
    """CIELAB of a colour as someone sees it."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(np.asarray(BLIND[sight]) @ linear, 0, 1)
    white = [0.95047, 1.0, 1.08883]
    to_xyz = [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.072175], [0.0193339, 0.119192, 0.9503041]]
    xyz = np.asarray(to_xyz) @ linear / white
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", BLIND)
def test_lines_are_told_apart_by_the_colour_blind(sight):
    """A difference of 10 is seen at a glance; 2.3 is just noticeable."""
    seen = [lab(look["color"], sight) for look in style.LINE_STYLES]
    nearest = min(np.linalg.norm(one - other) for one, other in combinations(seen, 2))
    assert nearest > 10


# -- what is missing ---------------------------------------------------------------------------------------------------

KEPT = ("beam_length", "beam_height", "trapezoid_x", "trapezoid_y", "x", "y", "outline_x", "outline_y", "spring_nodes",
        "strain_load", "case_mesh_size", "material_poisson_ratio", "material_young_modulus", "stiffness")  # fmt: skip


def unsolved(group):
    """A group whose every cell was asked for and did not converge."""
    lost = {
        name: np.nan * values for name, values in group.data_vars.items() if name not in KEPT and values.dtype == float
    }
    flags = {name: 0 * values + 3 for name, values in group.data_vars.items() if name.endswith("status")}
    return group.assign(lost | flags)


@pytest.fixture(scope="module")
def nothing(tree):
    """A study of which nothing was solved."""
    return tree.map_over_datasets(lambda group: unsolved(group) if group.data_vars else group)


@each
def test_where_nothing_was_solved_words_say_so(nothing, plot):
    panels = np.ravel(plot(nothing, **EVERY_PLOT[plot][0]))
    # Of a laid strip the trapezoid is there, with a note.
    assert all(any(text.get_text().strip() for text in panel.texts) for panel in panels)
