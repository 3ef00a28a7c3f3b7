"""References of rubber that was tested: closed forms, their field, and which scenes are compared with them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import springtune
from springtune.problem.geometry import Beam
from springtune.problem.loads import AXIAL, BENDING, FACE
from springtune.problem.materials import Rubber
from springtune.reference.finite_strain import law_of, solve_finite_strain
from springtune.reference.small_strain import ReferenceNotConvergedError

RUBBER = Rubber((2e5, -5e2, 40.0))

gradients = st.tuples(*[st.floats(-0.25, 0.25)] * 4).map(lambda values: np.eye(2) + np.reshape(values, (2, 2)))


def green(f):
    found = (f.T @ f - np.eye(2)) / 2
    return np.array([found[0, 0], found[1, 1], 2 * found[0, 1]])


@settings(max_examples=25)
@given(f=gradients, change=st.tuples(*[st.floats(-1, 1)] * 3))
def test_stress_and_tangent_are_derivatives_of_yeohs_energy(f, change):
    law, strain, change, step = law_of(RUBBER), green(f), np.array(change), 1e-5

    def energy(strain):
        c = np.array([[1 + 2 * strain[0], strain[2]], [strain[2], 1 + 2 * strain[1]]])
        excess = np.trace(c) + 1 / np.linalg.det(c) - 3
        return sum(one * excess**n for n, one in enumerate(RUBBER.coefficients, 1)) / RUBBER.young_modulus

    slope = (energy(strain + step * change) - energy(strain - step * change)) / (2 * step)
    found = law.response(strain)
    # Differences leave step^2 times a third derivative, which is some hundred at J = 0.5.
    assert slope == pytest.approx(found.stress @ change, abs=2e-6)
    stresses = [law.response(strain + sign * step * change).stress for sign in (1, -1)]
    assert (stresses[0] - stresses[1]) / (2 * step) == pytest.approx(found.tangent @ change, abs=2e-5)


@given(gradients)
def test_one_term_is_neo_hooke(f):
    ours, theirs = (law.response(green(f)) for law in (law_of(Rubber((2e5,))), law_of(springtune.Material(1.0, 0.5))))
    assert ours.stress == pytest.approx(theirs.stress, rel=1e-12, abs=1e-13)
    assert ours.tangent == pytest.approx(theirs.tangent, rel=1e-12, abs=1e-13)


def test_a_bar_stretches_as_its_law_says():
    """Two bars, whose clamps hold alike: what the longer one has more is in uniaxial tension."""
    stretch = 4.0
    force = float(RUBBER.stress("uniaxial", stretch)) * 0.01 * 1e-3
    short, long = (
        solve_finite_strain(Beam(length, 0.01, 1e-3, "bar"), RUBBER, force, AXIAL) for length in (0.02, 0.03)
    )
    # The clamp's part decays within half a height at rest; elements leave less.
    assert (long.displacement - short.displacement) / 0.01 == pytest.approx(stretch - 1, rel=1e-4)


@pytest.mark.parametrize(("kind", "force"), [(AXIAL, 0.5), (BENDING, 0.01), (FACE, -0.5)])
def test_the_field_is_that_of_the_displacement(kind, force):
    beam = Beam(0.02, 0.01, 1e-3, "block")
    found = solve_finite_strain(beam, springtune.Material(1e6, 0.5), force, kind)
    assert (found.x[[0, -1]], found.y[[0, -1]]) == (pytest.approx([0, 0.02]), pytest.approx([0, 0.01]))
    ends = {0: (beam.length, None), 1: (None, beam.height)}[kind.normal]
    along = found.positions * (beam.height if kind.normal == 0 else beam.length)
    points = np.stack(
        [np.full_like(along, ends[0]), along] if kind.normal == 0 else [along, np.full_like(along, ends[1])], 1
    )
    assert found.at(points)[:, kind.axis] == pytest.approx(found.profile, abs=1e-9)
    for side, axes in kind.held:
        held = np.stack([np.full(7, 0.0), np.linspace(0, beam.height, 7)], 1)
        if side.axis == 1:
            held = np.stack([np.linspace(0, beam.length, 7), np.zeros(7)], 1)
        if side.place(beam.length, beam.height) == 0:
            assert np.abs(found.at(held)[:, list(axes)]).max() <= 1e-12
    if kind.symmetric:  # about the middle
        points = np.array([[0.004, 0.002], [0.007, 0.004]])
        size, axis = ((beam.height, 1), (beam.length, 0))[kind.along == 0]
        mirrored = points.copy()
        mirrored[:, axis] = size - mirrored[:, axis]
        sign = np.where(np.arange(2) == axis, -1, 1)
        assert found.at(mirrored) == pytest.approx(sign * found.at(points), abs=1e-9)


class TestScenes:
    beam = springtune.Beam("20 mm", "10 mm")
    mesh = springtune.make_mesh(beam, "structured", "2 mm")

    def scene(self, definition, material=RUBBER, force="10 N", **options):
        return springtune.Scene(self.beam, self.mesh, material, "traction", force, definition=definition, **options)

    def test_rubber_is_compared_with_its_own_law_and_without_an_objection(self):
        """Stretched to some three times its length; against small strain it would err by a third."""
        scene = self.scene("yeoh")
        result = scene.solve()
        assert result.displacement > 1.5 * 0.02 and abs(result.error) < 5e-3 and scene.objection == ""
        assert scene.reference() is scene.reference()
        linear = self.scene("yeoh", kinematics="linear")
        assert not linear.finite_strain and abs(linear.solve().error) < 0.02
        assert linear.reference().displacement != pytest.approx(scene.reference().displacement, rel=0.1)

    def test_neo_hooke_of_a_tested_rubber_is_told_what_the_law_lacks(self):
        stiffening = Rubber((2e5, 0.0, 4e3))
        assert self.scene("neo-hooke", stiffening, "5 N").solve().error > 0.03
        assert abs(self.scene("yeoh", stiffening, "5 N").solve().error) < 5e-3

    def test_others_keep_small_strain_and_its_objection(self):
        assert "the linear reference does not apply" in self.scene("delingette").objection
        # Laws differ by about the strain, here 4e-5, and the two references by their estimates.
        errors = [self.scene(name, force="0.5 mN").solve().error for name in ("neo-hooke", "delingette")]
        assert errors[0] == pytest.approx(errors[1], abs=2e-4)

    def test_what_is_written_says_which_reference_it_is(self, tmp_path):
        import meshio

        result = self.scene("yeoh").solve()
        result.write(tmp_path / "pull.vtu")
        error = meshio.read(tmp_path / "pull.vtu").point_data["error"]
        assert np.abs(error).max() < 0.02 * result.displacement
        frames = result.write(tmp_path / "pull.pvd", steps=2)
        kept = ["error" in meshio.read(frame).point_data for frame in sorted(frames) if frame.suffix == ".vtu"]
        assert kept == [False, False, True]

    def test_a_load_beyond_equilibrium_has_no_reference(self):
        with pytest.raises(ReferenceNotConvergedError, match="no equilibrium beyond"):
            springtune.Scene(
                self.beam, self.mesh, springtune.Material("1 MPa", 0.3), "follower-pressure", "4000 N",
                definition="neo-hooke",
            ).reference()  # fmt: skip


def test_a_shape_has_no_error_at_finite_strain():
    """There its reference is of small strain alone: NaN, and the objection says why; near rest there is an error."""
    pull = springtune.LoadCase(
        "pull", [springtune.Support("left", x=0, y=0)], [springtune.Traction("right", ("10 N", 0))],
        quantities=[springtune.Quantity("end", "displacement", "right", "x")],
    )  # fmt: skip
    sheet = springtune.Shape.rectangle("20 mm", "10 mm", loads={"pull": pull})
    grouped = springtune.mesh_shape(sheet, "2 mm")
    far, near = (
        springtune.Scene(sheet, grouped, RUBBER, "pull", definition="yeoh", scale=scale) for scale in (1.0, 0.01)
    )
    assert np.isnan(far.solve().error) and "its strain is" in far.objection
    assert abs(near.solve().error) < 0.02 and near.objection == ""
