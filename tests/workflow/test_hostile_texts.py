"""A study whose texts mean something elsewhere, from its file to all that is made of it: none is more than a text."""

import csv
import io
import json
import re
import zipfile
from html.parser import HTMLParser

import pytest

import springtune as st
from springtune.studies.output.browse import page

from tables import STUDIES, beside

HOSTILE = (
    "`click <javascript:alert(1)>`__ <script>alert(1)</script> $x_{$ #panic('x') .. raw:: html *a* |b| \\ {{ 7*7 }} {x}"
)

STUDY = STUDIES["hostile_texts"].replace("HOSTILE", json.dumps(HOSTILE))

PRINTED = beside(__file__)["PRINTED"] | {"remark": HOSTILE}
"""A printed cell, with a remark."""


class Tags(HTMLParser):
    """Texts of a page, its scripts, and its links."""

    def __init__(self, content):
        super().__init__()
        self.texts, self.tags, self.links = [], [], []
        self.feed(content)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.links += [value for name, value in attributes if name in ("href", "src")]

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture(scope="module")
def results(run):
    """Folder of the results of one run, and its report."""
    text = io.StringIO()
    csv.writer(text).writerows([PRINTED.keys(), PRINTED.values()])
    run.write("printed.csv", text.getvalue())
    run.write("hostile.yaml", STUDY)
    code, output = run.snakemake("hostile.yaml")
    assert code == 0 and HOSTILE in output, output
    assert "Select jobs" not in output and output.count("\nmesh: done; ") == 1  # as of `springtune run`
    return run.folder / "results/hostile"


def test_the_dataset_has_them_as_they_are(results):
    with st.open(results) as tree:
        assert tree.attrs["title"] == HOSTILE
        assert HOSTILE in tree["shapes"].source.values
        assert HOSTILE in tree.paper_remark.values


def test_the_report_has_all_results_and_no_link_script_or_formula_of_theirs(run, results):
    """Every figure once, every table; nothing is loaded from elsewhere (the template's own links are only shown)."""
    code, output = run.snakemake("hostile.yaml", "--report", run.folder / "report.zip")
    assert code == 0 and "WARNING" not in output and "(ERROR" not in output, output
    with zipfile.ZipFile(run.folder / "report.zip") as archive:
        names = archive.namelist()
        content = archive.read("report/report.html").decode()
    made = [path for path in results.glob("*/*") if path.parent.name in ("figures", "tables") and path.suffix != ".pdf"]
    held = [name.rpartition("/")[2] for name in names if name.startswith("report/data/")]
    assert sorted(held) == sorted(["summary.txt", "index.html", *(path.name for path in made)])
    assert "Deformation error against mesh size" in content and '"runtime"' in content
    assert '"mesh type": "structured"' in content
    assert "One of the results of this study" not in content, "an output without a caption of its own"
    assert not re.search(r'<(script|link|img)[^>]+(src|href)="https?:', content)
    described = json.loads(re.search(r"workflow_desc = (\".*\");?$", content, re.MULTILINE)[1])
    found = Tags(described)
    assert HOSTILE in "".join(found.texts).replace("\n", " ")
    assert "script" not in found.tags
    assert not [link for link in found.links if "alert" in link]
    assert "alert(1)</script>" not in content


def test_tables_and_pages_show_them(results):
    content = (results / "tables/index.html").read_text()
    found = Tags(content)
    assert content.count("<script") == 0 and not [link for link in found.links if ":" in link]
    assert sum(HOSTILE in text for text in found.texts) >= 3  # title, source, remark
    for name in ("table_1.csv",):
        with (results / "tables" / name).open() as file:
            assert HOSTILE in [cell for row in csv.reader(file) for cell in row]
    browsed = Tags(page(results / "dataset.nc"))
    assert HOSTILE in browsed.texts and "alert(1)</script>" not in page(results / "dataset.nc")
