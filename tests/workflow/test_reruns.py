"""What runs again when a study or a file changes, and what a study that cannot be solved leaves behind.

Mostly by the study's jobs in this process, which tests/reruns finds to be those that Snakemake runs.
"""

import contextlib
from pathlib import Path

import numpy as np
import pytest

import springtune as st
from springtune.studies.archive import pack

from campaigns import Campaign
from tables import STUDIES

STUDY = STUDIES["reruns"]


def study(sizes="10 mm, 5 mm", load="traction", force="20 kN"):
    return STUDY.format(sizes=sizes, load=load, force=force)


def dataset(run, name):
    with st.open(run.folder / f"results/{name}") as tree:
        return tree.load()


@pytest.fixture(scope="module")
def grown(run):
    """A study of two mesh sizes, run up to its dataset."""
    run.write("grow.yaml", study())
    with contextlib.chdir(run.folder):
        Campaign("grow.yaml").finish("collect")
    return run


def test_a_dry_run_lists_what_snakemake_has_no_notes_of(grown):
    """As after results were copied from elsewhere: here no job was Snakemake's."""
    grown.write("grow.yaml", study(force="30 kN"))
    code, listed = grown.springtune("grow.yaml", "-n", "--cores", "1")
    grown.write("grow.yaml", study())
    assert code == 0 and {"sensitivity", "solve", "collect"} <= set(listed.split()), listed


def test_a_force_that_cannot_be_carried_is_a_marked_hole(run):
    run.write("heavy.yaml", study("5 mm", "compression", "100 MN"))
    with contextlib.chdir(run.folder):
        Campaign("heavy.yaml").finish("collect")
    # By name, in what a run shows at its end.
    told = (run.folder / "results/heavy/summary.txt").read_text()
    assert "scenes, not converged: 2 of 2\n  small, structured, 5 mm, steel, compression, paper, nonlinear: " in told
    root = dataset(run, "heavy").to_dataset()
    assert (root.status == 3).all() and root.displacement.isnull().all() and root.deformation_error.isnull().all()
    assert (root.residual > 1e-10).all()  # exact: the criterion itself
    assert all("last residual" in message for message in root.message.values.ravel())
    assert np.isfinite(root.reference_displacement).all()


def test_figures_and_tables_of_a_removed_load_stay_and_are_not_packed(run):
    with contextlib.chdir(run.folder):
        for load in ("compression", "traction"):
            run.write("less.yaml", study("10 mm", load) + "outputs: [size, tables]\n")
            Campaign("less.yaml").finish()
        names = pack(st.load_study("less.yaml"), Path("results/less"), Path("less.zip"))
    assert (run.folder / "results/less/tables/compression_structured_steel.csv").exists()
    figures = [f"figures/size_structured_steel_traction.{ending}" for ending in ("pdf", "png")]
    assert [name for name in names if "_" in name] == [*figures, "tables/traction_structured_steel.csv"]


def test_bad_input_ends_a_run_with_its_message_and_nothing_written(run):
    """Whatever the message is: to Snakemake all of them are one error."""
    run.write("worse.yaml", study("5 mm").replace("beam: small", "beem: small"))
    with pytest.raises(st.StudyError) as caught:
        st.load_study(run.folder / "worse.yaml")
    code, output = run.snakemake("worse.yaml")
    assert code == 1
    assert all(line.partition("worse.yaml")[2] in output for line in str(caught.value).splitlines())
    assert "Traceback" not in output
    assert not (run.folder / "results/worse").exists()


@pytest.mark.slow
def test_what_differs_by_a_scale_alone_has_one_reference(run):
    """Size, thickness, Young's modulus and force scale a reference; Poisson's ratio and the aspect ratio do not."""
    run.write("scales.yaml", STUDIES["reruns_scales"])
    code, output = run.snakemake("scales.yaml", "--until", "collect")
    assert code == 0, output
    assert len(run.times("results/scales/references/*.h5")) == 1
    assert not run.times("results/scales/done/calibrate_*.json")  # and nothing calibrates where nothing is calibrated
    compliance = dataset(run, "scales").reference_displacement / dataset(run, "scales").force
    small = compliance.sel(beam="small", material="steel")
    for load in ("traction", "compression"):
        # The same shape: the displacement goes as F / (E t), whatever the size.
        assert compliance.sel(beam="large", material="steel", load=load) == pytest.approx(small.sel(load=load) / 3)
        assert compliance.sel(beam="small", material="soft", load=load) == pytest.approx(small.sel(load=load) * 210e3)
