"""A study split over sites: its parts are all of it and no scene twice, and their results together are those of one."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
import yaml
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as some

from springtune.cli import main
from springtune.safe_io import atomic
from springtune.studies.archive import parts as of_parts
from springtune.studies.config.messages import StudyError
from springtune.studies.config.model import Part
from springtune.studies.kinds import load_study
from springtune.studies.kinds.division import dealt, part_of
from springtune.studies.runs import checked_json, records, store
from springtune.studies.runs.plan import plan

from campaigns import Campaign
from tables import STUDIES, refused_calls

CONFIG = Path(__file__).parents[2] / "config"

STUDY = STUDIES["split"]
"""Scenes that two grids ask for, a mesh that two beams share, stiffness from scenes of another part, whole fields."""


def run(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def parts_of(study, count, by):
    return [part_of(replace(study, part=Part(number, count, by, ""))) for number in range(1, count + 1)]


def once(parts, name):
    """What parts have, and whether none of them has what another one has."""
    found = [one for part in parts for one in getattr(part, name)]
    return set(found), len(found) == len(set(found))


def check_division(study, count, by):
    parts = parts_of(study, count, by)
    assert once(parts, "scenes") == ({*study.scenes}, True)
    for name in ("curves", "references", "meshes"):  # which several parts may need
        assert once(parts, name)[0] == {*getattr(study, name)}
    shaped = [one for part in parts if part.parts["shapes"] for one in part.parts["shapes"].scenes]
    assert sorted(map(str, shaped)) == sorted(map(str, study.parts["shapes"].scenes if study.parts["shapes"] else ()))
    tried = [one for part in parts for one in part.parts["stability"]]
    assert sorted(map(str, tried)) == sorted(map(str, study.parts["stability"]))
    for kind in ("laying", "benchmark", "refinement", "moduli"):
        assert sum(bool(part.parts[kind]) for part in parts) == bool(study.parts[kind])
    shares = [share for share, _ in dealt(study, count, by)]
    assert sum(shares) == pytest.approx(1)
    # All that the study stores, and nothing else, under the same keys.
    asked = [
        {key for job in plan(one, Path("nowhere"), 1).jobs.values() for key in of_parts.keys_of(job.content)}
        for one in (study, *parts)
    ]
    of_lists = {key for job in plan(study, Path("nowhere"), 1).jobs.values() if job.stage.name == "calibrate"
                for key in of_parts.keys_of(job.content)}  # fmt: skip
    assert asked[0] - of_lists <= set().union(*asked[1:]) <= asked[0]
    return parts


@pytest.mark.parametrize(
    "name",
    [
        "quick",
        "shapes",
        "sobol",
        "stability",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("paper", "block", "definitions")),
    ],
)
@pytest.mark.parametrize("by", ["mesh", "grid"])
def test_parts_of_our_studies_are_all_of_them(name, by):
    study = load_study(CONFIG / f"{name}.yaml")
    count = 2 if by == "grid" else 5
    if by == "grid" and name in ("shapes", "sobol"):  # all of whose scenes are one piece then
        with pytest.raises(StudyError, match=r"1 grids and sections cannot be 2 parts.*--by mesh"):
            dealt(study, 2, "grid")
        return
    parts = check_division(study, count, by)
    if by == "mesh" and name == "stability":
        assert sum(bool(part.parts["stability"]) for part in parts) > 1  # which nearly all of its cost is


def few(*values):
    return some.lists(some.sampled_from(values), min_size=1, max_size=len(values), unique=True)


grids = some.fixed_dictionaries(
    {
        "beam": few("small", "thick"),
        "mesh_type": few("structured", "right"),
        "mesh_size": few("5 mm", "2.5 mm"),
        "material": few("steel", "rubber"),
        "load": few("traction", "compression", "bending"),
        "force": few("1 N", "2 N", "3 N"),
        "definition": few("lattice", "area", "uniform"),
        "kinematics": few("linear", "nonlinear"),
        "sensitivity": some.booleans().map(lambda flag: str(flag).lower()),
    }
)


@settings(max_examples=10)
@given(some.lists(grids, min_size=1, max_size=3), some.integers(2, 6))
def test_parts_of_any_study_are_all_of_it(tmp_path_factory, listed, count):
    content = yaml.safe_load(STUDY) | {"grids": {f"grid {number}": grid for number, grid in enumerate(listed)}}
    path = tmp_path_factory.mktemp("any") / "any.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    study = load_study(path)
    for by in ("mesh", "grid"):
        most = len(listed) if by == "grid" else len(study.scenes)
        if count > most:
            with pytest.raises(StudyError, match="cannot be"):
                dealt(study, count, by)
        elif by == "mesh" or len({*study.scenes}) >= count:
            try:
                parts = check_division(study, count, by)
            except StudyError as error:  # a grid all of whose scenes another one has is no part
                assert by == "grid" and "cannot be" in str(error)
            else:
                assert all(part.scenes or part.curves or any(part.parts.values()) for part in parts)


def test_costs_are_balanced(tmp_path):
    for name in ("paper", "block"):
        shares = [share for share, _ in dealt(load_study(CONFIG / f"{name}.yaml"), 4, "mesh")]
        assert max(shares) < 0.35
    one = tmp_path / "one.yaml"  # a single mesh
    one.write_text(
        STUDY.split("grids:")[0]
        + """grids:
  all: {beam: small, mesh_type: structured, mesh_size: 5 mm, material: steel, load: traction, definition: lattice,
        force: {from: 0.1 N, to: 1 N, points: 40}, sensitivity: false}"""
    )
    assert [len(part.scenes) for part in parts_of(load_study(one), 4, "mesh")] == [10, 10, 10, 10]


# -- files of parts ----------------------------------------------------------------------------------------------------


@pytest.fixture
def study(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("config").mkdir()
    path = Path("config/many.yaml")
    path.write_text(STUDY)
    return path


def test_files_of_parts_are_studies(study):
    done = run("split", study, "--into", 3)
    assert done.exit_code == 0 and "springtune run config/many-1-of-3.yaml" in done.output
    parts = [load_study(f"config/many-{number}-of-3.yaml") for number in (1, 2, 3)]
    assert once(parts, "scenes") == ({*load_study(study).scenes}, True)
    told = run("scenes", "config/many-2-of-3.yaml").output
    assert f"scenes {len(parts[1].scenes)} part 2 of 3 of the study" in " ".join(told.split())
    before = Path("config/many-1-of-3.yaml").read_bytes()
    assert run("split", study, "--into", 3).exit_code == 0  # the same again
    assert Path("config/many-1-of-3.yaml").read_bytes() == before


def test_files_that_a_study_names_go_with_its_parts(study):
    rows = "pulled:\n    {rows: lists/rows.csv, "
    study.write_text(STUDY.replace("pulled:\n    {", rows).replace("mesh_size: 5 mm, ", "", 1))
    Path("config/lists").mkdir()
    Path("config/lists/rows.csv").write_text("mesh_size\n5 mm\n4 mm\n")
    done = run("split", study, "--into", 2, "--out", "elsewhere")
    assert done.exit_code == 0, done.output
    parts = [load_study(f"elsewhere/many-{number}-of-2.yaml") for number in (1, 2)]
    assert once(parts, "scenes") == ({*load_study(study).scenes}, True)


@pytest.mark.parametrize(("arguments", "message"), refused_calls("split"))
def test_a_study_that_cannot_be_split_is_told(study, arguments, message):
    assert run("split", study, "--into", 2).exit_code == 0
    for name in ("other", "other-1-of-2", "a" * 56):
        Path(f"config/{name}.yaml").write_text(STUDY)
    before = {path: path.read_bytes() for path in Path().rglob("*.yaml")}
    done = run("split", *arguments)
    assert done.exit_code == 1 and message in done.output and len(done.output.splitlines()) == 1
    assert before == {path: path.read_bytes() for path in Path().rglob("*.yaml")}


def test_a_part_that_was_edited_is_refused(study):
    run("split", study, "--into", 2)
    path = Path("config/many-2-of-2.yaml")
    path.write_text(path.read_text().replace("0.1 N", "0.2 N"))
    with pytest.raises(StudyError, match="was changed since it was split.*split it again"):
        load_study(path)
    path.write_text(STUDY + "part: {number: 3, of: 2, study: none}\n")
    with pytest.raises(StudyError, match="part.number: 3 is more than the 2 parts"):
        load_study(path)


# -- results of parts --------------------------------------------------------------------------------------------------


def computed(config):
    """Run a study in this process; its folder."""
    campaign = Campaign(config)
    campaign.plan.write()
    for name in campaign.due():
        if name in campaign.plan.jobs or name == "collect":
            campaign.do(name)
    return campaign.folder


@pytest.fixture(scope="module")
def sites_of(tmp_path_factory):
    """A folder in which a study was run, and its three parts were."""
    folder = tmp_path_factory.mktemp("sites")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        Path("config").mkdir()
        Path("config/many.yaml").write_text(STUDY)
        assert run("split", "config/many.yaml", "--into", 3).exit_code == 0
        for number in (1, 2, 3):
            computed(f"config/many-{number}-of-3.yaml")
        computed("config/many.yaml").rename("results/one-place")
    return folder


PARTS = [f"results/many-{number}-of-3" for number in (1, 2, 3)]


@pytest.fixture
def there(sites_of, tmp_path, monkeypatch):
    """The results of parts, to be spoiled."""
    import shutil

    shutil.copytree(sites_of, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def groups(path):
    with xr.open_datatree(path, engine="netcdf4", decode_cf=False) as tree:
        found = {node.path: node.to_dataset(inherit=False).load() for node in tree.subtree}
    return {path: group.drop_vars([name for name in group if "seconds" in name]) for path, group in found.items()}


def test_results_of_parts_make_the_dataset_of_one_place(there):
    done = run("merge", "config/many.yaml", *PARTS)
    assert done.exit_code == 0, done.output
    campaign = Campaign("config/many.yaml")
    assert not set(campaign.due()) & set(campaign.plan.jobs), "nothing before the dataset is left"
    campaign.do("collect")
    found, wanted = groups("results/many/dataset.nc"), groups("results/one-place/dataset.nc")
    assert found.keys() == wanted.keys() and {"/", "/fields", "/sensitivity", "/moduli"} <= found.keys()
    for path, group in wanted.items():
        xr.testing.assert_equal(found[path], group)
        for name in group.variables:
            assert found[path][name].values.tobytes() == group[name].values.tobytes() or group[name].dtype == object
    again = run("merge", "config/many.yaml", *PARTS)
    assert "0 of them written" in again.output


def test_nothing_runs_before_the_dataset_where_the_study_has_run_before(there):
    """Snakemake compares the time of what a job took here with those of what the merge tells of the jobs before it."""
    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0
    folder = Path("results/many")
    jobs = sorted(folder.glob("done/*.json"))
    for job in jobs:  # as a run leaves them
        atomic.write_text(folder / f"benchmarks/{job.stem}.tsv", "s\n1.0\n")
    here = [job for job in jobs if job.stem.startswith(("sensitivity", "reference"))]
    known = {job: checked_json.read(job) | {"work": {"of this machine": [1, 1.0, 1.0]}} for job in here}
    for job in jobs:
        if job in known:
            checked_json.write(job, known[job])
        else:  # what it did here was something else
            checked_json.write(job, checked_json.read(job) | {"digest": "another"})
    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0
    assert {job: checked_json.read(job) for job in here} == known
    assert {path.stem for path in folder.glob("benchmarks/*")} == {job.stem for job in here}
    command = [sys.executable, "-m", "snakemake", "-n", "--cores", "2", "--configfile", "config/many.yaml"]
    command += ["--snakefile", CONFIG.parent / "Snakefile", "--workflow-profile", "none"]
    told = subprocess.run([*map(str, command)], capture_output=True, text=True)
    assert told.returncode == 0, told.stderr
    counts = dict(re.findall(r"^(\w+) +(\d+)$", told.stdout.partition("Job stats:")[2], re.MULTILINE))
    assert counts == dict.fromkeys(["collect", "browse", "present_scenes", "all"], "1") | {"total": "4"}


def test_folders_may_be_anywhere_and_have_any_name(there):
    Path("results/many-2-of-3").rename("from-the-cluster")
    assert run("merge", "config/many.yaml", PARTS[0], "from-the-cluster", PARTS[2]).exit_code == 0


def test_a_merge_that_was_killed_is_called_again(there):
    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0
    whole = {path: path.read_bytes() for path in sorted(Path("results/many").glob("*/*.h5"))}
    for path in [*whole][::2]:  # as it is left: some files, the beginning of another one, no records
        path.unlink()
    half = path.with_name(f"{path.name}.99999999{atomic.UNFINISHED}")
    half.write_bytes(whole[path][:1000])
    for record in Path("results/many/done").iterdir():
        record.unlink()
    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0
    assert whole == {path: path.read_bytes() for path in sorted(Path("results/many").glob("*/*.h5"))}
    campaign = Campaign("config/many.yaml")
    assert not set(campaign.due()) & set(campaign.plan.jobs) and not half.exists()


def spoiled(path):
    content = bytearray(path.read_bytes())
    content[-100] ^= 1
    path.write_bytes(content)


def stored_file():
    """A file of results that two parts have, or one."""
    return sorted(Path(PARTS[1]).glob("solutions/*.h5"))[0]


def test_what_is_missing_is_named(there):
    done = run("merge", "config/many.yaml", *PARTS[:2])
    assert done.exit_code == 1 and "part 3 of 3 is not among them: " in done.output
    lost = load_study("config/many-3-of-3.yaml")
    assert lost.name_of(lost.scenes[0]) in done.output and not Path("results/many").exists()
    done = run("merge", "config/many.yaml", *PARTS[:2], "--incomplete")
    assert done.exit_code == 0 and "still to be computed:" in done.output and "computes the rest" in done.output
    campaign = Campaign("config/many.yaml")
    assert set(campaign.due()) & set(campaign.plan.jobs)
    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0  # and then the last one


def test_damage_is_named_and_left_out(there):
    path = stored_file()
    spoiled(path)
    done = run("merge", "config/many.yaml", *PARTS)
    assert done.exit_code == 1 and f"1 files ({path} is damaged)" in done.output and "scenes (" in done.output
    assert not Path("results/many").exists()
    assert run("merge", "config/many.yaml", *PARTS, "--incomplete").exit_code == 0
    path.unlink()
    assert f"{path} is missing" in run("merge", "config/many.yaml", *PARTS).output


def test_other_software_is_named(there):
    for path in Path(PARTS[0]).glob("tasks/solve_*.json"):  # as another version would have asked for it
        text = checked_json.read(path)
        text["content"]["files"] = [
            family | {"tasks": [scene | {"key": scene["key"][::-1]} for scene in family["tasks"]]}
            for family in text["content"]["files"]
        ]
        checked_json.write(path, text)
    assert "to its end, where it was computed" in run("merge", "config/many.yaml", *PARTS).output
    with h5py.File(f"{PARTS[0]}/dataset.nc", "r+") as file:
        software = file.attrs["software"]
        file.attrs["software"] = np.bytes_(software.replace(b'"numpy": "', b'"numpy": "1.'))
    done = run("merge", "config/many.yaml", *PARTS)
    assert done.exit_code == 1 and "numpy 1." in done.output and "install the same in both places" in done.output


def test_parts_of_another_study_are_refused(there):
    text = Path("config/many.yaml").read_text()
    Path("config/many.yaml").write_text(text.replace("0.1 N", "0.2 N"))
    done = run("merge", "config/many.yaml", *PARTS)
    assert done.exit_code == 1 and "is a part of another study than config/many.yaml: line" in done.output
    Path("config/many.yaml").write_text(text)
    assert "is not of a part of a study" in run("merge", "config/many.yaml", "results/one-place").output
    assert "there is no such folder" in run("merge", "config/many.yaml", "nowhere").output
    Path("empty").mkdir()
    assert "has no dataset.nc; run this part to its end" in run("merge", "config/many.yaml", "empty").output
    run("split", "config/many.yaml", "--into", 2)
    other = computed("config/many-1-of-2.yaml")
    assert "parts of different splits" in run("merge", "config/many.yaml", other, *PARTS).output


def test_a_scene_of_two_answers_is_refused(there):
    """The folder has a result already under the key of a part's, and it is another one."""
    path = stored_file()
    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0
    other = Path("results/many/solutions") / path.name
    contents = store.contents(other)
    key = next(key for key, one in contents.items() if "displacement" in one)
    store.add(other, {key: contents[key] | {"seconds": 1e3}})
    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0  # what it took is no answer
    store.add(other, {key: contents[key] | {"displacement": 1.0}})
    done = run("merge", "config/many.yaml", *PARTS)
    assert done.exit_code == 1 and "differ, though all that it depends on is the same" in done.output


def test_packs_are_compared(there):
    from springtune.studies.archive import parts

    folder = Path(PARTS[1])
    done = sorted(folder.glob("done/solve_*.json"))
    parts.pack(folder, done, Path("one.tar"))
    parts.pack(folder, done, Path("other.tar"))
    assert Path("one.tar").read_bytes() == Path("other.tar").read_bytes()
    names = parts.unpack(Path("one.tar"), Path("out"))
    assert names and all((Path("out") / name).read_bytes() == (folder / name).read_bytes() for name in names)
    whole = Path("one.tar").read_bytes()
    for size in (0, 100, len(whole) // 2):
        Path("half.tar").write_bytes(whole[:size])
        with pytest.raises(parts.PackError, match="half.tar: is not whole.*publish it again"):
            parts.unpack(Path("half.tar"), Path("out"))
    place = whole.index(store.MAGIC) + 1000
    Path("half.tar").write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
    with pytest.raises(parts.PackError, match="is not what was packed"):
        parts.unpack(Path("half.tar"), Path("out"))
    spoiled(stored_file())
    with pytest.raises(parts.PackError, match="is not what its job made"):
        parts.pack(folder, done, Path("third.tar"))
    assert not Path("third.tar").exists() and records.checksum("one.tar") == records.checksum("other.tar")


def test_fetched_results_are_adopted(there):
    from springtune.studies.archive import parts

    assert run("merge", "config/many.yaml", *PARTS).exit_code == 0
    campaign, made = Campaign("config/many.yaml"), []
    for stage in dict.fromkeys(job.stage.name for job in campaign.plan.jobs.values()):
        made.append(Path(f"{stage}.tar"))
        parts.pack(campaign.folder, sorted(campaign.folder.glob(f"done/{stage}_*.json")), made[-1])
    assert len(checked_json.read(campaign.folder / of_parts.ELSEWHERE)["files"]) == len(
        [*campaign.folder.glob("*/*.h5")]
    ) + len([*campaign.folder.glob("meshes/*")])
    campaign.folder.rename("results/before")
    told = parts.fetch("config/many.yaml", made[:2])
    assert "jobs are left for `springtune run config/many.yaml`" in told
    assert "all that it asks for is here" in parts.fetch("config/many.yaml", made)
    assert not set(Campaign("config/many.yaml").due()) & set(campaign.plan.jobs)
    assert not Path("results/many", parts.UNPACKED).exists()
