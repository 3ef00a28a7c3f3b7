"""The page in a real browser: what it shows, how it answers, and that it asks for nothing."""

import os
from pathlib import Path
from urllib.request import url2pathname

import numpy as np
import pytest
from selenium.webdriver import Keys
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By

from conftest import written
from springtune.problem.compare import sign_sentence
from springtune.studies.kinds.bodies.collect import ROOT

from synthetic import LABELS, dataset

CURVE = "springtune.views.cells.plots.curve.chart.sources.points.data.y.join()"
SIZE = "springtune.views.cells.plots.size.chart.sources.points.data"
HEADING = "document.querySelector('.chosen-cell h2').textContent"


def grid(browser):
    return browser.driver.find_element(By.CSS_SELECTOR, ".list .grid")


def views(browser):
    return browser.ask("return Object.keys(springtune.views)")


def show(browser, view):
    browser.ask("location.hash = `#view=${arguments[0]}`", view)
    filled = "document.querySelector(`.view-${arguments[0]}`)?.childElementCount"
    browser.wait(f"return springtune.opened === arguments[0] && {filled}", view)
    browser.wait("return Promise.resolve(springtune.views[arguments[0]].plot?.drawn).then(() => true)", view)


class TestCube:
    def test_is_small_enough_to_mail(self, cube):
        assert os.path.getsize(url2pathname(cube.removeprefix("file://"))) <= 5e6

    def test_filters_and_sorting(self, browser, cube):
        browser.open(cube)
        order = "return springtune.views.cells.table.order"
        assert len(browser.ask(order)) == 10_000
        field = browser.driver.find_element(By.CSS_SELECTOR, ".filters [data-column=deformation_error]")
        field.send_keys("-50..50")
        inside = browser.ask(order)
        assert 3000 < len(inside) < 4500  # of a normal distribution, 38 % are within half a standard deviation
        browser.driver.find_element(By.CSS_SELECTOR, ".filters [data-column=beam]").send_keys("40x8")
        browser.driver.find_element(By.CSS_SELECTOR, ".filters [data-column=status]").send_keys("solved")
        table = "const T = springtune.views.cells.table;"
        rows = f"{table} return T.order.map((row) => T.columns.map((one) => one.text(row)))"
        names = browser.ask("return springtune.views.cells.table.columns.map((one) => one.name)")
        place = names.index("deformation_error")
        sort = browser.driver.find_elements(By.CSS_SELECTOR, ".list thead th button")[place]
        sort.send_keys(Keys.ENTER)
        found = browser.ask(rows)
        assert {(row[0], row[names.index("status")]) for row in found} == {("40x8", "solved")}
        sizes = [abs(float(row[place].replace("−", "-"))) for row in found]
        assert sizes == sorted(sizes) and sizes[-1] <= 50
        heading = browser.ask("return document.querySelectorAll('.list thead th')[arguments[0]].ariaSort", place)
        assert heading == "ascending"


class TestSelection:
    def test_by_mouse(self, browser, small):
        browser.open(small)
        curve, heading = browser.ask(f"return {CURVE}"), browser.ask(f"return {HEADING}")
        # The curve does not depend on the definition: take a row of another beam.
        rows = browser.driver.find_elements(By.CSS_SELECTOR, ".list tbody tr[data-place]")
        rows[20].click()
        browser.wait(f"return {CURVE} !== arguments[0]", curve)
        assert browser.ask(f"return {HEADING}") != heading
        assert "beam=" in browser.driver.current_url

    def test_by_keyboard_and_address(self, browser, small):
        browser.open(small)
        for _ in range(60):  # until the table has the focus, as a reader without a mouse gets there
            ActionChains(browser.driver).send_keys(Keys.TAB).perform()
            if browser.ask("return document.activeElement.classList.contains('grid')"):
                break
        before = browser.ask(f"return {CURVE}")
        ActionChains(browser.driver).send_keys(Keys.END).perform()
        browser.wait(f"return {CURVE} !== arguments[0]", before)
        heading, after = browser.ask(f"return {HEADING}"), browser.ask(f"return {CURVE}")
        address = browser.driver.current_url
        assert browser.ask("return document.querySelector('.list tr[aria-selected=true]').dataset.place") != "0"
        browser.open(address)  # a link to a cell works
        assert browser.ask(f"return {HEADING}") == heading and browser.ask(f"return {CURVE}") == after

    def test_by_parameter(self, browser, small):
        browser.open(small)
        before = browser.ask(f"return {SIZE}.y.slice(0, 3)")
        browser.driver.find_element(By.CSS_SELECTOR, "[data-dim=load]").send_keys("compression")
        browser.wait("return springtune.places.load === 1")
        browser.wait(f"return {SIZE}.y.slice(0, 3).join() !== arguments[0].join()", before)
        assert "load=compression" in browser.driver.current_url

    def test_every_status_is_told_with_its_message(self, browser, small):
        browser.open(small)
        assert "5 scenes" not in browser.ask("return document.querySelector('#end').textContent")
        for word in ("solved", "linear only", "not converged", "unstable", "failed", "not requested"):
            assert word in browser.ask("return document.querySelector('#end').textContent")
        place = browser.ask("const t = springtune.views.cells, row = t.status.values.indexOf(5);"
                            "await springtune.choose(t.status.placesOf(row)); return t.facts.innerText")  # fmt: skip
        assert "failed" in place and "the network <b>folded</b>" in place


def test_numbers_are_those_of_the_dataset(browser, small):
    """Packed and unpacked, a number keeps 5 digits, and a point of a curve 4."""
    import xarray as xr

    browser.open(small)
    browser.ask("return Promise.all(Object.values(springtune.groups).map((one) => one.load())).then(() => true)")
    with xr.open_datatree(Path(url2pathname(small.removeprefix("file://"))).with_name("dataset.nc")) as tree:
        for node in tree.subtree:
            for name, array in node.to_dataset(inherit=False).data_vars.items():
                read = f"const f = springtune.groups['{node.path}'].fields['{name}'];"
                if array.dtype.kind not in "fi" or array.size == 0:
                    continue
                found = browser.ask(f"{read} return Array.from(f.values, String)")
                assert [float(one) for one in found] == pytest.approx(
                    array.values.ravel().tolist(), rel=4e-5, nan_ok=True
                )


@pytest.mark.parametrize("width", [400, 800, 1440])
def test_it_opens_on_an_overview_as_wide_as_the_screen(browser, small, width):
    browser.resize(width)
    browser.open(small, view="")
    assert browser.ask("return springtune.opened") == "overview"
    assert browser.ask("return document.documentElement.scrollWidth") <= width
    said = text(browser, "#overview")
    assert "Errors of scenes by definition" in said and "Errors of scenes over run time" in said
    # Names and numbers of the dots stand beside the chart, and no line leaves its axes.
    box = "const r = one.getBoundingClientRect(); return [r.left, r.right]"
    ends = f"return [...document.querySelectorAll('#overview .rows span:not(.x)')].map((one) => {{ {box} }})"
    assert all(0 <= left < right <= width for left, right in browser.ask(ends))
    lines = "return [...document.querySelectorAll('#overview polyline')].map((one) => one.getAttribute('points'))"
    numbers = [float(one) for line in browser.ask(lines) for one in line.replace(",", " ").split()]
    assert numbers and 0 <= min(numbers) <= max(numbers) <= 100


def test_hostile_texts_are_shown_as_texts(browser, small):
    browser.open(small)
    assert browser.driver.title == "<script>alert(1)</script>"
    assert browser.ask("return document.querySelector('h1').textContent") == "<script>alert(1)</script>"
    assert not browser.ask("return document.querySelectorAll('h1 *').length")


def test_a_group_that_nobody_knows_has_a_view(browser, small):
    browser.open(small)
    assert "weather" in views(browser)
    show(browser, "weather")
    text = browser.wait("return document.querySelector('.view-weather').innerText")
    assert "rain" in text and "3.5 m/s" in text and "what fell" in text
    ys = browser.wait("return springtune.views.weather.plot.chart.sources.points?.data.y")
    assert sorted(ys) == pytest.approx([1000, 3000, 4000, 5000, 6000], rel=1e-4)  # in mm; what is missing is no point
    browser.driver.find_element(By.CSS_SELECTOR, ".view-weather #variable-choice").send_keys("remark")
    assert "wet" in browser.ask("return document.querySelector('.view-weather').innerText")


@pytest.mark.parametrize("width", [400, 1600])
def test_heads_and_first_column_stay_in_view(browser, cube, width):
    browser.resize(width)
    browser.open(cube)
    assert browser.ask("return document.documentElement.scrollWidth") <= width
    holder = grid(browser)
    browser.ask("arguments[0].scrollTo(400, 90000)", holder)
    browser.wait(
        "return arguments[0].scrollTop > 50000 && arguments[0].querySelector('[data-place]').dataset.place > 1000",
        holder,
    )
    box, head, first = browser.ask(
        "const rect = (one) => { const r = one.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; };"
        "const g = arguments[0], middle = g.getBoundingClientRect().top + g.clientHeight / 2;"
        "const rows = [...g.querySelectorAll('[data-place]')];"
        "const row = rows.find((one) => one.getBoundingClientRect().top > middle);"
        "return [g, g.querySelectorAll('thead th')[3], row.firstElementChild].map(rect)", holder)  # fmt: skip
    assert head[1] == pytest.approx(box[1], abs=2) and first[0] == pytest.approx(box[0], abs=2)
    assert box[1] < first[1] < first[3] < box[3]


def test_pages_ask_for_nothing_and_complain_of_nothing(browser, small, cube):
    for address in (small, cube):
        browser.open(address)
        for view in views(browser):
            show(browser, view)
        assert browser.complaints() == []
        assert {one.partition("#")[0] for one in browser.requests()} == {address}


def test_the_network_moves(browser, small):
    browser.open(small)
    at = "return springtune.views.cells.network.chart.sources.springs?.data"
    springs = browser.wait(at)
    told = browser.ask("return document.querySelector('#panel-shape').innerText")
    assert "force of the spring" in told and "strain" not in told
    blue, grey, orange = springs["color"]
    assert len({blue, grey, orange}) == 3
    browser.ask(
        "const one = document.getElementById('shape-scale'); one.value = 0; one.dispatchEvent(new Event('input'))"
    )
    assert browser.ask(at)["x1"] != springs["x1"]


def text(browser, place):
    return browser.ask("return document.querySelector(arguments[0]).innerText", place)


def choose(browser, **places):
    browser.ask("return springtune.choose({...springtune.places, ...arguments[0]})", places)
    return " ".join(text(browser, ".chosen-cell .facts").split())


class TestWhatIsSo:
    """What a page says of errors, counts and sizes."""

    def test_the_head_counts_all_that_a_study_has(self, browser, odd):
        browser.open(odd)
        assert text(browser, "#end").startswith("288 scenes:")
        said = text(browser, "#holds")
        assert "Samples: ● solved 96" in said and "Shapes: ● solved" in said

    def test_a_study_without_cells_opens_on_what_it_has(self, browser, samples_alone):
        browser.open(samples_alone)
        assert browser.ask("return springtune.opened") == "overview" and "cells" not in views(browser)
        assert "Samples: ● solved" in text(browser, "#holds") and not text(browser, "#end")

    def test_cells_beyond_the_linear_reference_are_marked(self, browser, odd):
        browser.open(odd)
        words, head = "solved; the linear reference does not apply", text(browser, "#end")
        assert "solved 240" in head and f"{words} 48" in head
        choose(browser, load=1, kinematics=0)
        side = text(browser, ".chosen-cell")
        assert words in side
        hollow = f"return {SIZE}"
        points = browser.ask(hollow)
        assert points["fill"][0] != points["line"][0] and f"hollow: {words}" in side
        choose(browser, load=0, kinematics=0)
        points = browser.ask(hollow)
        assert points["fill"][0] == points["line"][0]
        choose(browser, load=1)
        assert f"◇ {words}" in text(browser, "#panel-map")
        tiles = browser.ask("return springtune.views.cells.plots.map.chart.sources.tiles.data.text")
        assert tiles and all(one.endswith(" ◇") for one in tiles)

    def test_signs_are_said(self, browser, odd):
        browser.open(odd)
        assert "%, too stiff" in choose(browser, load=0, kinematics=1)
        assert "%, too soft" in choose(browser, load=1, kinematics=1)
        assert sign_sentence({"traction": 1, "compression": -1}) in text(browser, ".list")
        for place in ("#panel-size", "#panel-map"):  # of the load that they show
            assert "negative: too soft" in text(browser, place) and "traction" not in text(browser, place)
        show(browser, "shapes")
        assert "other quantities: positive: too large" in text(browser, ".view-shapes")  # of an energy

    def test_a_hole_is_a_line_of_its_own_and_the_network_is_drawn(self, browser, odd):
        browser.open(odd)
        show(browser, "shape_fields")
        at_rest = browser.wait("return springtune.views.shape_fields.plot.chart.sources.lines?.data.xs[0]")
        assert at_rest == pytest.approx([0, 0.1, 0, None, 0.1, 0, 0.1])
        network = browser.wait(
            "const n = springtune.views.shape_fields.network.chart.sources;"
            "return n.springs && [n.springs.data.x0.length, n.outlines.data.xs.map((one) => one.length)]"
        )
        assert network == [3, [7, 7]]  # both outlines: at rest, and of the reference
        assert "× 0.0" in text(browser, "#panel-network")
        browser.driver.find_element(By.CSS_SELECTOR, "#panel-network [data-dim=definition]").send_keys("area")
        assert "tension positive" in text(browser, "#panel-network")


def test_what_has_linear_networks_alone_is_drawn_and_named_so(browser, tmp_path):
    root = dataset("fields").to_dataset()
    root.status.attrs = ROOT.empty(LABELS).status.attrs
    root["deformation_error"].loc[{"definition": "area", "kinematics": "nonlinear"}] = np.nan
    root["status"].loc[{"definition": "area", "kinematics": "nonlinear"}] = 0
    browser.open(written(tmp_path, {"/": root}))
    choose(browser, kinematics=root.kinematics.values.tolist().index("nonlinear"))
    named = text(browser, "#panel-size")
    assert "area, linear" in named and "paper, nonlinear" in named
    tiles = browser.ask("return springtune.views.cells.plots.map.chart.cells.map((one) => one.name)")
    assert {one.rpartition(", ")[0] for one in tiles} == {"area, linear", "paper, nonlinear"}


def test_at_1440_pixels_no_column_is_cut(browser, odd):
    browser.resize(1440)
    browser.open(odd)
    assert browser.ask("const g = arguments[0]; return g.scrollWidth <= g.clientWidth", grid(browser))
    browser.driver.find_element(By.ID, "columns").click()
    assert browser.ask("const g = arguments[0]; return g.scrollWidth > g.clientWidth", grid(browser))
    assert "residual" in text(browser, ".list thead")


class TestFilters:
    def test_what_is_no_number_is_said_so(self, browser, odd):
        browser.open(odd)
        field = browser.driver.find_element(By.CSS_SELECTOR, ".list [data-column=deformation_error]")
        field.send_keys("abc")
        said = text(browser, ".list [role=status]")
        assert '"abc" is not a number' in said and "-2..2" in said.replace("−", "-") and "288 of 288" in said
        assert field.get_attribute("aria-invalid") is not None
        for asked in ("<-100", "1e9", "-5..-1"):
            field.clear()
            field.send_keys(asked)
            assert "not a number" not in text(browser, ".list [role=status]")
        field.clear()
        field.send_keys(">5000")
        assert "No row passes the filters." in text(browser, ".list tbody")

    def test_one_button_resets_them(self, browser, odd):
        browser.open(odd)
        order, button = "return springtune.views.cells.table.order.length", browser.driver.find_element(By.ID, "reset")
        assert not button.is_enabled()
        browser.driver.find_element(By.CSS_SELECTOR, ".list [data-column=load]").send_keys("compression")
        browser.driver.find_element(By.CSS_SELECTOR, ".list [data-column=status]").send_keys("solved; the")
        assert browser.ask(order) == 48
        button.click()
        assert browser.ask(order) == 288 and not button.is_enabled()
        assert browser.ask("return document.querySelector('.list [data-column=load]').value") == ""


def test_all_that_takes_the_focus_has_a_name(browser, odd):
    browser.open(odd)
    nodes = []
    for view in views(browser):
        show(browser, view)
        nodes += browser.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    focusable = {"name": "focusable", "value": {"type": "booleanOrUndefined", "value": True}}
    stops = [node for node in nodes if focusable in node.get("properties", [])]
    assert len(stops) > 40
    assert [one for one in stops if not one.get("name", {}).get("value")] == []


def test_on_a_phone_the_error_is_in_view(browser, odd):
    browser.resize(400)
    browser.open(odd)
    cells = (
        "return [...document.querySelectorAll('.list thead th')].findIndex((one) => /deformation/.test(one.innerText))"
    )
    place = browser.ask(cells)
    left, right, low, high = browser.ask(
        "const g = document.querySelector('.list .grid').getBoundingClientRect();"
        "const c = document.querySelector('.list tr[data-place]').children[arguments[0]].getBoundingClientRect();"
        "return [c.left, c.right, g.left, g.right]", place)  # fmt: skip
    assert low < left < right <= high
