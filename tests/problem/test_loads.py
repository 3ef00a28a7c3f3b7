"""Kinds of load: their properties, and new ones that are added from outside."""

import pytest

import springtune as st
from springtune.problem import loads
from springtune.problem.loads import AXES, AXIAL, BENDING, BOTTOM, FACE, LEFT, LOAD_KINDS, OWN_LOADS, RIGHT, SHEAR, TOP
from springtune.reference.finite_strain import solve_finite_strain
from springtune.reference.small_strain import solve_small_strain
from springtune.scene.mesh_cache import MeshCache
from springtune.studies.runs import plan, store

from campaigns import do_stages, load_text
from tables import STUDIES

LIFT = loads.LoadKind("lift", loaded=TOP, axis=1, held=((BOTTOM, AXES),))
BUILT_IN = loads.LoadKind("built-in", loaded=TOP, axis=1, held=((LEFT, AXES), (RIGHT, AXES)), pressed=True)

BEAM, FORCE = st.Beam(0.1, 0.02, 1e-3, "100x20"), 50.0
CORK = st.Material(1e9, 0.0, name="cork")
EXACT = FORCE * BEAM.height / (CORK.young_modulus * BEAM.thickness * BEAM.length)
"""Displacement of the top under an even traction without lateral contraction: strain is the same everywhere."""


@pytest.fixture
def lift(monkeypatch):
    """A load that the package does not have."""
    monkeypatch.setitem(OWN_LOADS, "lift", loads.Load(LIFT, 1.0))
    monkeypatch.setitem(LOAD_KINDS, "lift", LIFT)


def network_displacement(beam, material, force, kind, definition, size, mesh_type="structured"):
    """Displacement of a load on a linear network [m]."""
    mesh = st.MESH_TYPES[mesh_type](beam.length, beam.height, size)
    cache = MeshCache(mesh, beam.thickness)
    springs, _ = cache.derive(definition, material)
    return cache.solve(kind, springs, force, "linear").displacement


@pytest.mark.parametrize("kind", [AXIAL, BENDING, SHEAR, FACE, LIFT, BUILT_IN])
def test_properties(kind):
    assert kind.direct == (kind in (AXIAL, FACE, LIFT, BUILT_IN))
    assert kind.clamped == (kind in (AXIAL, BENDING, FACE, LIFT))
    assert kind.mirrored and kind.symmetric == kind.direct
    assert kind.uniaxial == (kind == AXIAL)
    assert kind.side_length(BEAM) == (BEAM.height if kind in (AXIAL, BENDING) else BEAM.length)
    assert str(kind) == kind.name


def test_half_models_hold_what_symmetry_asks_for():
    assert AXIAL.half_held == ((LEFT, AXES), (BOTTOM, (1,)))
    assert BENDING.half_held == ((LEFT, AXES), (BOTTOM, (0,)))
    assert SHEAR.half_held == ((BOTTOM, AXES), (TOP, (1,)), (RIGHT, (1,)))
    assert FACE.half_held == ((BOTTOM, AXES), (RIGHT, (0,)))
    assert BUILT_IN.half_held == ((LEFT, AXES), (RIGHT, (0,)))


@pytest.mark.parametrize("mesh_type", ["structured", "right", "free"])
def test_a_new_kind_on_a_network(lift, mesh_type):
    found = network_displacement(BEAM, CORK, FORCE, st.LOADS["lift"].kind, "delingette", 2e-3, mesh_type)
    assert found == pytest.approx(EXACT, rel=1e-6)


def test_a_new_kind_in_the_references(lift):
    kind = st.LOADS["lift"].kind
    small = solve_small_strain(BEAM, CORK, FORCE, kind=kind)
    assert small.displacement == pytest.approx(EXACT, rel=1e-6)
    assert small.displacement == pytest.approx(small.mean_displacement, rel=1e-9)
    little = 1e-3 * FORCE
    finite = solve_finite_strain(BEAM, CORK, little, kind=kind)
    assert finite.displacement == pytest.approx(1e-3 * EXACT, rel=1e-4)


def test_a_new_kind_through_a_study(lift, tmp_path):
    study = load_text(tmp_path, STUDIES["loads"])
    jobs = plan.stage_jobs(study, tmp_path)
    do_stages(study, tmp_path, "mesh", "reference", "solve")
    tasks = jobs["solve_0"].content
    (family,) = tasks["files"]
    (scene,) = family["tasks"]
    assert scene["kind"] == "lift"
    (result,) = store.read(f"{tasks['folder']}/{family['name']}.h5", [scene["key"]]).values()
    assert result["displacement"] == pytest.approx(EXACT, rel=1e-6)


def test_a_plate_clamped_at_both_ends():
    slender, nu = st.Beam(0.4, 0.01, 1e-3, "slender"), 0.0
    wood = st.Material(1e9, nu, name="wood")
    bending = FORCE * slender.length**3 / (384 * wood.young_modulus * slender.thickness * slender.height**3 / 12)
    # Shear stress of a parabola: 6/5 of the mean strain counts; the middle sinks by F L / 8 of it.
    shear = 1.2 * FORCE * slender.length / (8 * wood.young_modulus / 2 * slender.thickness * slender.height)
    small = solve_small_strain(slender, wood, -FORCE, kind=BUILT_IN)
    assert small.displacement == pytest.approx(-(bending + shear), rel=5e-3)
    assert small.mean_displacement / small.displacement == pytest.approx(8 / 15, rel=1e-2)


@pytest.mark.parametrize("material", [CORK, st.Material(1e6, 0.45, name="rubber")], ids=lambda one: one.name)
def test_supports_of_a_new_kind_are_the_same_everywhere(material):
    force = -1e-7 * material.young_modulus * BEAM.thickness * BEAM.length
    small = solve_small_strain(BEAM, material, force, kind=BUILT_IN)
    finite = solve_finite_strain(BEAM, material, force, kind=BUILT_IN)
    assert finite.displacement == pytest.approx(small.displacement, rel=1e-3)
    assert finite.mean_displacement == pytest.approx(small.mean_displacement, rel=1e-3)
    network = network_displacement(BEAM, material, force, BUILT_IN, "delingette", 1e-3)
    assert network == pytest.approx(small.displacement, rel=0.02)


def test_a_kind_whose_supports_are_not_symmetric_has_no_half_model():
    one_sided = loads.LoadKind("one-sided", loaded=TOP, axis=1, held=((LEFT, AXES),))
    assert not one_sided.mirrored
    with pytest.raises(ValueError, match="not symmetric"):
        solve_small_strain(BEAM, CORK, FORCE, kind=one_sided)
    # The whole is solved at finite strain: a cantilever under an even load, F L^3 / (8 E I) at its end.
    beam, force = st.Beam(0.2, 0.01, 1e-3, "slender"), 1e-4
    found = solve_finite_strain(beam, CORK, force, kind=one_sided)
    end = force * beam.length**3 / (8 * CORK.young_modulus * beam.thickness * beam.height**3 / 12)
    assert found.profile[-1] == pytest.approx(end, rel=5e-3)
