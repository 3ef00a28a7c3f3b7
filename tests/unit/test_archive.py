"""A study is packed with all that it needs, once it is whole; whatever becomes of the archive is told."""

import hashlib
import io
import json
import platform
import shutil
import subprocess
import sys
import zipfile
from contextlib import chdir
from pathlib import Path, PurePosixPath

import h5py
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from springtune.campaign import contents, environment, provenance, reproduction
from springtune.cli import main
from springtune.kinds import load_study
from springtune.output import reading
from springtune.output.comparison import Tolerance, compare

from campaigns import Campaign

REPOSITORY = Path(__file__).parents[2]

HOST, PERSON = "a-host-of-its-own", "0000-0002-1825-0097"

STUDY = """
title: One <script>network</script> of `a file's` [mesh](javascript:x)
beams: {20x10: {length: 20 mm, height: 10 mm}}
materials: {steel: {young_modulus: 210 GPa, poisson_ratio: 0.3}}
mesh_files: {plate: [{file: plate mesh.vtu, beam: 20x10, mesh_size: 5 mm}]}
outputs: [tables]
grids:
  one: {rows: forces.csv, beam: 20x10, mesh_type: plate, mesh_size: 5 mm, material: steel, load: traction,
        definition: lattice, sensitivity: false}
"""

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


def do(config):
    """Run a study in this process."""
    campaign = Campaign(config)
    campaign.plan.write()
    for name in campaign.due():
        campaign.do(name)
        times = campaign.folder / f"benchmarks/{name}.tsv"
        times.parent.mkdir(exist_ok=True)
        times.write_text("s\th:m:s\tmax_rss\tcpu_time\n0.25\t0:00:00\tNA\t0.50\n")


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
        git("init", "-q")
        git("add", ".")
        git("commit", "-q", "-m", "All of it")
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
            "code/src/springtune/kinds/scenes/mesh.py", "results/one/dataset.nc", "results/one/index.html",
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

    def test_commit_differences_and_new_files_are_told(self, checkout):
        with open("Snakefile", "a") as file:
            file.write("# changed\n")
        Path("src/own.py").write_text('"""Mine."""\n')
        Path("secret.txt").write_text("mine alone")
        result = run("archive", "results/one")
        assert "code.diff and 1 files that git does not know" in result.stdout, result.output
        with zipfile.ZipFile("results/one.crate.zip") as file:
            assert b"+# changed" in file.read("code.diff") and b"# changed" in file.read("code/Snakefile")
            assert "code/src/own.py" in file.namelist() and "code/secret.txt" not in file.namelist()
            text = file.read("ro-crate-metadata.json").decode()
        assert git("rev-parse", "HEAD").strip() in text and "src/own.py." in text

    def test_without_git_the_program_is_packed_as_it_is(self, checkout):
        shutil.rmtree(".git")
        result = run("archive", "results/one")
        assert "no git here" in result.stdout, result.output
        with zipfile.ZipFile("results/one.crate.zip") as file:
            assert {"code/Snakefile", "code/profiles/default/config.yaml", "code/src/springtune/units.py"} <= {
                *file.namelist()
            }
            assert "from no git checkout" in file.read("README.md").decode()

    @pytest.mark.skipif(not (REPOSITORY / ".git").exists(), reason="there is no git to ask")
    def test_without_git_nothing_is_forgotten_that_git_knows(self):
        known = {name.partition("/")[0] for name in git("-C", REPOSITORY, "ls-files").splitlines()}
        assert known - {*contents.TREE} == {".ci", ".pre-commit-config.yaml"}

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
        refused(run("archive", "results/one"), "springtune[archive]")


def rewritten(packed, target, **changes):
    """An archive of which some files are others, or None: not there."""
    with zipfile.ZipFile(target, "w") as file:
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


class TestEnvironment:
    def test_locked_versions_are_those_for_this_machine(self, tmp_path):
        lock = tmp_path / "lock.txt"
        lock.write_text(
            "# by uv\nnumpy==0.1 \\\n    --hash=sha256:00\n"
            "PyYAML==6.0 ; python_version >= '3'\nnone==1 ; os_name == 'x'\n"
        )
        assert environment.locked(lock) == {"numpy": "0.1", "pyyaml": "6.0"}
        assert environment.departures(lock)["numpy"][0] == "0.1"

    def test_another_python_is_another_environment(self, tmp_path):
        (tmp_path / "lock.txt").write_text("")
        here = environment.minor(platform.python_version())
        assert reproduction.own_environment(tmp_path / "lock.txt", platform.python_version()) == {}
        assert reproduction.own_environment(tmp_path / "lock.txt", "3.99.1") == {"python": ("3.99", here)}

    @pytest.mark.parametrize(
        ("factor", "machine", "same"),
        [
            (1.0, {}, True),
            (1 + 1e-12, {}, True),  # no machine is told: it may be another one
            (1 + 1e-12, environment.machine(), False),
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
        found = reproduction.compared(*files, environment.machine())
        assert (found.same, found.ended_otherwise) == (same, ended_otherwise)


def test_rows_of_parameters_count_among_the_files_of_a_study(made):
    names = {path.name for path in provenance.input_files(load_study(made / "config/one.yaml"))}
    assert names == {"one.yaml", "forces.csv", "plate mesh.vtu"}
