"""A study is packed with all that it needs, once it is whole; whatever becomes of the archive is told."""

import base64
import hashlib
import io
import json
import os
import platform
import re
import shutil
import struct
import subprocess
import sys
import warnings
import zipfile
import zlib
from contextlib import chdir
from pathlib import Path, PurePosixPath

import h5py
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from springtune.cli import main
from springtune.studies.archive import contents, crate, reproduction
from springtune.studies.kinds import load_study
from springtune.studies.output import reading
from springtune.studies.output.comparison import Tolerance, compare
from springtune.studies.runs import checked_json, provenance

from campaigns import Campaign
from tables import STUDIES

REPOSITORY = Path(__file__).parents[2]

HOST, PERSON = "a-host-of-its-own", "0000-0002-1825-0097"

STUDY = STUDIES["archive"]

CITATION = f"""
cff-version: 1.2.0
message: Cite it.
title: springtune
license: MIT
keywords: [springs]
authors:
  - {{given-names: Ada, family-names: Example, orcid: "https://orcid.org/{PERSON}", affiliation: Somewhere}}
  - {{name: the example group}}
"""


def run(*arguments):
    return CliRunner().invoke(main, list(map(str, arguments)))


def refused(result, *texts):
    assert result.exit_code == 1 and result.exception.__class__ is SystemExit, result.output
    for text in texts:
        assert text in result.stderr, result.stderr


def write_study(folder):
    """The study, and the files that it names."""
    from springtune import Beam, make_mesh
    from springtune.mesh import write_mesh

    folder.mkdir(exist_ok=True, parents=True)
    write_mesh(folder / "plate mesh.vtu", make_mesh(Beam("20 mm", "10 mm"), "structured", "5 mm"))
    (folder / "forces.csv").write_text("force\n1 kN\n2 kN\n")
    (folder / "one.yaml").write_text(STUDY)
    return folder / "one.yaml"


def make_checkout(folder):
    """What of a checkout an archive needs, with the program as it is."""
    shutil.copytree(REPOSITORY / "src/springtune", folder / "src/springtune", ignore=shutil.ignore_patterns("*.pyc"))
    for name in {*contents.CHECKOUT_FILES} - {contents.CITATION}:
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(REPOSITORY / name, folder / name)
    shutil.copytree(REPOSITORY / "workflow/profiles", folder / "workflow/profiles")
    (folder / "profiles").symlink_to("workflow/profiles")
    (folder / "CITATION.cff").write_text(CITATION)
    (folder / ".gitignore").write_text("results/\n*.pyc\n")


def do(config, chosen=None):
    """Run a study in this process; names of the jobs that ran."""
    campaign = Campaign(config, chosen=chosen)
    campaign.plan.write()
    names = campaign.due()
    for name in names:
        campaign.do(name)
        times = campaign.folder / f"benchmarks/{name}.tsv"
        times.parent.mkdir(exist_ok=True)
        times.write_text("s\th:m:s\tmax_rss\tcpu_time\n0.25\t0:00:00\tNA\t0.50\n")
    return names


def archived_files(result):
    """Files of the archive that was written."""
    assert result.exit_code == 0, result.output
    with zipfile.ZipFile("results/one.crate.zip") as file:
        return {name: file.read(name) for name in file.namelist()}


def page_text(page):
    """What a page to browse holds, unpacked."""
    packed = re.findall(r'<script type="application/octet-stream"[^>]*>([^<]*)<', page)
    return page + "".join(zlib.decompress(base64.b64decode(one)).decode(errors="replace") for one in packed)


def git(*arguments):
    who = ["-c", "user.name=a", "-c", "user.email=a@example.org", "-c", "commit.gpgsign=false"]
    return subprocess.run(["git", *who, *arguments], check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A checkout under git in which a study was run, and the archive of it."""
    folder = tmp_path_factory.mktemp("checkout")
    with pytest.MonkeyPatch.context() as patch, chdir(folder):
        patch.setattr(platform, "node", lambda: HOST)
        make_checkout(folder)
        config = write_study(folder / "config")
        git("init", "-q", "--template=")
        git("add", ".")
        git("commit", "-q", "-m", "All of it")
        git("gc", "-q")  # few files: they are copied for each test
        do(config.relative_to(folder))
        result = run("archive", "results/one")
        assert result.exit_code == 0, result.output
        yield folder


@pytest.fixture
def checkout(made, tmp_path, monkeypatch):
    """A copy of it to spoil, and to be in."""
    folder = tmp_path / "checkout"
    subprocess.run(["cp", "-a", made, folder], check=True)
    (folder / "results/one.crate.zip").unlink()
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture(scope="module")
def packed(made):
    """Files of the archive."""
    with zipfile.ZipFile(made / "results/one.crate.zip") as file:
        return {name: file.read(name) for name in file.namelist()}


@pytest.fixture(scope="module")
def graph(packed):
    return {one["@id"]: one for one in json.loads(packed["ro-crate-metadata.json"])["@graph"]}


class TestContents:
    def test_the_same_study_is_the_same_file(self, checkout, made):
        assert run("archive", "config/one.yaml", "--out", "twice.zip").exit_code == 0
        assert Path("twice.zip").read_bytes() == (made / "results/one.crate.zip").read_bytes()

    def test_every_file_has_its_checksum_in_both_lists(self, packed, graph):
        sums = dict(reversed(line.split("  ", 1)) for line in packed["SHA256SUMS"].decode().splitlines())
        assert sums.keys() == packed.keys() - {"SHA256SUMS"}
        for name, content in packed.items():
            digest = hashlib.sha256(content).hexdigest()
            assert sums.get(name, digest) == digest
            if name not in ("SHA256SUMS", "ro-crate-metadata.json"):
                entity = graph[name.replace(" ", "%20")]
                assert (entity["sha256"], entity["contentSize"]) == (digest, str(len(content)))

    def test_all_is_there_that_another_machine_needs(self, packed):
        assert {
            "code/Snakefile", "code/Makefile", "code/tools/setup.sh", "code/requirements/run.txt",
            "code/config/one.yaml", "code/config/forces.csv", "code/config/plate mesh.vtu",
            "code/profiles/default/config.yaml",
            "code/src/springtune/studies/kinds/scenes/mesh.py", "results/one/dataset.nc", "results/one/index.html",
            "results/one/summary.txt", "results/one/done/collect.json", "results/one/benchmarks/collect.tsv",
        } <= packed.keys()  # fmt: skip
        assert not [name for name in packed if "/.git/" in name or "solutions" in name or name.endswith(".pyc")]

    def test_nothing_names_the_machine_or_its_folders(self, packed, made):
        for name, content in packed.items():
            for secret in (HOST, str(made), str(made.parent), str(Path.home())):
                # The program has its own texts, this test's among them.
                assert name.startswith("code/") or secret.encode() not in content, (name, secret)

    def test_the_dataset_is_the_studys_but_for_the_machines_name(self, packed, made, tmp_path):
        (tmp_path / "dataset.nc").write_bytes(packed["results/one/dataset.nc"])
        with reading.open(made / "results/one") as before, reading.open(tmp_path) as after:
            assert not compare(before, after, Tolerance(0.0, 0.0)).different
            assert set(after.attrs["host"]) == {"-"} and before.attrs["host"] == HOST
            assert {k: v for k, v in before.attrs.items() if k != "host"} == {
                k: v for k, v in after.attrs.items() if k != "host"
            }
            assert "config/forces.csv" in json.loads(after.attrs["inputs"])

    def test_a_title_is_a_text(self, packed, graph):
        title = "One <script>network</script> of `a file's` [mesh](javascript:x)"
        assert graph["./"]["name"] == title
        heading = packed["README.md"].decode().splitlines()[0]
        assert heading == r"# One \<script\>network\</script\> of \`a file's\` \[mesh\](javascript:x)"

    def test_metadata_says_who_and_under_which_licence_as_citation_does(self, graph):
        root = graph["./"]
        people = [graph[one["@id"]] for one in root["author"]]
        assert [one["name"] for one in people] == ["Ada Example", "the example group"]
        assert [one["@type"] for one in people] == ["Person", "Organization"]
        assert people[0]["@id"].endswith(PERSON) and graph[people[0]["affiliation"]["@id"]]["name"] == "Somewhere"
        assert graph[root["license"]["@id"]]["@id"] == "https://spdx.org/licenses/MIT"
        assert root["keywords"] == "springs"

    def test_metadata_tells_the_run_and_its_jobs(self, graph):
        workflow = graph[graph["./"]["mainEntity"]["@id"]]
        assert workflow["@id"] == "code/Snakefile" and "ComputationalWorkflow" in workflow["@type"]
        job = graph["#job-collect"]
        assert {one["@id"] for one in job["result"]} >= {"results/one/dataset.nc", "results/one/done/collect.json"}
        used = [graph[one["@id"]] for one in job["resourceUsage"]]
        assert [(one["value"], one["unitCode"]) for one in used] == [
            ("0.25", "SEC"),
            ("0.50", "SEC"),
        ]  # NA is no number
        assert graph["#run"]["instrument"]["@id"] == "code/Snakefile"
        given = {one["@id"] for one in graph["#run"]["object"]}
        assert given == {"code/config/one.yaml", "code/config/forces.csv", "code/config/plate%20mesh.vtu"}
        software = {one["name"]: one for one in graph.values() if one["@type"] == "SoftwareApplication"}
        assert software["python"]["softwareVersion"] == platform.python_version() and "numpy" in software
        assert {"#machine-cores", "#machine-architecture"} <= graph.keys()

    @pytest.mark.parametrize("note", ["commands", "elsewhere"])
    def test_no_machine_is_told_where_others_computed_some_of_it(self, checkout, monkeypatch, note):
        monkeypatch.setattr(platform, "node", lambda: HOST)
        Path(f"results/one/tasks/{note}.json").write_text("{}")
        result = run("archive", "results/one", "--out", "merged.zip")
        assert result.exit_code == 0 and "computed on other machines, at least in part" in result.output
        with zipfile.ZipFile("merged.zip") as file:
            assert b"#machine-" not in file.read("ro-crate-metadata.json")

    def test_nothing_is_packed_but_what_the_study_needs(self, checkout):
        for name in ("docs/own.md", "tests/own.py", "config/other.yaml", "notes.txt", "tools/other.sh"):
            (checkout / name).parent.mkdir(exist_ok=True)
            Path(name).write_text("known to git")
        git("add", ".")
        git("commit", "-q", "-m", "More")
        found = archived_files(run("archive", "results/one"))
        inside = {name.removeprefix("code/") for name in found if name.startswith("code/")}
        folders = ("src/", "workflow/", "requirements/", "profiles/")
        own = {"config/one.yaml", "config/forces.csv", "config/plate mesh.vtu"}
        assert {name for name in inside if not name.startswith(folders)} == {*contents.CHECKOUT_FILES, *own} - {
            *filter(lambda name: name.startswith(folders), contents.CHECKOUT_FILES)
        }

    def test_commit_and_differences_are_told_of_program_and_study_alone(self, checkout):
        for name in (
            "Snakefile",
            "Makefile",
            "pyproject.toml",
            "config/one.yaml",
            "workflow/profiles/slurm/config.yaml",
        ):
            with open(name, "a") as file:
                file.write(f"# changed {name}\n")
        Path("workflow/profiles/own.yaml").write_text("# changed token")
        git("add", "workflow/profiles/own.yaml")
        assert "collect" in do("config/one.yaml")  # the dataset has the study's text
        result = run("archive", "results/one")
        assert "packed as it is, with code.diff\n" in result.stdout, result.output
        assert "(--untracked packs them): workflow/profiles/own.yaml\n" in result.stdout
        assert (
            "packed as committed, since profiles are a user's own: profiles/slurm/config.yaml, workf" in result.stdout
        )
        found = archived_files(result)
        lines = [line for line in found["code.diff"].decode().splitlines() if line.startswith("+# ")]
        assert lines == ["+# changed Snakefile", "+# changed config/one.yaml"]
        assert b"# changed" in found["code/Snakefile"] and b"# changed" in found["code/Makefile"]
        assert "code/profiles/slurm/config.yaml" in found and "code/workflow/profiles/slurm/config.yaml" in found
        for name, content in found.items():
            assert b"# changed workflow" not in content and b"# changed token" not in content, name
        assert git("rev-parse", "HEAD").strip() in found["ro-crate-metadata.json"].decode()

    UNKNOWN = "src/token.txt", "tools/token.txt", "workflow/.env", "workflow/ignored.yaml"

    def test_files_that_git_does_not_know_are_named_and_left_out(self, checkout):
        for name in (*self.UNKNOWN, "secret.txt"):
            Path(name).write_text("a token")
        (checkout / ".gitignore").write_text("results/\n*.pyc\n.env\nignored.*\n")
        result = run("archive", "results/one")
        assert f"(--untracked packs them): {', '.join(self.UNKNOWN)}\n" in result.stdout, result.output
        assert not [name for name, content in archived_files(result).items() if content == b"a token"]
        result = run("archive", "results/one", "--untracked", "--force")
        assert f"files that git does not know: {', '.join(self.UNKNOWN)}\n" in result.stdout, result.output
        found = archived_files(result)
        assert {name for name, content in found.items() if content == b"a token"} == {
            f"code/{name}" for name in self.UNKNOWN
        }
        assert "src/token.txt, tools" in found["ro-crate-metadata.json"].decode()

    def test_links_that_lead_out_are_left_out(self, checkout, tmp_path):
        (tmp_path / "token.txt").write_text("a token")
        Path("workflow/link.yaml").symlink_to(tmp_path / "token.txt")
        git("add", "workflow/link.yaml")
        git("commit", "-q", "-m", "Link")
        for option in ((), ("--untracked", "--force")):
            result = run("archive", "results/one", *option)
            assert "workflow/link.yaml\n" in result.stdout, result.output
            assert b"a token" not in archived_files(result).values()

    def test_a_module_that_git_does_not_know_is_asked_for(self, checkout):
        git("rm", "-q", "--cached", "src/springtune/units.py")
        refused(
            run("archive", "results/one"),
            "src/springtune/units.py: the study is computed by it, and git does not know it; add it to git, or pack",
        )
        assert run("archive", "results/one", "--untracked").exit_code == 0

    def test_without_git_files_are_packed_by_their_endings(self, checkout):
        shutil.rmtree(".git")
        for name in ("src/token.txt", "workflow/.env", "src/.own.py"):
            Path(name).write_text("a token")
        result = run("archive", "results/one")
        assert "no git here" in result.stdout and "src/ .css, .html, .jinja, .js, .py" in result.stdout, result.output
        assert "src/.own.py, src/token.txt, workflow/.env\n" in result.stdout
        found = archived_files(result)
        assert {"code/Snakefile", "code/profiles/default/config.yaml", "code/src/springtune/units.py"} <= found.keys()
        assert "from no git checkout" in found["README.md"].decode() and b"a token" not in found.values()

    @pytest.mark.skipif(not (REPOSITORY / ".git").exists(), reason="there is no git to ask")
    def test_without_git_nothing_is_forgotten_that_git_knows(self):
        known = git("-C", REPOSITORY, "ls-files", *contents.FOLDERS).splitlines()
        assert len(known) > 300 and all(name.endswith(contents.FOLDERS[name.partition("/")[0]]) for name in known)

    def test_the_page_says_no_more_of_the_machine_than_the_dataset(self, packed, made):
        before = page_text((made / "results/one/index.html").read_text())
        assert HOST in before and HOST not in page_text(packed["results/one/index.html"].decode())

    def test_what_is_left_out_on_request_is_nowhere(self, checkout):
        with open("Snakefile", "a") as file:
            file.write("# token-of-mine\n")
        Path("results/one/done/collect.json").unlink()
        do("config/one.yaml")
        assert "token-of-mine" in page_text(Path("results/one/index.html").read_text())
        result = run("archive", "results/one", "--no-diff", "--no-host")
        assert "packed as it is\n" in result.stdout and "other machines" not in result.stdout, result.output
        found = archived_files(result)
        told = [name for name, content in found.items() if b"token-of-mine" in content]
        assert told == ["code/Snakefile"] and b"#machine" not in found["ro-crate-metadata.json"]
        assert "token-of-mine" not in page_text(found["results/one/index.html"].decode())
        assert "'git_diff' and 'host' of its attributes are blanked" in found["ro-crate-metadata.json"].decode()

    def test_what_a_run_leaves_out_stays_out(self, checkout, monkeypatch):
        monkeypatch.setattr(platform, "node", lambda: HOST)
        with open("Snakefile", "a") as file:
            file.write("# token-of-mine\n")

        def told():
            page = page_text(Path("results/one/index.html").read_text())
            with reading.open("results/one") as tree:
                texts = [tree.attrs["git_diff"] + tree.attrs["host"], page]
            return [[word in text for word in ("token-of-mine", HOST)] for text in texts]

        assert do("config/one.yaml", {"no_diff": True, "no_host": True})[0] == "collect"
        assert told() == [[False, False]] * 2
        assert run("verify", "results/one", "--scenes", "0").exit_code == 0
        assert do("config/one.yaml") == []  # nothing is said: as before
        found = archived_files(run("archive", "results/one"))
        assert "code.diff" not in found and b"#machine" not in found["ro-crate-metadata.json"]
        assert do("config/one.yaml", {"no_diff": False})[0] == "collect"
        assert told() == [[True, False]] * 2

    def test_a_study_outside_of_the_checkout_comes_with_its_files(self, checkout, tmp_path):
        config = write_study(tmp_path / "elsewhere/deep")
        config.write_text(STUDY.replace("forces.csv", "../forces.csv"))
        (config.parent / "forces.csv").rename(config.parents[1] / "forces.csv")
        do(config)
        assert run("archive", config, "--out", "one.zip").exit_code == 0
        with zipfile.ZipFile("one.zip") as file:
            inputs = {name for name in file.namelist() if name.startswith("inputs/")}
            assert inputs == {"inputs/deep/one.yaml", "inputs/forces.csv", "inputs/deep/plate mesh.vtu"}
            file.extractall("unpacked")
            assert "make study STUDY=../inputs/deep/one.yaml" in file.read("README.md").decode()
        assert len(load_study("unpacked/inputs/deep/one.yaml").scenes) == 2

    def test_the_store_is_packed_where_it_is_asked_for(self, checkout):
        result = run("archive", "results/one", "--with-store")
        assert result.stdout.startswith("the store: "), result.output
        with zipfile.ZipFile("results/one.crate.zip") as file:
            stored = {PurePosixPath(name).parts[2] for name in file.namelist() if name.startswith("results/one/")}
        assert {"meshes", "references", "solutions", "tasks"} <= stored


class TestRefusals:
    def test_what_is_not_whole(self, checkout):
        Path("results/one/summary.txt").unlink()
        refused(
            run("archive", "results/one"),
            "results/one: is not what the study asks for now",
            "collect: results/one/summary.txt is missing",
            "make it: springtune run config/one.yaml",
        )
        assert not list(Path("results").glob("*.zip*"))

    def test_what_is_damaged(self, checkout):
        with open("results/one/dataset.nc", "ab") as file:
            file.write(b"more")
        refused(run("archive", "results/one"), "dataset.nc is damaged", "verify config/one.yaml --set-aside, then")

    def test_what_was_made_before_the_study_changed(self, checkout):
        Path("config/one.yaml").write_text(STUDY.replace("title: One", "title: Another"))
        refused(run("archive", "results/one"), "collect: the study or the program changed since")

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("title: springtune", "CITATION.cff: has no 'authors'"),
            (CITATION.replace("license: MIT", ""), "CITATION.cff: has no 'license'"),
            (CITATION.partition("authors")[0] + "authors: [{email: a@b.c}]", "has no name"),
            ("a: [", "CITATION.cff: cannot be read"),
        ],
    )
    def test_who_made_it_is_not_told(self, checkout, text, said):
        Path("CITATION.cff").write_text(text)
        refused(run("archive", "results/one"), said)
        assert not list(Path("results").glob("*.zip*"))

    @pytest.mark.parametrize("name", ["Makefile", "hatch_build.py", "requirements/run.txt"])
    def test_what_nobody_could_run(self, checkout, name):
        Path(name).unlink()
        refused(run("archive", "results/one"), f"{name}: missing in this folder")

    def test_a_program_that_did_not_make_the_results(self, checkout):
        Path("src/springtune/units.py").write_text("")
        refused(run("archive", "results/one"), "src/springtune/units.py of this folder is not that of the library")

    @pytest.mark.parametrize(
        ("place", "name"),
        [("../data/forces.csv", "data/forces.csv"), ("../forces.csv", ""), ("../../data/forces.csv", ""), ("", "")],
        ids=["in a folder beside", "beside", "further away", "absolute"],
    )
    def test_files_that_an_archive_could_not_hold(self, checkout, place, name):
        path = (checkout / place / ("" if place else "../forces.csv")).resolve()
        path.parent.mkdir(exist_ok=True)
        path.write_text("force\n1 kN\n")
        given = f"../{place}" if place else str(path)
        Path("config/one.yaml").write_text(STUDY.replace("forces.csv", given))
        study = load_study("config/one.yaml")
        if name:
            assert contents.archived_names(study, provenance.input_files(study), checkout)[path] == name
            return
        with pytest.raises(contents.ArchiveError, match="could not hold" if place else "this machine's own"):
            contents.archived_names(study, provenance.input_files(study), checkout)

    def test_a_call_from_elsewhere_a_target_that_is_there_or_no_zip(self, checkout, tmp_path, monkeypatch):
        Path("there.zip").write_text("mine")
        refused(run("archive", "results/one", "--out", "there.zip"), "there.zip: is there already; give --force")
        assert Path("there.zip").read_text() == "mine"
        assert run("archive", "results/one", "--out", "one.tar").exit_code == 2
        refused(run("archive", "results/one", "--out", "no/one.zip"), "folder no does not exist")
        monkeypatch.chdir(tmp_path)
        refused(run("archive", "checkout/results/one"), "call it there: cd checkout")

    def test_a_missing_library(self, checkout, monkeypatch):
        monkeypatch.setitem(sys.modules, "rocrate", None)
        refused(
            run("archive", "results/one"),
            "rocrate is missing; install the extra, in a clone `pip install '.[archive]'`",
        )


def rewritten(packed, target, method=zipfile.ZIP_STORED, **changes):
    """An archive of which some files are others, or None: not there."""
    with zipfile.ZipFile(target, "w", method) as file:
        for name, content in (packed | changes).items():
            if content is not None:
                file.writestr(name, content)
    return target


class TestVerify:
    def test_an_archive_as_it_was_packed(self, made):
        result = run("verify", made / "results/one.crate.zip")
        assert result.exit_code == 0 and "faults: 0" in result.stdout and "--reproduce" in result.stdout
        assert hashlib.sha256((made / "results/one.crate.zip").read_bytes()).hexdigest() in result.stdout

    @pytest.mark.parametrize(
        ("changes", "said"),
        [
            ({"results/one/dataset.nc": b"other"}, "results/one/dataset.nc is damaged"),
            ({"code/src/springtune/units.py": None}, "code/src/springtune/units.py is missing"),
            ({"code/src/springtune/more.py": b"pass"}, "code/src/springtune/more.py was not packed"),
            ({"SHA256SUMS": None}, "SHA256SUMS is missing"),
            ({"../out.txt": b""}, "../out.txt leads out of the archive"),
        ],
        ids=["damaged", "missing", "more", "without sums", "leads out"],
    )
    def test_what_became_of_it(self, packed, tmp_path, changes, said):
        result = run("verify", rewritten(packed, tmp_path / "one.zip", **changes), "--reproduce")
        assert result.exit_code == 1 and said in " ".join(result.stdout.split()), result.output
        assert "it is not computed again" in result.stdout

    def test_nothing_in_it_forges_a_line(self, packed, tmp_path):
        """Neither a name of a file, nor what the metadata says of the study."""
        forged = "a\x1b[2K\n0 faults\r\u202e"
        content = json.loads(packed["ro-crate-metadata.json"])
        next(one for one in content["@graph"] if one["@id"] == "./")["name"] = forged
        changes = {"ro-crate-metadata.json": json.dumps(content).encode(), forged: b""}
        path = rewritten(packed, tmp_path / "one.zip", **changes)
        result = CliRunner().invoke(main, ["verify", str(path)], color=True)
        assert result.exit_code == 1 and r"a\x1b[2K\n0 faults\r\u202e, study one" in result.stdout
        assert r"a\x1b[2K\n0 faults\r\u202e  was not packed" in result.stdout and "faults: 2" in result.stdout
        assert not {*result.output} & {"\x1b", "\r", "\u202e"} and "\n0 faults" not in result.output

    @pytest.mark.parametrize("content", [b"", b"text", b"PK\x03\x04"], ids=repr)
    def test_what_is_no_zip(self, tmp_path, content):
        (tmp_path / "one.zip").write_bytes(content)
        refused(run("verify", tmp_path / "one.zip"), "is no whole zip file")

    def test_what_is_another_zip_or_not_there(self, packed, tmp_path):
        refused(run("verify", tmp_path / "none.zip"), "none.zip: cannot be read")
        rewritten({"a.txt": b""}, tmp_path / "other.zip")
        refused(run("verify", tmp_path / "other.zip"), "is no archive of a study")
        rewritten(packed, tmp_path / "one.zip", **{"ro-crate-metadata.json": b'{"@graph": []}'})
        refused(run("verify", tmp_path / "one.zip"), "its ro-crate-metadata.json is damaged")

    @pytest.mark.parametrize("name", ["ro-crate-metadata.json", "SHA256SUMS", "code/blanks.py"])
    def test_sizes_are_compared_before_anything_is_read(self, packed, tmp_path, monkeypatch, name):
        files = {"ro-crate-metadata.json": b"{}", name: bytes(17_000_000)}
        path = rewritten(files, tmp_path / "one.zip", zipfile.ZIP_DEFLATED)
        monkeypatch.setattr(zipfile.ZipFile, "open", lambda *_: pytest.fail("is read"))
        result = run("verify", path)
        refused(result, f"{path}: ", " bytes unpacked, and at most ", "; get it again")
        assert result.stderr.count("\n") == 1

    def test_members_are_counted_before_anything_is_read(self, tmp_path, monkeypatch):
        path, end = rewritten({"a": b""}, tmp_path / "one.zip"), struct.Struct("<4s4H2LH")
        content = path.read_bytes()
        member = content[content.index(b"PK\1\2") : -end.size]
        path.write_bytes(content[: -end.size] + 100_000 * member + end.pack(b"PK\5\6", 0, 0, 9, 9, 4_700_047, 31, 0))
        monkeypatch.setattr(zipfile.ZipFile, "open", lambda *_: pytest.fail("is read"))
        refused(run("verify", path), f"{path}: has 100001 files, and at most 100000 are read; get it again")
        path.write_bytes(bytes(20_000_000) + end.pack(b"PK\5\6", 0, 0, 9, 9, 20_000_000, 0, 0))
        refused(run("verify", path), "is no whole zip file (more than 16777216 bytes at once)")

    @pytest.mark.parametrize(
        "content",
        [
            b"[" * 200_000 + b"]" * 200_000,
            b'{"@graph": ' + b"[" * 990 + b"]" * 990 + b"}",
            b"\xff\xfe\x00",
            b'{"@graph": [{"@id": []}]}',
            b'{"@graph": [7]}',
            b"9" * 5000,
            ("@id", 7),
            ("@id", "\ud800"),
            ("sha256", ["f00d"]),
            ("value", "inf"),
            ("value", {}),
            ("name", ["a"]),
            ("version", None),
            ("workExample", {"@id": "../../etc/passwd"}),
            ("workExample", {"@id": "results/dataset.nc"}),
            ("workExample", [1]),
            ("conformsTo", [[]]),
        ],
        ids=lambda given: ascii(given)[:40],
    )
    def test_metadata_that_is_malformed_is_one_line(self, packed, tmp_path, content):
        name = "ro-crate-metadata.json"
        if isinstance(content, tuple):
            key, value = content
            found = json.loads(packed[name])
            first = next(one for one in found["@graph"] if key in one and (key != "value" or one["@id"][-2:] == "-s"))
            if key in ("name", "version", "conformsTo"):
                first = next(one for one in found["@graph"] if one["@id"] == "./")
            first[key] = value
            content = json.dumps(found).encode()
        path = rewritten(packed, tmp_path / "one.zip", SHA256SUMS=None, **{name: content})
        result = run("verify", path)
        refused(result, f"{path}: is no archive of a study of springtune, or its {name} is damaged; get it again")
        assert result.stderr.count("\n") == 1 and not result.stdout

    @pytest.mark.parametrize(
        ("name", "said"),
        [
            ("/etc/passwd", "leads out of the archive"),
            ("code/../../x", "leads out of the archive"),
            ("code\\..\\x", "leads out of the archive"),
            ("code/./x", "is no plain name"),
            ("code//x", "is no plain name"),
            ("x" * 2000, "is no plain name"),
            ("", "is no plain name"),
            ("code/Snakefile", "is there twice"),
            ("code/Snakefile/x", "is a file and a folder"),
            ("link", "is a link or a device"),
            ("other", "is packed by another method"),
        ],
    )
    def test_members_that_are_no_plain_files(self, packed, tmp_path, name, said):
        path, info = rewritten(packed, tmp_path / "one.zip"), zipfile.ZipInfo(name)
        if name == "link":
            info.external_attr = 0o120777 << 16
        if name == "other":
            info.compress_type = zipfile.ZIP_BZIP2
        with zipfile.ZipFile(path, "a") as file, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of names that are there twice
            file.writestr(info, "/etc/passwd")
        result = run("verify", path)
        assert result.exit_code == 1 and said in result.stdout, result.output
        assert not isinstance(result.exception, Exception) and "faults: 0" not in result.stdout

    def test_what_is_no_regular_file_is_not_read(self, tmp_path):
        os.mkfifo(tmp_path / "one.zip")
        refused(
            run("verify", tmp_path / "one.zip"),
            "one.zip: cannot be read (a pipe or a device, not a file); give an archive",
        )

    def test_what_could_not_be_checked_is_not_written(self):
        def files(number, size):
            text = contents.Packed("", b"", "", size)
            return dict.fromkeys([*map(str, range(number)), "ro-crate-metadata.json", "SHA256SUMS"], text)

        crate.check_limits(files(99_998, 2**24))
        for number, size in ((99_999, 1), (1, 2**24 + 1)):
            with pytest.raises(contents.ArchiveError, match="an archive holds at most 100000, with 16777216 bytes"):
                crate.check_limits(files(number, size))

    def test_options_of_the_other_kind_are_wrong_calls(self, made):
        path = made / "results/one.crate.zip"
        assert run("verify", path, "--scenes", "3").exit_code == 2
        assert run("verify", path, "--set-aside").exit_code == 2
        assert run("verify", made / "results/one", "--reproduce").exit_code == 2

    @settings(max_examples=8)
    @given(place=st.integers(0, 10**9), bit=st.integers(0, 7))
    def test_no_flipped_bit_passes_for_another_content(self, made, packed, place, bit):
        changed = bytearray((made / "results/one.crate.zip").read_bytes())
        changed[place % len(changed)] ^= 1 << bit
        path = made / "flipped.zip"
        path.write_bytes(changed)
        try:
            faults = reproduction.check(path).faults
        except reproduction.ReproductionError:
            return
        if not faults:  # a bit that says nothing of the content, such as of a time
            with zipfile.ZipFile(io.BytesIO(changed)) as file:
                assert {name: file.read(name) for name in file.namelist()} == packed


class TestResults:
    """`springtune verify` of the results themselves."""

    def test_every_damaged_file_is_named_and_set_aside(self, checkout):
        folder, command = Path("results/one"), ("verify", "results/one", "--scenes", "0")
        before = run(*command)
        assert before.exit_code == 0 and "faults: 0" in before.stdout, before.output
        products = {path.stem: checked_json.demand(path)["products"] for path in folder.glob("done/*.json")}
        everything = [*folder.glob("done/*.json"), *folder.glob("tasks/*.json")]
        everything += [Path(name) for made in products.values() for name in made]
        assert f"{len(everything)} files compared" in before.stdout
        page, solved = ([*made] for name, made in products.items() if name.startswith(("present_scenes", "solve")))
        damaged = [*map(Path, page), *(folder / name for name in ("dataset.nc", "summary.txt", "index.html"))]
        damaged += [folder / "done/solve_0.json", folder / "tasks/bundles.json", Path(solved[0])]
        damaged += folder.glob("meshes/*")
        assert len(damaged) > 9 and len(page) > 1  # several of one job
        for path in damaged:
            path.write_bytes(path.read_bytes()[:-3] + b"???")
        gone = next(folder.glob("references/*.h5"))
        gone.unlink()
        result = run(*command, "--set-aside")
        assert result.exit_code == 1 and f"faults: {len(damaged) + 1}\n" in result.stdout, result.output
        assert f"{gone} is missing" in result.stdout
        moved = {line.split()[-1] for line in result.stdout.splitlines() if "  set aside:" in line}
        assert moved == {*map(str, damaged)}
        for path in damaged:
            assert f"{path} is damaged\n" in result.stdout and not path.exists()
            assert path.with_name(f"{path.name}.damaged").exists()
        do("config/one.yaml")
        after = run(*command)
        assert after.exit_code == 0 and "faults: 0" in after.stdout, after.output
        assert f"{len(everything)} files compared" in after.stdout

    def test_more_faults_than_a_screen_has_lines_are_named(self, checkout):
        record = Path("results/one/done/collect.json")
        found = checked_json.demand(record)
        found["products"] |= {f"results/one/{number}.csv": [1, 1, "0"] for number in range(60)}
        checked_json.write(record, found)
        result = run("verify", "results/one", "--scenes", "0")
        assert result.stdout.count(".csv is missing\n") == 60 and "faults: 60\n" in result.stdout, result.stdout


class TestEnvironment:
    def test_locked_versions_are_those_for_this_machine(self, tmp_path):
        lock = tmp_path / "lock.txt"
        lock.write_text(
            "# by uv\nnumpy==0.1 \\\n    --hash=sha256:00\n"
            "PyYAML==6.0 ; python_version >= '3'\nnone==1 ; os_name == 'x'\n"
        )
        assert contents.locked(lock) == {"numpy": "0.1", "pyyaml": "6.0"}
        assert contents.departures(lock)["numpy"][0] == "0.1"

    def test_another_python_is_another_environment(self, tmp_path):
        (tmp_path / "lock.txt").write_text("")
        here = contents.minor(platform.python_version())
        assert reproduction.own_environment(tmp_path / "lock.txt", platform.python_version()) == {}
        assert reproduction.own_environment(tmp_path / "lock.txt", "3.99.1") == {"python": ("3.99", here)}

    @pytest.mark.parametrize(
        ("factor", "machine", "same"),
        [
            (1.0, {}, True),
            (1 + 1e-12, {}, True),  # no machine is told: it may be another one
            (1 + 1e-12, contents.machine(), False),
            (1 + 1e-3, {}, False),
        ],
        ids=["same bits", "another machine", "this machine", "another number"],
    )
    def test_other_bits_pass_where_software_or_machine_differ_alone(self, made, tmp_path, factor, machine, same):
        shutil.copy(made / "results/one/dataset.nc", tmp_path / "dataset.nc")
        with h5py.File(tmp_path / "dataset.nc", "a") as file:
            file["displacement"][...] = factor * file["displacement"][...]
        found = reproduction.compared(made / "results/one/dataset.nc", tmp_path / "dataset.nc", machine)
        assert found.same is same and found.exact.different is (factor != 1.0)

    @pytest.mark.parametrize(
        ("status", "error", "ended_otherwise", "same"),
        [([1, 1], [0.1, 0.2], 0, True), ([1, 5], [0.1, np.nan], 1, True), ([1, 1], [0.1, 0.3], 0, False)],
        ids=["the same", "not done here", "another number"],
    )
    def test_a_benchmark_is_compared_where_its_cases_ended_alike(
        self, made, tmp_path, status, error, ended_otherwise, same
    ):
        meanings = {"flag_values": np.arange(6, dtype="i1"), "flag_meanings": "a solved c d e failed"}
        files = tmp_path / "before.nc", tmp_path / "after.nc"
        for path, flags, values, seconds in zip(files, ([1, 1], status), ([0.1, 0.2], error), (1.0, 2.0)):
            shutil.copy(made / "results/one/dataset.nc", path)
            data = xr.Dataset({"error": ("approach", values), "seconds": ("approach", [seconds, seconds])})
            data["status"] = ("approach", np.array(flags, dtype="i1"), meanings)
            data.to_netcdf(path, mode="a", group="benchmark", engine="h5netcdf")
        found = reproduction.compared(*files, contents.machine())
        assert (found.same, found.ended_otherwise) == (same, ended_otherwise)


def test_rows_of_parameters_count_among_the_files_of_a_study(made):
    names = {path.name for path in provenance.input_files(load_study(made / "config/one.yaml"))}
    assert names == {"one.yaml", "forces.csv", "plate mesh.vtu"}
