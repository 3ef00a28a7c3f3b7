"""Figures: all of them, from a dataset of every group; and their texts, fonts and colours, as a journal takes them."""

import io
from itertools import combinations

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image
from pypdf import PdfReader

import springtune as st
from springtune.studies.config.model import outputs
from springtune.studies.kinds.bodies.shape_figures import NETWORK_LINE_WIDTH
from springtune.studies.output import style
from springtune.studies.output.style import png_and_pdf
from springtune.studies.runs.keys import closure

from synthetic import BEAMS, DEFINITIONS, SIZES, TYPES, dataset
from tables import beside, evaluated


@pytest.fixture(autouse=True)
def closed():
    """No figure opens a window, none that another test left is there, and those of this one are closed after it."""
    with matplotlib.rc_context():
        plt.switch_backend("agg")
        plt.close("all")
        yield
    plt.close("all")


@pytest.fixture(scope="module")
def tree():
    return dataset()


SCENES = {"mesh_type": "free", "material": "steel", "load": "traction"}
CURVE = SCENES | {"beam": "200x40"}

EVERY_PLOT = {getattr(st, name): row for name, row in evaluated(beside(__file__)["EVERY_PLOT"], globals()).items()}
"""Every function that plots: a selection, and how many axes it returns; None where it returns one by itself."""

each = pytest.mark.parametrize("plot", EVERY_PLOT, ids=lambda plot: plot.__name__)


# -- all of them -------------------------------------------------------------------------------------------------------


@each
def test_a_plot_returns_axes_with_something_on_them_and_leaves_settings_as_they_are(tree, plot):
    selection, count = EVERY_PLOT[plot]
    settings = dict(matplotlib.rcParams)
    axes = plot(tree, **selection)
    assert dict(matplotlib.rcParams) == settings
    assert isinstance(axes, Axes) if count is None else np.shape(axes) == tuple(np.ravel(count))
    for panel in np.ravel(axes):
        assert panel.has_data() and (panel.get_title("left") or panel.get_title())
    assert {panel.figure.number for panel in np.ravel(axes)} == set(plt.get_fignums())


@pytest.mark.parametrize(("own", "shown"), [({}, 8), ({"font.size": 12}, 12), ({"axes.labelsize": 5}, 5)])
def test_settings_of_the_user_are_respected(tree, own, shown):
    with matplotlib.rc_context(own):
        axes = st.plot_sensitivity(tree, **CURVE)
    assert axes.xaxis.label.get_size() == shown


def test_a_study_chooses_width_and_size_of_text(tree, monkeypatch):
    for name in ("COLUMN_WIDTH", "PAGE_WIDTH", "SMALL_TEXT"):
        monkeypatch.setattr(style, name, getattr(style, name))
    monkeypatch.setattr(style, "SETTINGS", dict(style.SETTINGS))
    style.choose(0.0254 * 5, 10)
    axes = st.plot_sensitivity(tree, **CURVE)
    assert axes.figure.get_size_inches()[0] == pytest.approx(5) and axes.xaxis.label.get_size() == 10


# -- what they show ----------------------------------------------------------------------------------------------------


def drawn(axes, label):
    """The line of a label."""
    return next(line for line in axes.get_lines() if line.get_label() == label)


def test_a_sensitivity_curve_carries_the_errors_of_the_dataset(tree):
    axes = st.plot_sensitivity(tree, **CURVE)
    curves = tree["sensitivity"].to_dataset().sel(CURVE).sel(kinematics="nonlinear")
    for size in SIZES:
        line, curve = drawn(axes, f"{1e3 * size:g} mm"), curves.sel(mesh_size=size)
        # The minimum stands between two stiffnesses.
        assert line.get_xdata() == pytest.approx([500, 700, 800, 900, 1100])
        error = 100 * curve.deformation_error.values
        assert line.get_ydata() == pytest.approx([error[0], error[1], 0, error[2], error[3]])
    assert "200x40 mm, free, steel, traction" in axes.get_title("left")
    reference = tree.reference_displacement.sel(beam="200x40", material="steel", load="traction")
    assert f"reference {1e3 * float(reference):.4g} mm" in axes.get_title("left")


def test_errors_against_mesh_size_are_the_datasets(tree):
    panels = st.plot_size(tree, **SCENES)
    for panel, beam in zip(panels, BEAMS):
        error = tree.deformation_error.sel(SCENES).sel(beam=beam, kinematics="nonlinear")
        for definition in DEFINITIONS:
            line = drawn(panel, definition)
            assert line.get_xdata() == pytest.approx([1, 2, 5])
            assert line.get_ydata() == pytest.approx(100 * error.sel(definition=definition).values)
        assert panel.get_title("left") == f"{beam} mm"
    (panel,) = st.plot_size(tree, beam="200x40", **SCENES)
    assert panel.get_title("left") == "200x40 mm"


def test_springs_of_a_deformed_network_join_its_moved_particles(tree):
    panel = st.plot_deformed(tree, beam="100x20", definition="area", **SCENES)[0]
    here = tree["fields"].to_dataset().sel(SCENES).sel(beam="100x20", definition="area", mesh_size=5e-3)
    title = panel.get_title("left")
    scale = float(title.rpartition("×\u00a0")[2])
    springs = next(line for line in panel.get_lines() if line.get_linewidth() == NETWORK_LINE_WIDTH)
    x = 1e3 * (here.x + scale * here.displacement_x).values
    assert springs.get_xdata() == pytest.approx(
        [x[0], x[1], np.nan, x[1], x[2], np.nan, x[2], x[3], np.nan], nan_ok=True
    )
    assert "mesh 5 mm" in title  # the coarsest, whose springs can be told


def test_the_pressed_face_is_the_datasets(tree):
    chosen = EVERY_PLOT[st.plot_block][0]
    faces = tree["block"].to_dataset()
    small = tree.copy()
    small["block"] = xr.DataTree(faces.sel(reference=["small-strain"]))
    # Like with like: networks of nonlinear kinematics over finite strain, without it linear ones over small strain.
    for data, kinematics, reference in (
        (small, "linear", "small-strain"),
        (tree, "nonlinear", "neo-hooke-plane-stress"),
    ):
        left, right = st.plot_block(data, **chosen)
        shown = faces.sel(chosen).sel(load="pressure")
        for definition in ("paper", "area"):
            profile = shown.face_profile.sel(definition=definition, kinematics=kinematics)
            assert drawn(right, f"{definition}, {kinematics}").get_ydata() == pytest.approx(-1e3 * profile.values)
        profile = shown.reference_face_profile.sel(reference=reference)
        line = drawn(right, f"reference, {reference.replace('-', ' ')}")
        assert line.get_ydata() == pytest.approx(-1e3 * profile.values)
        assert sum("reference" in line.get_label() for line in right.get_lines()) == 1
    assert {"traction", "compression", "pressure"} <= {line.get_label() for line in left.get_lines()}


@pytest.mark.parametrize(("kinematics", "more"), [("nonlinear", 50.0), ("linear", 0.0)])
def test_errors_of_nonlinear_networks_are_against_finite_strain(tree, kinematics, more):
    """Where the dataset has that reference, and the title says so."""
    data, finite = tree.copy(), tree.to_dataset()[["deformation_error", "reference_displacement"]]
    finite["deformation_error"] = finite.deformation_error + 0.5
    data["finite_strain"] = xr.DataTree(finite.expand_dims(reference=["neo-hooke-plane-stress"]))
    chosen = {"mesh_type": "structured", "material": "steel", "load": "traction", "kinematics": kinematics}
    panels, usual = st.plot_size(data, **chosen), st.plot_size(tree, **chosen)
    label = usual[0].get_lines()[0].get_label()
    assert drawn(panels[0], label).get_ydata() == pytest.approx(drawn(usual[0], label).get_ydata() + more)
    assert panels[0].figure.get_suptitle().endswith("against finite strain") == (kinematics == "nonlinear")


def test_definitions_of_linear_kinematics_alone_are_named(tree):
    data, first = tree.to_dataset(), DEFINITIONS[0]
    data["status"] = data.status.where((data.definition != first) | (data.kinematics == "linear"), 0)
    panel = st.plot_size(data, mesh_type="structured", material="steel", load="traction")[0]
    assert {f"{first}, linear", DEFINITIONS[1]} <= {line.get_label() for line in panel.get_lines()}


def test_moduli_are_of_the_finest_patch(tree):
    for panel, mesh_type in zip(st.plot_moduli(tree), TYPES):
        for definition in DEFINITIONS:
            found = tree["moduli"].effective_poisson_ratio.sel(
                mesh_type=mesh_type, definition=definition, mesh_size=SIZES[0]
            )
            # One line for those that the eye does not tell apart.
            line = next(line for line in panel.get_lines() if definition in line.get_label().split(", "))
            assert line.get_ydata() == pytest.approx(found.values, abs=0.012)


def test_a_heat_map_shows_the_finest_mesh_that_was_solved(tree):
    chosen = EVERY_PLOT[st.plot_definitions_loads][0]
    data = tree.to_dataset()
    data["deformation_error"] = data.deformation_error.copy()
    data.deformation_error.loc[chosen | {"definition": "area", "mesh_size": 1e-3}] = np.nan
    panel = st.plot_definitions_loads(data, materials=["rubber"], **chosen)[0]
    error = 100 * data.deformation_error.sel(chosen).sel(material="rubber")
    wanted = [error.sel(definition="paper", mesh_size=1e-3).values, error.sel(definition="area", mesh_size=2e-3).values]
    assert np.asarray(panel.images[0].get_array()) == pytest.approx(np.log10(np.clip(wanted, 0.1, 100)))


def test_an_approach_carries_its_errors_and_seconds(tree):
    panel = st.plot_benchmark(tree, scene="bending")
    here = tree["benchmark"].to_dataset().sel(scene="bending", approach="condensation")
    line = drawn(panel, "condensation")
    assert line.get_xdata() == pytest.approx(here.seconds.values)
    assert line.get_ydata() == pytest.approx(100 * here.error.values)


def test_an_engine_carries_its_least_errors_over_the_time_of_a_frame(tree):
    panel = st.plot_engine_errors(tree, scene="strip")
    here = tree["engines"].to_dataset().sel(scene="strip", definition="area", engine="vbd").squeeze()
    line = drawn(panel, "vbd, area")
    best = here.error.argmin(...)  # all take longer, the larger their error
    assert line.get_ydata() == pytest.approx([100 * here.error[best].item()])
    assert line.get_xdata() == pytest.approx([1e3 * here.frame_seconds[best].item()])


# -- the stage ---------------------------------------------------------------------------------------------------------


def test_both_formats_show_the_same_and_are_the_same_again():
    def made():
        with matplotlib.rc_context(style.SETTINGS):
            figure = Figure(figsize=(4, 3))
            axes = figure.subplots()
            axes.plot([0, 1], [0, 1], color="#ff0000", linewidth=20)
            axes.set_title("A title")
        return png_and_pdf(figure)

    one, two = made(), made()
    assert one == two
    picture = Image.open(io.BytesIO(one["png"]))
    assert picture.size == (1200, 900) and picture.info["dpi"] == pytest.approx((300, 300), abs=0.1)
    red = (np.asarray(picture) == [255, 0, 0]).all(axis=2)
    # A diagonal, 20 points wide: from the lower left to the upper right, within the axes.
    rows, columns = np.nonzero(red)
    assert np.corrcoef(rows, columns)[0, 1] < -0.9
    assert np.median(red.sum(axis=0)[red.any(axis=0)]) == pytest.approx(20 * 300 / 72 * np.hypot(1, 0.75), rel=0.25)
    assert one["pdf"].startswith(b"%PDF") and one["pdf"].rstrip().endswith(b"%%EOF")


def test_an_edit_of_one_kinds_figures_redraws_no_other_kind():
    def drawers(output):
        files = closure("studies.output.present", output.module).files
        return {path.parent.name for path in files if path.name.endswith(("figures.py", "errors.py"))}

    kinds = {output.name: drawers(output) for output in outputs().values() if output.plot}
    assert kinds["sensitivity"] == kinds["block"] == {"bodies"} and kinds["definitions"] == {"moduli"}
    assert all(len(found) == 1 for found in kinds.values())


def said(panel):
    """All texts of a figure."""
    return [text.get_text() for text in panel.figure.findobj(Text)]


def test_what_is_beyond_the_reference_is_marked(tree):
    """Of a dataset none of whose references applies."""
    beyond, applies = dataset(), tree.status.isel(mesh_type=0, mesh_size=0, definition=0, drop=True)
    beyond.dataset = beyond.to_dataset().assign(reference_applies=0 * applies)
    assert "hollow: beyond small strain" in " ".join(said(st.plot_size(beyond, **SCENES)[0]))
    (panel, *_) = st.plot_size(beyond, **SCENES)
    hollow = [line for line in panel.get_lines() if line.get_markerfacecolor() == "white"]
    assert len(hollow) == len(DEFINITIONS) and all(np.isfinite(line.get_ydata()).all() for line in hollow)
    assert any(text.startswith("beyond small strain") for text in said(st.plot_sensitivity(beyond, **CURVE)))
    deformed = " ".join(said(st.plot_deformed(beyond, **SCENES, definition="area")[0]))
    assert "reference beyond small strain" in deformed.replace("\n", " ")
    for panel in (st.plot_sensitivity(tree, **CURVE), st.plot_deformed(tree, **SCENES, definition="area")[0]):
        assert "beyond" not in " ".join(said(panel))


def test_signed_errors_say_once_what_their_sign_means():
    tree = dataset()
    against = xr.where(tree["load"].isin(("compression", "pressure")), -1.0, 1.0)
    tree.dataset = tree.to_dataset().assign(reference_displacement=against * abs(tree.reference_displacement))
    for load, words in (("traction", "positive: too soft"), ("compression", "negative: too soft")):
        panels = st.plot_size(tree, **SCENES | {"load": load})
        signs = [text for text in said(panels[0]) if "too soft" in text]
        assert len(signs) == 1 and signs[0].startswith(words), signs
    panel = st.plot_definitions_loads(tree, beam="100x20", mesh_type="free", kinematics="linear")[0]
    (text,) = (text.replace("\n", " ") for text in said(panel) if "too soft" in text)
    assert text.startswith("positive: too soft; under compression and pressure, where displacements are negative, neg")


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
