"""Springs in simulators: MuJoCo runs what is written for it; files for SOFA and XPBD are read as their programs do."""

import json
import re

import mujoco
import numpy as np
import pytest

import springtune as st
from mechanics import spring_forces
from springtune.handover.simulation import STABLE_STEP_SHARE, EquilibriumWarning
from springtune.mesh.cells import signed_areas

from problems import asked, pulled
from tables import cases

STEEL = st.Material("210 GPa", 0.3, density="7850 kg/m^3", name="steel")
BEAM = st.Beam("60 mm", "20 mm")
FORCES = {"traction": "20 kN", "compression": "20 kN", "bending": "500 N", "shear": "20 kN", "pressure": "40 kN"}
"""Loads of some percents of strain."""

LOADED = tuple(FORCES)
OLD = mujoco.__version__.startswith("3.")
"""`tests/versions` runs this file by MuJoCo 3, too."""


PROGRAMS = {".xml": "MuJoCo", ".mjcf": "MuJoCo", ".py": "SOFA", ".newton.py": "Newton", ".xpbd.json": "XPBD"}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path_factory, monkeypatch):
    """A folder for MuJoCo's log: it writes its warnings into the current one."""
    monkeypatch.chdir(tmp_path_factory.mktemp("log"))


def scene(mesh_type="structured", load="traction", definition="lattice", force=None, size="5 mm", **options):
    """A scene of the beam of these tests."""
    material = options.pop("material", STEEL)
    mesh = options["cache"].mesh if options.get("cache") else st.make_mesh(BEAM, mesh_type, size)
    return st.Scene(BEAM, mesh, material, load, force or FORCES[load], definition=definition, **options)


def written(one, tmp_path, ending):
    """Text of a scene's springs in a format."""
    return one.springs.write(tmp_path / f"net{ending}", errors=False)[0].read_text()


def loaded(one, tmp_path):
    """Model and state of a scene in MuJoCo."""
    if one.springs.energies and OLD:
        pytest.skip("a flex needs MuJoCo 4")
    model = mujoco.MjModel.from_xml_string(written(one, tmp_path, ".xml"))
    return model, mujoco.MjData(model)


def out_of_balance(model, data, positions):
    """Forces that MuJoCo leaves at positions of its joints, over the load."""
    data.qpos[:] = positions
    mujoco.mj_forward(model, data)
    return np.linalg.norm(data.qfrc_passive + data.qfrc_actuator) / np.linalg.norm(data.qfrc_actuator)


def pulls(points, springs, stiffness, lengths, positions):
    """Forces of springs on particles [N], by their law alone."""
    total = np.zeros_like(points)
    np.add.at(total, springs, -spring_forces(positions[springs], stiffness, lengths))
    return total


# -- MuJoCo ------------------------------------------------------------------------------------------------------------


MESHES = ("structured", "free", "right", "alternating", "braced")


@pytest.mark.parametrize(("size", "every"), [("10 mm", False), pytest.param("2.5 mm", True, marks=pytest.mark.slow)])
@pytest.mark.parametrize("mesh_type", MESHES)
def test_equilibria_are_those_of_mujoco(mesh_type, size, every, tmp_path):
    """Each definition under all loads or one, which changes from one to the next; or it is refused for its energies."""
    cache, turn = None, MESHES.index(mesh_type)
    balanced, refused = set(), set()
    for number, (name, definition) in enumerate(st.DEFINITIONS.items()):
        if definition.needs == "cases":  # searches on a scene's reference, whose springs are such as all others
            continue
        told = {"stiffness": "170e6 N/m"} if definition.needs == "stiffness" else {}
        loads = LOADED if every else (LOADED[(number + turn) % len(LOADED)],)
        for load in ("traction", "compression") if definition.uniaxial else loads:
            one = scene(mesh_type, load, name, size=size, cache=cache, **told)
            cache = one.cache
            try:
                result = one.solve()
            except st.DefinitionError:  # not on this mesh
                break
            assert str(result.status) == "solved", (name, load)
            if one.springs.energies and name != "delingette":
                with pytest.raises(ValueError, match=f"'{name}': .*such as 'patch'"):
                    one.springs.write(tmp_path / "net.xml", errors=False)
                refused.add(name)
                continue
            model, data = loaded(one, tmp_path)
            positions = result.displacements[~one.network.held]
            assert out_of_balance(model, data, positions) < 1e-9, (name, load)
            # And the keyframe is that equilibrium, found from what the file holds alone.
            assert np.allclose(model.key_qpos[0], positions, rtol=0, atol=1e-8 * np.abs(positions).max())
            balanced.add(name)
    assert {"paper", "uniform", "lattice", "patch", "adjoint", "element-fit"} <= balanced
    assert {"area", "patch-area"} <= refused
    own = ({"baudet", "baudet-corrected", "axis-exact"}, {"flechon"})
    triangles = ({"van-gelder", "van-gelder-general", "delingette"}, {"delingette-tensile", "angular"})
    for found, expected in zip((balanced, refused), own if mesh_type == "braced" else triangles):
        assert expected <= found


def steps_to_rest(model, one):
    """Steps in which a motion that is critically damped is a hundred-thousandth of what it was, at the lowest rate."""
    motion = one.motion()
    root = 1 / np.sqrt(motion.mass)

    def lowest(displacements=None):
        matrix = root[:, None] * motion.network.tangent(displacements).toarray() * root
        return np.sqrt(np.linalg.eigvalsh(matrix)[0])

    rest, there, joint = lowest(), lowest(one.solve().displacements), np.flatnonzero(model.dof_damping)
    if joint.size:
        # Critical for the loaded mode, or what lets the lowest one in equilibrium decay as fast as that at rest does.
        damping = max(2 * rest, min(2 * motion.loaded_frequency, rest + there**2 / rest))
        assert model.dof_damping[joint[0]] / model.body_mass[model.dof_bodyid[joint[0]]] == pytest.approx(damping)
    return int(15 / rest / model.opt.timestep)


@cases
def test_what_is_opened_moves_to_the_predicted_place(mesh_type, load, definition, tmp_path):
    """The file as it is: nothing is set, nothing is controlled, and it comes to rest where springtune says."""
    one = scene(mesh_type, load, definition)
    model, data = loaded(one, tmp_path)
    positions = one.solve().displacements[~one.network.held]
    mujoco.mj_step(model, data, steps_to_rest(model, one))
    assert np.abs(data.qpos - positions).max() < 1e-4 * np.abs(positions).max()
    assert not data.warning.number.any()


@pytest.mark.filterwarnings("ignore:the equilibrium is:springtune.handover.simulation.EquilibriumWarning")
@cases
def test_a_large_load_does_not_swing_into_a_folded_sheet(mesh_type, definition, share, tmp_path):
    """Traction of a share of Young's modulus: no triangle is turned over on the way, and the rest is the predicted."""
    rubber = st.Material("1 MPa", 0.3, density="1000 kg/m^3", name="rubber")
    sheet = st.Beam("100 mm", "20 mm")
    mesh = st.make_mesh(sheet, mesh_type, "5 mm")
    one = st.Scene(sheet, mesh, rubber, "traction", share * 20, definition=definition)
    if mesh_type == "structured":  # at 100 mm .8 is nearly all that it bears
        one = scene(mesh_type, "traction", definition, 16.0, material=rubber)
    model, data = loaded(one, tmp_path)
    held, moved = one.network.held, np.zeros(one.mesh.points.shape)
    steps, largest = steps_to_rest(model, one), 0.0
    for _ in range(0, steps, 20):
        mujoco.mj_step(model, data, 20)
        moved[~held] = data.qpos
        assert (signed_areas(one.mesh.points + moved, one.mesh.triangles) > 0).all()
        largest = max(largest, np.abs(data.qpos).max())
    static = np.abs(model.key_qpos[0]).max()
    assert np.abs(data.qpos - model.key_qpos[0]).max() < 1e-6 * static
    # Critical damping swings by nothing, were springs linear; squared lengths stiffen.
    assert largest < 1.1 * static and not data.warning.number.any()


def test_the_control_is_added_to_the_load(tmp_path):
    one = scene()
    model, data = loaded(one, tmp_path)
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator.sum() == pytest.approx(20e3, rel=1e-9)
    data.ctrl[0] = -5e3
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator.sum() == pytest.approx(15e3, rel=1e-9)
    assert model.actuator_ctrlrange.tolist() == [[-20e3, 20e3]]


@cases
def test_the_largest_step_is_sharp(mesh_type, definition, tmp_path):
    """Undamped, frequencies as at rest: a hundredth below it no run is lost, a hundredth above it each."""
    one = scene(mesh_type, "traction", definition, force="1 N")
    model, data = loaded(one, tmp_path)
    limit = one.motion().step_limit("symplectic-euler")
    assert model.opt.timestep == pytest.approx(STABLE_STEP_SHARE * limit, rel=1e-4)
    model.dof_damping[:] = model.tendon_damping[:] = 0
    static = np.abs(model.key_qpos[0]).max()
    for share, stable in ((0.99, True), (1.01, False), (1.05, False), (1.5, False)):
        mujoco.mj_resetData(model, data)
        # All frequencies are there from the start.
        data.qpos[:] = 1e-2 * static * np.random.default_rng(0).standard_normal(model.nq)
        model.opt.timestep = share * limit
        largest = 0.0
        for _ in range(600):
            mujoco.mj_step(model, data)
            largest = max(largest, np.abs(data.qpos).max())
            if not largest < 1e3 * static or data.warning.number.any():
                break
        lost = bool(data.warning.number.any()) or not largest < 1e3 * static
        assert lost != stable, share


def test_accelerations_beyond_those_of_mujoco_start_nothing_anew(tmp_path):
    """A sheet as light as a soap film: accelerations above 1e10 m/s2, where MuJoCo else begins again at rest."""
    light = st.Material("210 GPa", 0.3, density="1e-3 kg/m^3")
    one = scene(material=light)
    model, data = loaded(one, tmp_path)
    positions = one.solve().displacements[~one.network.held]
    mujoco.mj_step(model, data, steps_to_rest(model, one))
    assert data.time > 0 and np.abs(data.qpos - positions).max() < 1e-4 * np.abs(positions).max()


def test_a_large_net_has_its_frequencies_by_multigrid(monkeypatch, tmp_path):
    """A direct factor of a large tangent would take more memory than there may be."""
    before = written(scene(), tmp_path, ".xml")

    def factor(self, matrix):
        raise AssertionError("a direct factor")

    for name in ("MULTIGRID_FROM_UNKNOWNS", "NO_CHOLESKY_FROM_UNKNOWNS"):
        monkeypatch.setattr(f"springtune.mechanics.network.{name}", 0)
    for name in ("_superlu", "_cholesky"):
        monkeypatch.setattr(f"springtune.mechanics.network.Network.{name}", factor)
    numbers = [np.array(re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text), float)
               for text in (before, written(scene(), tmp_path, ".xml"))]  # fmt: skip
    assert numbers[0] == pytest.approx(numbers[1], rel=1e-5, abs=1e-9)


def test_springs_without_a_load_are_free_and_at_rest(tmp_path):
    net = st.SpringNet.from_mesh(st.make_mesh(BEAM, "free", "5 mm"), STEEL, "lattice", errors=False)
    for ending in PROGRAMS:
        net.write(tmp_path / f"net{ending}")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "net.mjcf"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert model.nu == 0 and model.nq == 2 * len(net.points) and not model.dof_damping.any()
    assert np.abs(data.qfrc_passive).max() < 1e-9 * net.stiffness.max() * net.rest_lengths.max()
    sofa = as_sofa_reads((tmp_path / "net.py").read_text())
    assert "ConstantForceField" not in sofa and len(sofa["MechanicalObject"]) == 1
    constraints = json.loads((tmp_path / "net.xpbd.json").read_text())
    assert constraints["mass_damping"] == 0 and constraints["displacements"] is None


@pytest.mark.skipif(OLD, reason="a flex needs MuJoCo 4")
@pytest.mark.parametrize("poisson", [0.0, 0.2, 0.3, 0.45, 0.5])
def test_single_triangles_of_a_flex_have_the_law_of_plane_stress(poisson, tmp_path):
    """Forces of MuJoCo against the St. Venant-Kirchhoff energy, written out here, of triangles that move far."""
    rng = np.random.default_rng(round(100 * poisson))
    material = st.Material("3 MPa", poisson, density="1000 kg/m^3")
    first, second = 3e6 * 2e-3 * np.array([poisson / (1 - poisson**2), 0.5 / (1 + poisson)])
    for _ in range(5):
        turn = 2 * np.pi * (np.arange(3) / 3 + rng.uniform(-0.1, 0.1, 3))
        points = 0.01 * rng.uniform(0.5, 1.5, 3)[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
        net = st.SpringNet.from_mesh(st.Mesh(points, np.array([[0, 1, 2]])), material, "delingette", thickness="2 mm")
        [path] = net.write(tmp_path / "triangle.xml")
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        moved = 3e-3 * rng.standard_normal((3, 2))
        data.qpos[:] = moved.ravel()
        mujoco.mj_forward(model, data)
        edges = np.linalg.inv((points[1:] - points[0]).T)
        gradient = (points + moved)[1:].T - (points + moved)[:1].T
        gradient = gradient @ edges
        strain = (gradient.T @ gradient - np.eye(2)) / 2
        stress = gradient @ (first * np.trace(strain) * np.eye(2) + 2 * second * strain)
        forces = -abs(signed_areas(points, np.array([[0, 1, 2]]))[0]) * (stress @ edges.T).T
        forces = np.vstack([-forces.sum(axis=0), forces])
        # The distance to poisson = 1/2 is rounded.
        assert np.abs(data.qfrc_passive.reshape(3, 2) - forces).max() < 1e-9 * np.abs(forces).max()


def test_a_flex_says_its_version_and_has_the_constants_of_the_material(tmp_path):
    [path] = scene("free", "traction", "delingette").springs.write(tmp_path / "flex.xml", errors=False)
    text = path.read_text()
    assert "Written for MuJoCo 4; MuJoCo 3, " in text
    young, poisson = (float(re.search(rf' {name}="([^"]+)"', text)[1]) for name in ("young", "poisson"))
    constants = young / (2 * (1 + poisson)), young * poisson / (1 - poisson**2)
    assert constants == pytest.approx((210e6 / 2.6, 210e6 * 0.3 / 0.91), rel=1e-9)
    if OLD:
        with pytest.raises(ValueError, match="attribute: 'yield'"):
            mujoco.MjModel.from_xml_path(str(path))


@pytest.mark.parametrize("ending", PROGRAMS)
def test_a_file_of_springs_is_enough_for_a_simulator(ending, tmp_path):
    """What is read from a file of arrays is written as the scene itself is."""
    one = scene("free", "shear", "patch")
    direct = written(one, tmp_path, ending)
    [path] = one.springs.write(tmp_path / "arrays.json", errors=False)
    again = st.SpringNet.read(path).write(tmp_path / f"again{ending}")[0]
    assert again.read_text().replace("again.", "net.") == direct


def odd(mesh, material, thickness):
    """Springs some of which are none, and one of which pushes where others pull."""
    stiffness = np.ones(len(mesh.edges))
    inside = np.flatnonzero(~mesh.on_outline)
    stiffness[inside[:2]], stiffness[inside[5]] = 0.0, -0.1
    return st.Springs(1e8, stiffness)


odd.__name__ = "<odd & --own-->"


def test_springs_of_no_and_of_negative_stiffness(tmp_path):
    one = scene("free", definition=odd)
    model, data = loaded(one, tmp_path)
    assert model.ntendon == len(one.springs.relative) - 2 + 1
    assert out_of_balance(model, data, one.solve().displacements[~one.network.held]) < 1e-9
    as_sofa_reads(written(one, tmp_path, ".py"))
    with pytest.raises(ValueError, match=r"1 of \d+ springs have a negative stiffness, and no compliance of XPBD is"):
        one.springs.write(tmp_path / "net.xpbd.json", errors=False)


# -- SOFA --------------------------------------------------------------------------------------------------------------


def as_sofa_reads(text):
    """Components that a scene in Python adds, by their class; its nodes are stood in for."""
    found = {}

    class Node:
        """What a scene does to a node of SofaPython3."""

        class Value:
            value = None

        def __init__(self):
            self.dt, self.gravity = Node.Value(), Node.Value()

        def addObject(self, name, /, **data):
            if name == "EulerImplicitIntegrationScheme":
                raise ValueError("not before v26.06")
            found.setdefault(name, []).append(data)

        def addChild(self, name):
            return Node()

    names, root = {}, Node()
    exec(compile(text, "net.py", "exec"), names)
    names["createScene"](root)
    assert root.dt.value > 0 and root.gravity.value == [0, 0, 0]
    return found


def held_and_loaded(found, count):
    """Directions that a scene of SOFA holds, and the forces on its particles."""
    held, forces = np.zeros((count, 3), dtype=bool), np.zeros((count, 3))
    for fixed in found.get("FixedProjectiveConstraint", ()):
        held[np.array(fixed["indices"].split(), dtype=int)] = True
    for partly in found["PartialFixedProjectiveConstraint"]:
        axes = np.array(partly["fixedDirections"].split(), dtype=int).astype(bool)
        held[np.array(partly["indices"].split(), dtype=int)] = axes
    [field] = found["ConstantForceField"]
    forces[np.array(field["indices"].split(), dtype=int)] = np.array(field["forces"].split(), dtype=float).reshape(
        -1, 3
    )
    return held, forces


@cases
def test_sofa_reads_each_spring_with_its_own_stiffness(mesh_type, load, definition, tmp_path):
    one = scene(mesh_type, load, definition)
    result, network = one.solve(), one.network
    found = as_sofa_reads(written(one, tmp_path, ".py"))
    # LinearSpring's operator >>: two particles, stiffness, damping, rest length, one spring after the other.
    rows = np.array(found["SpringForceField"][0]["spring"].split(), dtype=float).reshape(-1, 5)
    assert np.array_equal(rows[:, :2], one.mesh.edges)
    assert np.array_equal(rows[:, 2], result.stiffness) and not rows[:, 3].any()
    assert np.array_equal(rows[:, 4], one.mesh.edge_lengths)
    particles, predicted = (
        np.array(one["position"].split(), dtype=float).reshape(-1, 3) for one in found["MechanicalObject"]
    )
    assert np.array_equal(particles[:, :2], one.mesh.points) and not particles[:, 2].any()
    held, forces = held_and_loaded(found, len(particles))
    assert np.array_equal(held[:, :2], network.held) and held[:, 2].all()
    masses = np.array(found["DiagonalMass"][0]["vertexMass"].split(), dtype=float)
    assert masses.sum() == pytest.approx(7850 * 1e-3 * one.mesh.area)
    moved = particles.copy()
    moved[:, :2] += result.displacements
    total = pulls(particles, rows[:, :2].astype(int), rows[:, 2], rows[:, 4], moved) + forces
    assert np.linalg.norm(total[~held]) < 1e-9 * np.linalg.norm(forces)
    assert np.allclose(predicted, moved, rtol=0, atol=1e-8 * np.abs(result.displacements).max())


def test_sofas_scene_in_python_serves_versions_with_other_names(tmp_path):
    """Since v26.06 the integrator is another component of another plugin."""
    text = written(scene(), tmp_path, ".py")
    swapped = text.replace("EulerImplicitSolver", "?").replace("EulerImplicitIntegrationScheme", "EulerImplicitSolver")
    found = as_sofa_reads(swapped.replace("?", "EulerImplicitIntegrationScheme"))
    assert "EulerImplicitSolver" in found
    assert {"pluginName": "Sofa.Component.IntegrationScheme.Backward"} in found["RequiredPlugin"]


# -- refusals ----------------------------------------------------------------------------------------------------------


def test_a_load_without_equilibrium_or_with_one_far_away_is_written_and_says_so(tmp_path):
    """Beyond the buckling load there is no stable equilibrium on the straight path; the file has no keyframe."""
    thin, rubber = st.Beam("60 mm", "5 mm"), st.Material("1 MPa", 0.5, density="1000 kg/m^3")
    far = st.Scene(thin, st.make_mesh(thin, "structured", "5 mm"), rubber, "traction", "8 N", definition="lattice")
    with pytest.warns(EquilibriumWarning, match="m away from rest, further than the beam is long"):
        written(far, tmp_path, ".xml")
    column = st.Beam("100 mm", "4 mm")
    one = st.Scene(
        column, st.make_mesh(column, "structured", "2 mm"), STEEL, "compression", "2 kN", definition="lattice"
    )
    with pytest.warns(EquilibriumWarning, match="no equilibrium was found, so the file has none: .*; give a smaller"):
        text = written(one, tmp_path, ".xml")
    assert str(one.solve().status) == "unstable"
    assert mujoco.MjModel.from_xml_string(text).nkey == 0 and "No equilibrium was found" in text
    with pytest.warns(EquilibriumWarning):
        assert json.loads(written(one, tmp_path, ".xpbd.json"))["displacements"] is None
    with pytest.warns(EquilibriumWarning):
        assert "PREDICTED = []" in written(one, tmp_path, ".py")


# -- shapes ------------------------------------------------------------------------------------------------------------


def holed(load, definition="lattice", material=STEEL, size="4 mm", **options):
    """A scene of a plate with a hole, under one of a few load cases."""
    end = asked(end="displacement right x")
    fixed, right = st.Support("left", x=0, y=0), st.Traction("right", ("2 kN", "200 N"))
    rollers = (st.Support("left", x=0), st.Support("corner", y=0))
    cases = (
        st.LoadCase("pull", rollers, (right,), quantities=end),
        st.LoadCase("press", (fixed,), pressures=(st.Pressure("hole", "20 MPa"),), quantities=end),
        st.LoadCase("weigh", (fixed,), gravity=(1e5, -3e5), quantities=end),
    )
    loads, hole = {case.name: case for case in cases}, st.Hole.circle(("30 mm", "10 mm"), "5 mm")
    plate = st.Shape.rectangle("60 mm", "20 mm", holes=[hole], points={"corner": (0, 0)}, loads=loads)
    return st.Scene(plate, st.mesh_shape(plate, size), material, load, definition=definition, **options)


@pytest.mark.parametrize("definition", ["lattice", "patch", "element-fit", "delingette"])
@pytest.mark.parametrize("load", ["pull", "press", "weigh"])
def test_equilibria_of_shapes_are_those_of_mujoco(load, definition, tmp_path):
    """Under a force on rollers and a point, pressure in a hole, and gravity, which is forces in the file."""
    one = holed(load, definition)
    result = one.solve()
    model, data = loaded(one, tmp_path)
    positions = result.displacements[~one.held]
    assert str(result.status) == "solved" and out_of_balance(model, data, positions) < 1e-9
    assert np.allclose(model.key_qpos[0], positions, rtol=0, atol=1e-8 * np.abs(positions).max())
    assert not model.opt.gravity.any()


def test_parts_of_shapes_keep_their_masses_in_mujoco(tmp_path):
    """A core of another material: the file's masses are those of both, and its springs balance."""
    light = st.Material("70 GPa", 0.3, density="2700 kg/m^3", name="light")
    core = st.Hole.circle(("30 mm", "10 mm"), "5 mm", part="core")
    plate = st.Shape.rectangle("60 mm", "20 mm", holes=[core], loads={"pull": pulled("1 kN", 0)})
    grouped = st.mesh_shape(plate, "2 mm")
    one = st.Scene(plate, grouped, {"": STEEL, "core": light}, "pull", definition="lattice")
    model, data = loaded(one, tmp_path)
    assert out_of_balance(model, data, one.solve().displacements[~one.held]) < 1e-9
    area = np.pi * 25e-6
    whole = 1e-3 * (7850 * (1.2e-3 - area) + 2700 * area)
    assert one.boundary_problem.masses().sum() == pytest.approx(whole, rel=2e-3)
    free = ~one.held.all(axis=1)
    moving = model.body_mass[1:].sum()
    assert moving == pytest.approx(one.boundary_problem.masses()[free].sum(), rel=1e-9)
    assert "Other parts are of 'light'." in written(one, tmp_path, ".xml")


@pytest.mark.parametrize("load", ["pull", "press", "weigh"])
def test_files_of_shapes_balance_by_what_they_hold_alone(load, tmp_path):
    """Supports, forces and springs of files for SOFA and XPBD, and of plain arrays."""
    one = holed(load, "patch")
    moved = one.solve().displacements
    sofa = as_sofa_reads(written(one, tmp_path, ".py"))
    rows = np.array(sofa["SpringForceField"][0]["spring"].split(), dtype=float).reshape(-1, 5)
    held, forces = held_and_loaded(sofa, len(moved))
    found = {"SOFA": (rows[:, :2].astype(int), rows[:, 2], rows[:, 4], held[:, :2], forces[:, :2])}
    xpbd = json.loads(written(one, tmp_path, ".xpbd.json"))
    names = ("particles", "rest_lengths", "compliance")
    pairs, lengths, compliance = (np.array(xpbd["constraints"][name]) for name in names)
    held = np.zeros(moved.shape, dtype=bool)
    for particle, axis in xpbd["held_directions"]:
        held[particle, axis] = True
    held[np.array(xpbd["inverse_masses"]) == 0] = True
    found["XPBD"] = pairs, 1 / compliance, lengths, held, np.array(xpbd["forces"])
    one.springs.write(tmp_path / "net.json", errors=False)
    net = st.SpringNet.read(tmp_path / "net.json")
    found["arrays"] = net.springs, net.stiffness, net.rest_lengths, net.held, net.forces
    for program, (springs, stiffness, lengths, held, forces) in found.items():
        assert np.array_equal(held, one.held), program
        left = pulls(one.mesh.points, springs, stiffness, lengths, one.mesh.points + moved) + forces
        assert np.linalg.norm(left[~held]) < 1e-9 * np.linalg.norm(forces), program
