"""What a run survives, and what it says: other runs, kills, broken programs."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import meshio
import numpy as np
import psutil
import pytest
import xarray as xr

import springtune as st
from springtune.mesh.formats import write_mesh

from campaigns import Campaign
from tables import STUDIES

STUDY = STUDIES["survival"]


def everything(folder):
    """All that is in a folder, Snakemake's own aside: of each file its content and its time."""
    return {
        path.relative_to(folder): (path.read_bytes(), path.stat().st_mtime_ns)
        for path in folder.rglob("*")
        if path.is_file() and ".snakemake" not in path.parts
    }


@pytest.fixture(scope="module")
def finished(run):
    """By its jobs in this process."""
    run.write("survival.yaml", STUDY)
    with contextlib.chdir(run.folder):
        Campaign("survival.yaml").finish()
    return run


def test_who_only_looks_changes_nothing(finished):
    """All such options read the Snakefile, and Snakemake does the rest."""
    before = everything(finished.folder)
    code, output = finished.snakemake("survival.yaml", "-n")
    assert code == 0, output
    assert everything(finished.folder) == before


@pytest.mark.slow
def test_a_run_that_is_killed_goes_on_by_the_same_command(finished):
    """Wherever it is: the kill comes when the first mesh is there."""
    run = finished
    run.write("killed.yaml", STUDY)
    repository = Path(__file__).parents[2]
    command = ["snakemake", "--snakefile", repository / "Snakefile", "--cores", "2", "--configfile", "killed.yaml",
               "--workflow-profile", repository / "workflow/profiles/default", "--until", "collect"]  # fmt: skip
    job = subprocess.Popen(list(map(str, command)), cwd=run.folder, start_new_session=True, stderr=subprocess.DEVNULL)
    while not list(run.folder.glob("results/killed/meshes/*.h5")):
        assert job.poll() is None
        time.sleep(0.01)
    children = psutil.Process(job.pid).children(recursive=True)
    os.killpg(job.pid, signal.SIGKILL)
    job.wait()
    psutil.wait_procs(children)
    code, output = run.springtune("killed.yaml", "--until", "collect")
    assert code == 0, output
    with (
        xr.open_dataset(run.folder / "results/killed/dataset.nc") as one,
        xr.open_dataset(run.folder / "results/survival/dataset.nc") as other,
    ):
        assert one.displacement.equals(other.displacement) and one.stiffness.equals(other.stiffness)
    assert not list(run.folder.rglob("*.unfinished"))


def test_a_study_that_is_edited_during_its_run_makes_no_dataset_of_another_one(run):
    """Its jobs did what was asked for when the run began; the dataset would be of what is asked for now."""
    run.write("edited.yaml", STUDY)
    with contextlib.chdir(run.folder):
        Campaign("edited.yaml").finish("solve_0")
    told = ["springtune.studies.kinds.collect", "edited.yaml", "results/edited", "dataset.nc", "d.json", "of before"]
    done = subprocess.run([sys.executable, "-m", *told], cwd=run.folder, capture_output=True, text=True)
    assert done.returncode == 1 and "edited.yaml was changed while the study ran; call the same" in done.stderr
    assert not (run.folder / "dataset.nc").exists()


FILES = STUDIES["bad_studies_files"]


@pytest.mark.slow
def test_a_bad_mesh_file_costs_its_own_scenes_alone(run):
    mesh = st.make_mesh(st.Beam("50 mm", "10 mm"), "free", "5 mm")
    write_mesh(run.folder / "good.vtu", mesh)
    content = (run.folder / "good.vtu").read_bytes()
    (run.folder / "cut.vtu").write_bytes(content[: len(content) // 2])
    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    points[3, 0] = np.nan
    meshio.Mesh(points, [("triangle", mesh.triangles)]).write(run.folder / "lost.vtu")
    run.write("files.yaml", FILES)
    code, text = run.snakemake("files.yaml")
    assert code == 0, text
    with st.open(run.folder / "results/files") as tree:
        scenes = tree.to_dataset().squeeze(drop=True).load()
        for mesh_type in ("structured", "good"):
            assert (scenes.status.sel(mesh_type=mesh_type) == st.Status.SOLVED).all()
            assert scenes.particles.sel(mesh_type=mesh_type) > 0
        for mesh_type, why in (
            ("cut", "cut.vtu: cannot be read: it is damaged"),
            ("lost", "points with coordinates that are no"),
        ):
            lost = scenes.sel(mesh_type=mesh_type)
            assert (lost.status == st.Status.FAILED).all() and lost.displacement.isnull().all()
            assert all(message.startswith("mesh: ") and why in message for message in lost.message.values)
            assert lost.particles.isnull() and lost.minimum_angle.isnull()
            curve = tree["sensitivity"].to_dataset().squeeze(drop=True).sel(mesh_type=mesh_type)
            assert (curve.status == st.Status.FAILED).all() and why in curve.message.item()
            assert curve.best_stiffness_status == st.Status.FAILED
            moduli = tree["moduli"].to_dataset().squeeze(drop=True).sel(mesh_type=mesh_type)
            assert (moduli.status == st.Status.FAILED).all()
    # A repaired file is all that is computed again.
    (run.folder / "cut.vtu").write_bytes(content)
    code, text = run.snakemake("files.yaml")
    assert code == 0, text
    with st.open(run.folder / "results/files") as tree:
        found = tree.to_dataset().squeeze(drop=True)
        assert (found.status.sel(mesh_type="cut") == st.Status.SOLVED).all()
        np.testing.assert_array_equal(found.displacement.sel(mesh_type="cut"), found.displacement.sel(mesh_type="good"))
