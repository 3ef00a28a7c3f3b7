"""Studies of scenes in engines, with engines of this file: what they ask for, their holes, numbers and figures."""

import csv
import faulthandler
import importlib
import os

import numpy as np
import pytest
import xarray as xr

import springtune as st
from springtune.studies.kinds.engines import RUN_ENDS
from springtune.studies.output.comparison import compare
from springtune.studies.runs.attempts import do_in_worker

from campaigns import Campaign, forget_keys
from tables import STUDIES

ABSENT = "no_such_program_of_springtune"

STUDY = STUDIES["engines"].replace("xpbd", "[ENGINES]")
CURVE = """    curve: {definition: patch, engine: [ENGINES], iterations: [2, 50],
            stiffness_factor: {from: 0.5, to: 8, points: 5, spacing: logarithmic}}
"""


class Toy:
    """An even strain by the springs' mean stiffness, and more of it with few iterations, whatever the stiffness."""

    def __init__(self, net, setting, damping):
        self.points, self.frames = net.points, 0
        strain = 20 * np.abs(net.forces).sum() / net.stiffness.mean() + 0.01 / (setting.iterations * setting.substeps)
        self.moved = net.points * [strain, 0]

    def advance(self, frames):
        self.frames += frames

    def displacements(self):
        return self.moved * self.factor(self.frames)

    @staticmethod
    def factor(frames):
        return 1


def moving(name, factor):
    """Engine whose displacements are those of the toy times a factor of the frames."""
    return type(name, (Toy,), {"factor": staticmethod(factor), "__doc__": name})


def broken(frames):
    """What no engine of ours raises."""
    raise TypeError("a new version takes no frames")


class Aborting(Toy):
    """Ends its process in large steps, as compiled programs do."""

    def __init__(self, net, setting, damping):
        super().__init__(net, setting, damping)
        if setting.substeps == 1:
            faulthandler.disable()
            os.abort()


def missing(net, setting, damping):
    """Needs a module that is not there."""
    module = importlib.import_module(ABSENT)
    return module.Toy(net, setting, damping)


MOVING = {"swinging": lambda frames: 1 + frames % 3, "creeping": lambda frames: 1 + frames}
MOVING |= {"exploding": lambda frames: 1e9, "broken": broken}
TOYS = {"toy": Toy, "aborting": Aborting} | {name: moving(name, factor) for name, factor in MOVING.items()}


@pytest.fixture(autouse=True)
def toys():
    """Engines of this file."""
    for name, made in TOYS.items():
        st.engine(name, program="toys", precisions=("float64",))(made)
    st.engine("missing", program="others", needs=(f"{ABSENT}>=1",), extra="newton", precisions=("float32",))(missing)
    yield
    for name in (*TOYS, "missing"):
        st.ENGINES.discard(name)


@pytest.fixture
def collected(tmp_path, monkeypatch):
    """Dataset of a study of some engines, computed in this folder."""
    monkeypatch.chdir(tmp_path)

    def collect(*names, text=STUDY):
        (tmp_path / "try.yaml").write_text(text.replace("ENGINES", ", ".join(names)))
        return Campaign("try.yaml").collected()

    return collect


@pytest.fixture
def workers(monkeypatch):
    """Tasks run in processes of their own, which end with one, or import what is not there afterwards."""
    monkeypatch.setattr(Campaign, "do_tasks", staticmethod(do_in_worker))


def ends(data):
    """Words of how the runs of a group ended, each once."""
    return {RUN_ENDS[flag] for flag in np.unique(data.engine_status.values)}


def stages_due():
    """Jobs of stages that are to run."""
    campaign = Campaign("try.yaml")
    return [name for name in campaign.due() if name in campaign.bundles]


# -- what is asked for -------------------------------------------------------------------------------------------------


def test_runs_are_every_combination_once_and_in_a_canonical_order(load):
    text = STUDY.replace("ENGINES", "toy, xpbd")
    study = load(text + CURVE.replace("ENGINES", "xpbd"))
    runs = study.parts["engines"]
    assert len(runs) == 2 * 2 * 2 * 2 + 2 * 5 and [one.labels["engine"] for one in runs][:1] == ["xpbd"]
    labels = {(run.labels["precision"], run.labels["dt"]) for run in runs}
    assert labels == {("float64", 1 / 60), ("float64", 5e-3)}
    backwards = text.replace("[1, 100]", "[100, 1]").replace("[toy, xpbd]", "[xpbd, toy]")
    assert load(backwards + CURVE.replace("ENGINES", "xpbd")).parts["engines"] == runs


def test_too_many_runs_and_cells_are_refused(refusal):
    many = f"[{', '.join(map(str, range(1, 2001)))}]"
    text = STUDY.replace("ENGINES", "xpbd")
    assert "16000 combinations (4 engine" in refusal(
        text.replace("[xpbd]", "[xpbd, toy, swinging, creeping]").replace("[1, 100]", many).replace("[1, 4]", "[1]")
    )
    sparse = f"    other: {{definition: patch, engine: xpbd, substeps: {many}}}\n"
    assert "cells of all labels together" in refusal(text.replace("[1, 100]", many).replace("[1, 4]", "[1]") + sparse)


# -- what comes out ----------------------------------------------------------------------------------------------------


def test_every_end_is_in_the_dataset_with_its_reason(collected, workers):
    text = STUDY.replace("iterations: [1, 100], substeps: [1, 4], dt: [1/60 s, 5 ms]", "precision: [own, float32]")
    tree = collected(*TOYS, "missing", text=text.replace("aborting, ", ""))
    data = tree["engines"].to_dataset().squeeze()
    own = {name: "float32" if name == "missing" else "float64" for name in data.engine.values}
    found = {name: RUN_ENDS[data.engine_status.sel(engine=name, precision=own[name]).item()] for name in own}
    assert found == {"toy": "rest", "swinging": "swings", "creeping": "moving", "exploding": "diverged",
                     "broken": "failed", "aborting": "failed", "missing": "absent"}  # fmt: skip
    solved = data.status == st.Status.SOLVED
    assert (solved == (data.engine_status == RUN_ENDS.index("rest"))).all()
    assert (np.isfinite(data.displacement) == solved).all() and (np.isfinite(data.error) == solved).all()
    assert (data.message.values[~solved & (data.status.values != 0)] != "").all()
    refused = data.sel(precision="float32", engine="toy")
    assert RUN_ENDS[refused.engine_status.item()] == "refused"
    assert "'float32' is unknown to engine 'toy'" in refused.message.item()
    absent = data.sel(precision="float32", engine="missing")
    assert f"needs {ABSENT}>=1; install the extra" in absent.message.item()
    assert "broken: TypeError: a new version takes no frames" in data.message.sel(precision="float64").values
    assert "the process that solved it died" in str(data.message.sel(engine="aborting", precision="float64").item())
    assert data.program.sel(engine="missing").item() == "others" and data.scene_load.item() == "traction"
    swinging = data.sel(engine="swinging", precision="float64")
    assert swinging.swing > 0 and np.isfinite(swinging.last_displacement)
    assert data.engine_status.attrs["flag_meanings"].split() == list(RUN_ENDS)


def test_errors_are_the_sum_of_their_parts_and_times_are_measured(collected):
    data = collected("toy", "xpbd")["engines"].to_dataset().squeeze()
    there = np.isfinite(data.error)
    assert there.any() and (data.status.values != 0).all()
    parts = (data.definition_error + data.solver_error).values[there.values]
    assert np.allclose(data.error.values[there.values], parts, rtol=1e-9)
    assert (data.frame_seconds.values[there.values] > 0).all() and data.reference_displacement > 0
    later = data.copy(deep=True).assign(frame_seconds=2 * data.frame_seconds)
    assert not compare(*(xr.DataTree.from_dict({"/engines": one}) for one in (data, later))).different


def test_the_best_factor_gives_the_references_displacement(collected):
    text = STUDY.replace("iterations: [1, 100], substeps: [1, 4], dt: [1/60 s, 5 ms]", "iterations: 7")
    curve = CURVE.replace("0.5, to: 8, points: 5", "0.01, to: 100, points: 4").replace("[2, 50]", "[1, 50]")
    tree = collected("toy", text=text + curve)
    curves = tree["engine_curves"].to_dataset().squeeze()
    assert "iterations" not in tree["engines"].to_dataset().squeeze().dims  # curves add no holes to the other group
    beam, rubber = st.Beam("100 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), rubber, "traction", "0.2 N", definition="patch")
    best = curves.sel(iterations=50)
    assert best.best_factor_message.item() == ""
    assert abs(st.in_engine(scene, "toy", iterations=50, factor=best.best_factor.item()).error) < 1e-9
    hopeless = curves.sel(iterations=1)
    assert np.isnan(hopeless.best_factor)
    assert "no factor from 0.01 to 100 is right" in hopeless.best_factor_message.item()


# -- what is computed again --------------------------------------------------------------------------------------------


def test_an_absent_engine_is_run_when_it_is_there_and_again_when_it_is_new(workers, collected, tmp_path, monkeypatch):
    text = STUDY.replace("iterations: [1, 100], substeps: [1, 4], dt: [1/60 s, 5 ms]", "iterations: 5")
    assert ends(collected("toy", "missing", text=text)["engines"]) == {"rest", "absent", "not_requested"}
    assert not stages_due()
    folder = tmp_path / "site"
    monkeypatch.syspath_prepend(folder)
    for version in ("1.0", "2.0"):
        (folder / f"{ABSENT}-{version}.dist-info").mkdir(parents=True)
        (folder / f"{ABSENT}-{version}.dist-info/METADATA").write_text(f"Name: {ABSENT}\nVersion: {version}\n")
        (folder / f"{ABSENT}.py").write_text("from test_engine_runs import Toy\n")
        for old in set(folder.glob("*.dist-info")) - {folder / f"{ABSENT}-{version}.dist-info"}:
            (old / "METADATA").unlink()
            old.rmdir()
        importlib.invalidate_caches()
        forget_keys()
        assert len(stages_due()) == 1  # and not the one of the other engine
        data = Campaign("try.yaml").collected()["engines"].to_dataset().squeeze()
        assert ends(data) == {"rest", "not_requested"}
        assert data.engine_version.sel(engine="missing").item() == f"{ABSENT} {version}"
    forget_keys()


# -- what is drawn -----------------------------------------------------------------------------------------------------


def test_outputs_are_figures_of_each_scene_and_a_table(collected):
    text = STUDY.replace("[1, 100], substeps: [1, 4], dt: [1/60 s, 5 ms]", "[1, 100]")
    collected("toy", "missing", text=text.replace("title", "outputs: [engines, tables]\ntitle", 1))
    campaign = Campaign("try.yaml")
    campaign.finish()
    drawn = {path.name for path in (campaign.folder / "figures").iterdir()}
    assert drawn == {f"engines_errors_pull.{ending}" for ending in ("png", "pdf")}
    with open(campaign.folder / "tables/engines.csv") as file:
        rows = list(csv.DictReader(file))
    assert [row["engine_status"] for row in rows] == ["absent"] * 2 + ["rest"] * 2
    assert rows[0]["error_percent"] == "" and float(rows[2]["error_percent"]) > float(rows[3]["error_percent"]) > 0
    assert "Scenes in engines" in (campaign.folder / "tables/index.html").read_text()
