"""References of sheets by other means than the library's: quadratic elements, and closed forms of slender ones.

A sheet of height 2 with E = 1 under traction 1, as `springtune.reference.small_strain.solve_unit`. Nine-node
quadrilaterals on a mesh that is halved again and again towards the corners; the energy of two such meshes, one with
each element cut into four, gives Richardson's extrapolation of order 4. Sheets longer than `DIRECT` are not solved:
what a clamp and a loaded end do decays as exp(-4.2 L/H), so beyond that the displacement of the load is a polynomial of
the length, whose leading term is beam theory's and whose other ones come from shorter sheets. No system there is worse
conditioned than that of a short beam.
"""

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad
from skfem.helpers import ddot, sym_grad, trace

DIRECT = 6.0
"""Aspect ratio up to which sheets are solved."""

LAYERS = 10
"""Halvings towards a corner: what the last element misses is its size to the power 1.4, below 1e-6 of a small part."""


def halved(length, both, cuts):
    """Coordinates from 0 to length, halved towards 0 or both ends, cut as often, no element above half the height."""
    reach = min(1.0, length / 2)
    near = reach * np.concatenate([[0.0], 0.5 ** np.arange(LAYERS, -1, -1.0)])
    far = length - near[::-1] if both else np.array([length])
    inner = np.linspace(near[-1], far[0], max(1, int(np.ceil((far[0] - near[-1]) / 0.5 - 1e-9))) + 1)
    whole = np.concatenate([near[:-1], inner, far[1:]]) if far[0] > near[-1] + 1e-12 else np.append(near, far[1:])
    return np.append((whole[:-1, None] + np.diff(whole)[:, None] * np.arange(cuts) / cuts).ravel(), whole[-1])


def _one(ratio, nu, kind, cuts):
    length = 2 * ratio
    mesh = MeshQuad.init_tensor(halved(length, kind != "axial", cuts), halved(2.0, True, cuts))
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=4)

    @BilinearForm
    def stiffness(u, v, _):
        strain, other = sym_grad(u), sym_grad(v)
        return nu / (1 - nu**2) * trace(strain) * trace(other) + ddot(strain, other) / (1 + nu)

    above = kind in ("shear", "face")
    component = 1 if kind in ("bending", "face") else 0
    facets = mesh.facets_satisfying(lambda x: np.isclose(x[1 if above else 0], 2.0 if above else length), True)
    side = FacetBasis(mesh, ElementVector(ElementQuad2()), facets=facets, intorder=4)
    load = LinearForm(lambda v, w: v[component]).assemble(side)
    held = basis.get_dofs(lambda x: np.isclose(x[1 if above else 0], 0)).all()
    if kind == "shear":
        held = np.union1d(held, basis.get_dofs(facets).all(["u^2"]))
    free = np.setdiff1d(np.arange(basis.N), held)
    matrix = stiffness.assemble(basis)[free][:, free].tocsc()
    factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    moved = np.zeros(basis.N)
    moved[free] = factor.solve(load[free])
    moved[free] += factor.solve(load[free] - matrix @ moved[free])
    if kind == "face":
        return float(basis.probes(np.array([[length / 2], [2.0]]))[1] @ moved)
    return float(load @ moved / load.sum())


def solved(ratio, nu, kind):
    """Displacement of the load of a sheet, and how far the finer mesh was from it, relative."""
    coarse, fine = _one(ratio, nu, kind, 1), _one(ratio, nu, kind, 2)
    value = fine + (fine - coarse) / 15
    return value, abs(fine / value - 1)


def displacement(ratio, nu, kind):
    """Displacement of the load of a sheet of any aspect ratio from 1 on, in units of half the height."""
    if ratio <= DIRECT:
        return solved(ratio, nu, kind)[0]
    length = 2 * ratio
    if kind == "face":  # in its middle a long sheet does not know of its ends
        return solved(DIRECT, nu, kind)[0]
    if kind == "axial":
        return solved(5.0, nu, kind)[0] - 10.0 + length
    if kind == "shear":  # energy: that of even shear, and a constant of the ends
        return 4 * (1 + nu) + (solved(5.0, nu, kind)[0] - 4 * (1 + nu)) * 10.0 / length
    # Bending, force 2 and I = 2/3: L^3 over 3 E I is L^3; the rest is quadratic.
    ratios = np.array([4.0, 5.0, 6.0])
    rest = [solved(place, nu, kind)[0] - (2 * place) ** 3 for place in ratios]
    return length**3 + float(np.polyval(np.polyfit(2 * ratios, rest, 2), length))
