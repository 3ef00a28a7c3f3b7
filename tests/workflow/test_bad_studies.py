"""What a bad study and a bad mesh file cost, whichever door they come through."""

import meshio
import numpy as np
import pytest

import springtune as st
from springtune.mesh import write_mesh

from tables import STUDIES

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
