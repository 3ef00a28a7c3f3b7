"""Springs as other programs get them: forces from a file alone, what its header says, and series for ParaView."""

import json
from dataclasses import replace

import meshio
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import springtune as st
from mechanics import angle_forces, area_forces, area_of, spring_forces
from springtune.cli import main
from springtune.handover.newton import membrane
from springtune.mechanics import EXPLICIT, IMPLICIT
from springtune.mechanics.energies import AreaEnergy

from tables import cases

STEEL = st.Material("210 GPa", 0.3, density="7850 kg/m^3", name="steel")
AS_STIFF = st.Rubber([35e9, -5e9, 1e9], density="7850 kg/m^3")
BEAM = st.Beam("100 mm", "20 mm", thickness="2 mm")
ARRAYS = ("points", "springs", "rest_lengths", "stiffness", "masses", "held", "forces", "triangles", "quads")


def scene_of(definition, mesh_type="structured", load="traction", force="20 kN", **options):
    material = AS_STIFF if definition == "yeoh" else STEEL
    return st.Scene(
        BEAM, st.make_mesh(BEAM, mesh_type, "5 mm"), material, load, force, definition=definition, **options
    )


def net_of(scene, **options):
    return st.SpringNet.from_scene(scene, errors=False, **options)


def turned(vectors):
    """Vectors turned by a right angle, clockwise."""
    return np.stack([vectors[..., 1], -vectors[..., 0]], axis=-1)


def forces_of(net, x):
    """dW/dx of each particle [N] by the formulas that a file states, in plain differences of positions."""
    total = np.zeros_like(x)
    np.add.at(total, net.springs, spring_forces(x[net.springs], net.stiffness, net.rest_lengths))
    for terms in net.energies:
        corners, value = x[terms.cells], terms.values
        if terms.kind == "area":
            part = area_forces(corners, value["modulus"], value["rest_area"])
        elif terms.kind == "biquadratic":
            sides = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)  # opposite each corner
            change = (sides**2).sum(axis=2) - value["rest_length"] ** 2
            k, gamma = value["tensile"], value["coupling"]
            pull = 0.5 * k * change  # dW/dq
            for i in range(3):
                j, m = (i + 1) % 3, (i + 2) % 3
                pull[:, i] += 0.5 * (gamma[:, j] * change[:, m] + gamma[:, m] * change[:, j])
            along = 2 * pull[:, :, None] * sides
            part = np.roll(along, -1, axis=1) - np.roll(along, 1, axis=1)
        elif terms.kind in ("incompressible", "compressible"):
            part = rubber_forces(terms.kind, corners, value)
        else:
            one = value["modulus"][:, None] if terms.kind == "angle" else value["rotational"]
            part = angle_forces(corners, one, value["rest_angle"])
        np.add.at(total, terms.cells, part)
    return total


def rubber_forces(kind, corners, value):
    """Of T, the trace, and of the area; the stretch across the sheet by bisection, where there is one to be found."""
    after, before = np.roll(corners, -1, axis=1), np.roll(corners, 1, axis=1)
    sides, slopes = before - after, 0.5 * turned(after - before)
    rest = value["rest_area"]
    ratio = area_of(corners) / rest
    trace = (value["rest_weight"] * (sides**2).sum(axis=2)).sum(axis=1) / rest
    if kind == "incompressible":
        e = trace + ratio**-2 - 3
        by_trace = value["c1"] + 2 * value["c2"] * e + 3 * value["c3"] * e**2
        by_ratio = -2 * by_trace * ratio**-3
    else:
        low, high = np.full(len(rest), 0.1), np.full(len(rest), 10.0)
        for _ in range(60):
            z = 0.5 * (low + high)
            volume = z * ratio
            slope = value["shear"] * volume ** (-2 / 3) * (z - (trace + z**2) / (3 * z))
            slope += value["bulk"] * (volume - 1) * ratio
            low, high = np.where(slope < 0, z, low), np.where(slope < 0, high, z)
        by_trace = value["shear"] / 2 * volume ** (-2 / 3)
        by_ratio = -2 / 3 * by_trace / ratio * (trace + z**2) + value["bulk"] * (volume - 1) * z
    along = 2 * (by_trace[:, None] * value["rest_weight"])[:, :, None] * sides
    return np.roll(along, -1, axis=1) - np.roll(along, 1, axis=1) + by_ratio[:, None, None] * slopes


def unbalanced(net, x):
    """Out-of-balance force of what can move, over the load [1]."""
    missing = np.where(net.held, 0.0, net.forces - forces_of(net, x))
    return np.linalg.norm(missing) / np.linalg.norm(net.forces)


@cases
def test_a_file_alone_balances_the_scene(definition, mesh_type, tmp_path):
    """By its own formulas, to the rounding of differences of positions: digits are lost by the strain, a thousandth."""
    stiffness = "170e6 N/m" if definition == "paper" else None
    scene = scene_of(definition, mesh_type, stiffness=stiffness)
    net_of(scene).write(tmp_path / "net.json")
    net = st.SpringNet.read(tmp_path / "net.json")
    found = scene.solve()
    assert found.status == st.Status.SOLVED
    assert unbalanced(net, net.points + found.displacements) < 1e-9
    # A test that cannot fail is none: a thousandth of a displacement is seen.
    assert unbalanced(net, net.points + 1.001 * found.displacements) > 1e-5


@pytest.mark.parametrize(("definition", "mesh_type"), [("delingette", "free"), ("flechon", "braced")])
def test_what_is_read_is_what_was_written(definition, mesh_type, tmp_path):
    net = st.SpringNet.from_scene(scene_of(definition, mesh_type), 'own: "graded" -- 5 mm')
    written = net.write(tmp_path / "net.json")
    assert sorted(written) == sorted(tmp_path.iterdir())
    back = st.SpringNet.read(written[0])
    for name in ARRAYS:
        given, found = getattr(net, name), getattr(back, name)
        assert (found.dtype, found.shape) == (given.dtype, given.shape) and found.tobytes() == given.tobytes(), name
    assert back.header == net.header and back.thickness == net.thickness == 2e-3
    assert [terms.kind for terms in back.energies] == [terms.kind for terms in net.energies]
    for given, found in zip(net.energies, back.energies):
        assert (found.cells == given.cells).all() and found.units == given.units
        assert {name: values.tobytes() for name, values in found.values.items()} == {
            name: values.tobytes() for name, values in given.values.items()
        }
    first = [path.read_bytes() for path in written]
    net.write(tmp_path / "net.json")
    assert [path.read_bytes() for path in written] == first


@pytest.mark.parametrize(("definition", "mesh_type"), [("delingette", "free"), ("flechon", "braced")])
def test_tables_have_the_arrays(definition, mesh_type, tmp_path):
    net = net_of(scene_of(definition, mesh_type))
    springs, particles, cells = (pd.read_csv(path, comment="#") for path in net.write(tmp_path / "net.csv"))
    assert (springs[["first", "second"]].to_numpy() == net.springs).all()
    assert (springs["rest_length [m]"] == net.rest_lengths).all()
    assert (springs["stiffness [N/m]"] == net.stiffness).all()
    assert (particles[["x [m]", "y [m]"]].to_numpy() == net.points).all()
    assert (particles["mass [kg]"] == net.masses).all()
    assert (particles[["held_x", "held_y"]].to_numpy() == net.held).all()
    assert (particles[["force_x [N]", "force_y [N]"]].to_numpy() == net.forces).all()
    for terms in net.energies:
        assert (cells[[*"abcd"][: terms.cells.shape[1]]].to_numpy() == terms.cells).all()
        for name, values in terms.values.items():
            heads = [head for head in cells if head.startswith(f"{terms.kind}_{name}")]
            assert (cells[heads].to_numpy() == values.reshape(len(values), -1)).all()


@pytest.mark.usefixtures("mesh_library")
@pytest.mark.parametrize(("definition", "mesh_type"), [("delingette", "free"), ("flechon", "braced")])
def test_paraview_has_the_arrays(definition, mesh_type, tmp_path):
    net = net_of(scene_of(definition, mesh_type))
    [path] = net.write(tmp_path / "net.vtu")
    grid = meshio.read(path)
    [springs, cells] = [block.data for block in grid.cells]
    assert (grid.points[:, :2] == net.points).all() and (springs == net.springs).all()
    for name, values in {"mass": net.masses, "held": net.held, "load": net.forces}.items():
        found = grid.point_data[name]
        assert ((found[:, :2] if found.ndim > 1 else found) == values).all()
    for name, values in {"rest_length": net.rest_lengths, "stiffness": net.stiffness}.items():
        assert (grid.cell_data[name][0] == values).all()
    for terms in net.energies:
        assert (cells == terms.cells).all()
        for name, values in terms.values.items():
            assert (grid.cell_data[f"{terms.kind}_{name}"][1] == values).all()
    comment = path.read_text(encoding="utf-8", errors="replace").partition("<!--\n")[2].partition("\n-->")[0]
    assert json.loads(comment) == net.header | {"thickness": 2e-3}


def test_cells_of_both_kinds(tmp_path):
    """A square and two triangles beside it; in numbers that binary fractions do not hold."""
    x, y = np.array([0, 1, 1, 0, 2, 2]) / 30, np.array([0, 0, 1, 1, 0, 1]) / 30
    triangles, quads = np.array([[1, 4, 5], [1, 5, 2]]), np.array([[0, 1, 2, 3]])

    def both(mesh, material, thickness):
        """Springs and areas, without a thought."""
        energies = tuple(AreaEnergy(mesh.points, cells, np.full(len(cells), 0.1)) for cells in mesh.cells.values())
        return st.Springs(1e8, np.ones(len(mesh.edges)) / 3, energies)

    net = st.SpringNet.from_mesh(
        st.Mesh(np.stack([x, y], axis=1), triangles, quads), replace(STEEL, density=None), both
    )
    net.write(tmp_path / "net.json")
    back = st.SpringNet.read(tmp_path / "net.json")
    assert back.masses is None
    assert [terms.cells.tolist() for terms in back.energies] == [triangles.tolist(), quads.tolist()]
    for given, found in zip(net.energies, back.energies):
        assert all((found.values[name] == values).all() for name, values in given.values.items())
    assert (back.quads == quads).all() and (back.triangles == triangles).all()
    [path] = net.write(tmp_path / "net.vtu")
    of_springs, of_triangles, of_quads = meshio.read(path).cell_data["area_modulus"]
    assert np.isnan(of_springs).all()
    assert of_triangles.tolist() == net.energies[0].values["modulus"].tolist()
    assert of_quads.tolist() == net.energies[1].values["modulus"].tolist()
    moved = back.points * [1.01, 0.99]
    assert np.array_equal(forces_of(back, moved), forces_of(net, moved))


class TestHeader:
    @pytest.mark.parametrize("load", ["traction", "pressure", "compression", "follower-pressure"])
    def test_errors_are_those_of_a_solve(self, load):
        """With linear kinematics an error depends neither on the force nor on what turns with its side."""
        errors = st.SpringNet.from_scene(scene_of("area", load=load, force="100 N")).header["expected_error"]
        assert list(errors) == list(dict.fromkeys(["traction", "bending", "shear", load]))
        for name, error in errors.items():
            steady = name.removeprefix("follower-")
            solved = scene_of("area", load=steady, force="1 N", kinematics="linear").solve()
            assert error == pytest.approx(solved.error, abs=1e-9), name

    def test_what_is_not_computed_says_why(self):
        loose = st.SpringNet.from_mesh(scene_of("lattice").mesh, replace(STEEL, density=None), "lattice")
        assert loose.masses is None and not loose.held.any() and not loose.forces.any()
        assert loose.header["largest_stable_step"] == "not computed: material 'steel' has no density"
        assert loose.header["expected_error"] == "not computed: the mesh is of no beam"
        errors = st.SpringNet.from_scene(scene_of("baudet-corrected", "braced")).header["expected_error"]
        assert isinstance(errors["traction"], float)
        assert errors["bending"] == "not computed: definition 'baudet-corrected' is not for this load"

    @pytest.mark.parametrize("definition", ["lattice", "delingette"])
    def test_stable_steps_are_those_of_the_motion(self, definition):
        scene = scene_of(definition)
        steps, motion = net_of(scene).header["largest_stable_step"], scene.motion()
        assert steps == {name: motion.step_limit(name) for name in EXPLICIT} | dict.fromkeys(IMPLICIT, "unlimited")
        # What a load holds makes no mode higher: free, the step is no longer than held.
        free = st.SpringNet.from_mesh(scene.mesh, STEEL, definition, thickness=BEAM.thickness)
        assert free.header["largest_stable_step"]["central-difference"] <= steps["central-difference"] * (1 + 1e-9)


class TestResult:
    @pytest.mark.usefixtures("mesh_library")
    @pytest.mark.parametrize("kinematics", ["nonlinear", "linear"])
    @pytest.mark.parametrize("definition", ["patch", "delingette"])
    def test_a_deformed_network_has_its_fields(self, definition, kinematics, tmp_path):
        result = scene_of(definition, kinematics=kinematics).solve()
        assert result.write(tmp_path / "deformed.vtu") == [tmp_path / "deformed.vtu"]
        grid = meshio.read(tmp_path / "deformed.vtu")
        names = [block.type for block in grid.cells]
        assert names == ["line", "triangle"]
        moved, expected = result.displacements, result.reference().at(result.scene.mesh.points)
        for name, field in (("displacement", moved), ("reference_displacement", expected), ("error", moved - expected)):
            assert (grid.point_data[name][:, :2] == field).all() and not grid.point_data[name][:, 2].any()
        assert (grid.cell_data["stiffness"][0] == result.stiffness).all()
        assert (grid.cell_data["force"][0] == result.spring_forces).all()
        assert np.isnan(grid.cell_data["force"][1]).all()
        assert grid.field_data["displacement_of_the_load"] == [result.displacement]


def test_a_state_of_a_motion_is_written(tmp_path):
    scene = scene_of("lattice", force="100 N")
    motion = scene.motion()
    moved = motion.run("central-difference", 0.5 * motion.step_limit("central-difference"), 30).displacements
    grid = meshio.read(*scene.write(tmp_path / "swing.vtu", moved))
    assert (grid.point_data["displacement"][:, :2] == moved).all() and "error" not in grid.point_data
    forces = scene.springs.reference * scene.network.spring_forces_over_k(moved)
    assert (grid.cell_data["force"][0] == forces).all()


class TestFiles:
    def test_a_damaged_file_is_refused(self, tmp_path):
        path = tmp_path / "net.json"
        net_of(scene_of("area")).write(path)
        content = path.read_bytes()
        for damaged in (content[: len(content) // 2], b"", b"\x00" * 64):
            path.write_bytes(damaged)
            with pytest.raises(ValueError, match=r"is damaged, or no net of springtune") as error:
                st.SpringNet.read(path)
            assert len(str(error.value).splitlines()) == 1


class TestCommand:
    STEEL = ("--beam", "100x20", "--size", "5 mm", "--material", "steel")

    def run(self, *arguments):
        return CliRunner().invoke(main, ["springs", *map(str, arguments)])

    def test_writes_what_the_library_has(self, tmp_path):
        path = tmp_path / "net.json"
        asked = ("--thickness", "2 mm", "--density", "7850 kg/m^3", "--load", "traction", "--force", "20 kN")
        result = self.run(*self.STEEL, "--definition", "area", *asked, "--out", path)
        assert result.exit_code == 0, result.stderr
        net, wanted = st.SpringNet.read(path), st.SpringNet.from_scene(scene_of("area"), "structured 5 mm")
        assert net.header == wanted.header | {"beam": wanted.header["beam"] | {"name": "100x20"}}
        for name in ARRAYS:
            assert (getattr(net, name) == getattr(wanted, name)).all()
        assert "area terms of 205 cells of definition area" in result.stdout
        assert "error of the displacement, solved on this mesh: traction" in result.stdout
        assert "largest stable step of explicit integrators" in result.stdout


class TestPlaneStrain:
    """Lame's constants of a sheet in plane strain are those of three dimensions, beyond nu = 1/3 above 2 G."""

    CLAY = st.Material(1e6, 0.45, 1800.0, "clay", "strain")

    def net(self):
        mesh = st.make_mesh(st.Beam(0.1, 0.02), "structured", 0.01)
        return st.SpringNet.from_mesh(mesh, self.CLAY, "delingette", thickness=1e-3)

    def test_a_file_has_the_constants_of_the_plane_and_says_which_it_is(self, tmp_path):
        net = self.net()
        assert net.header["material"]["plane"] == "strain"
        shear, first = membrane(net)
        assert (shear, first) == pytest.approx((1e3 / 2.9, 1e3 * 0.45 / (1.45 * 0.1)))
        net.write(tmp_path / "net.newton.py")
        assert "Poisson's ratio 0.45, plane strain, density 1800 kg/m3" in (tmp_path / "net.newton.py").read_text()
