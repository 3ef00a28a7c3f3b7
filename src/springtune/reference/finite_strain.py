r"""Reference at finite strain: a neo-Hookean sheet, plane stress or plane strain, by quadratic finite elements.

The strain energy is that of CalculiX and Abaqus,

.. math:: W = \tfrac{\mu}{2} (J^{-2/3} I_1 - 3) + \tfrac{K}{2} (J - 1)^2,

with the shear modulus mu and the bulk modulus K of the material at small strain. In plane stress the stretch across
the sheet is eliminated in every point; an incompressible material, nu = 0.5, has there
:math:`W = \mu/2 (I_1 + J^{-2} - 3)` of the deformation in the plane. Only half of the beam is solved, elements shrink
towards the corners, and the load grows in steps where it must.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad

COUNTS = (5, 8)
"""Elements over half the height of the two meshes that are solved; the second is the answer."""

GRADING = 3
"""Power law of the elements' coordinates towards the corners."""

TOLERANCE = 1e-9
"""Largest residual relative to the load."""

ROUND_OFF = 1e-13
"""Residual that rounding leaves, for E = 1 and half the height 1."""

MAX_ITERATIONS = 15

SMALLEST_STEP = 1 / 64


class FiniteStrainError(RuntimeError):
    """A reference that did not converge; the message says how far it came."""


@dataclass(frozen=True)
class FiniteStrainSolution:
    """Displacements of a beam at finite strain.

    Attributes
    ----------
    displacement : float
        Displacement of the load, see `springtune.loads` [m].
    mean_displacement : float
        Mean displacement of the loaded side along the force [m].
    error_estimate : float
        Difference to the coarser mesh, relative [1]: several times the error, since errors fall with the mesh.
    positions : ndarray of float, shape (n,)
        Places on the loaded side over its length [1], ascending.
    profile : ndarray of float, shape (n,)
        Displacements there along the force [m].
    """

    displacement: float
    mean_displacement: float
    error_estimate: float
    positions: np.ndarray
    profile: np.ndarray


def solve_neo_hooke(beam, material, force, kind="face", plane="stress", follower=False):
    """Displacements of a neo-Hookean beam under a load.

    Parameters
    ----------
    beam : Beam
    material : Material
    force : float
        Force [N], positive outwards.
    kind : str
        ``"axial"`` or ``"face"``, see `springtune.loads`.
    plane : str
        ``"stress"`` or ``"strain"``.
    follower : bool
        Whether the load is a pressure that follows the face.

    Returns
    -------
    FiniteStrainSolution

    Raises
    ------
    ValueError
        For an incompressible material in plane strain, which displacements alone cannot describe.
    FiniteStrainError
        If Newton's method does not converge in small load steps.
    """
    nu = material.poisson_ratio
    if plane == "strain" and nu >= 0.5:
        raise ValueError(f"plane strain of '{material.name}' needs a Poisson's ratio below 0.5, such as 0.4999")
    side = beam.length if kind == "face" else beam.height
    stress = force / (side * beam.thickness * material.young_modulus)
    sheets = [_Sheet(beam.length / beam.height, nu, count, kind, plane, follower) for count in COUNTS]
    coarse, fine = (sheet.solve(stress, f"{beam.name}, {material.name}") for sheet in sheets)
    # Lengths are over half the height.
    scale = beam.height / 2
    return FiniteStrainSolution(
        displacement=scale * fine[0],
        mean_displacement=scale * fine[1],
        error_estimate=float(abs(coarse[0] / fine[0] - 1)),
        positions=fine[2],
        profile=scale * fine[3],
    )


class _Sheet:
    """Half of a sheet of height 2 with E = 1: the left one under a face load, the upper one under an axial one."""

    def __init__(self, aspect_ratio, nu, count, kind, plane, follower):
        self.kind, self.follower = kind, follower
        self.energy = NeoHooke(nu, plane)
        length = 2 * aspect_ratio
        near = np.linspace(0, 1, count + 1) ** GRADING
        if kind == "face":
            along = _spread(near, length / 2, count)
            across = np.concatenate([near, 2 - near[-2::-1]])
        else:
            along = _spread(near, length, count)
            across = 1 - near[::-1]
        mesh = MeshQuad.init_tensor(along, across)
        element = ElementVector(ElementQuad2())
        self.basis = Basis(mesh, element, intorder=4)
        axis, place = (1, 2.0) if kind == "face" else (0, length)
        facets = mesh.facets_satisfying(lambda x: np.isclose(x[axis], place), boundaries_only=True)
        self.side = FacetBasis(mesh, element, facets=facets, intorder=4)
        clamp = self.basis.get_dofs(lambda x: np.isclose(x[1 if kind == "face" else 0], 0)).all()
        if kind == "face":
            symmetry = self.basis.get_dofs(lambda x: np.isclose(x[0], length / 2)).all(["u^1"])
        else:
            symmetry = self.basis.get_dofs(lambda x: np.isclose(x[1], 0)).all(["u^2"])
        self.free = np.setdiff1d(np.arange(self.basis.N), np.union1d(clamp, symmetry))
        component = 1 if kind == "face" else 0
        self.load = LinearForm(lambda v, w: v[component]).assemble(self.side)
        nodes = self.basis.get_dofs(facets).all([f"u^{component + 1}"])
        place = self.basis.doflocs[1 - component][nodes]
        order = np.argsort(place)
        self.nodes, self.places = nodes[order], place[order]

    def solve(self, stress, name):
        """Displacement of the load, mean, positions and profile, over half the height."""
        moved, done, step = np.zeros(self.basis.N), 0.0, 1.0
        while done < 1:
            step = min(step, 1 - done)
            found = self._newton(moved, stress * (done + step))
            if found is not None:
                moved, done, step = found, done + step, 1.5 * step
            elif step <= SMALLEST_STEP:
                raise FiniteStrainError(f"reference of {name}: no equilibrium beyond {100 * done:.3g} % of the load")
            else:
                step /= 2
        profile = moved[self.nodes]
        mean = float(self.load @ moved / self.load.sum())
        if self.kind == "axial":
            return mean, mean, 0.5 + 0.5 * self.places, profile
        whole = 2 * self.places[-1]
        positions = np.concatenate([self.places, whole - self.places[-2::-1]]) / whole
        return float(profile[-1]), mean, positions, np.concatenate([profile, profile[-2::-1]])

    def _newton(self, moved, stress):
        size = np.linalg.norm(stress * self.load)
        for _ in range(MAX_ITERATIONS):
            residual, tangent = self._balance(moved, stress)
            if not np.isfinite(residual).all():
                return None
            if np.linalg.norm(residual[self.free]) <= max(TOLERANCE * size, ROUND_OFF):
                return moved
            try:
                step = splu(tangent[self.free][:, self.free].tocsc()).solve(residual[self.free])
            except RuntimeError:
                return None
            if np.abs(step).max() > 1.0:
                return None
            moved = moved.copy()
            moved[self.free] += step
        return None

    def _balance(self, moved, stress):
        """Out-of-balance forces and tangent."""
        gradient = self.basis.interpolate(moved).grad
        with np.errstate(all="ignore"):
            state = self.energy.state(np.eye(2)[:, :, None, None] + gradient)
        inner = _inner.assemble(self.basis, P=state.stress)
        tangent = BilinearForm(lambda u, v, w: _dot(state.increment(u.grad), v.grad)).assemble(self.basis)
        if not self.follower:
            return stress * self.load - inner, tangent
        # A pressure acts along the cofactor of the deformation gradient times the normal.
        turned = np.eye(2)[:, :, None, None] + self.side.interpolate(moved).grad
        pull = LinearForm(lambda v, w: _along_normal(turned, v))
        stiffness = BilinearForm(lambda u, v, w: _along_normal(u.grad, v))
        return stress * pull.assemble(self.side) - inner, tangent - stress * stiffness.assemble(self.side)


def _along_normal(gradient, v):
    """Cofactor times the normal (0, 1), along v."""
    return -gradient[1, 0] * v[0] + gradient[0, 0] * v[1]


@LinearForm
def _inner(v, w):
    return _dot(w["P"], v.grad)


def _dot(a, b):
    return a[0, 0] * b[0, 0] + a[0, 1] * b[0, 1] + a[1, 0] * b[1, 0] + a[1, 1] * b[1, 1]


def _cofactor(a):
    return np.array([[a[1, 1], -a[1, 0]], [-a[0, 1], a[0, 0]]])


def _spread(near, length, count):
    """Coordinates from 0 to length, graded within 1 of 0 and even beyond."""
    if length <= 1:
        return near * length
    return np.concatenate([near, np.linspace(1, length, 1 + max(1, round(count * (length - 1) / 2)))[1:]])


class NeoHooke:
    """Neo-Hookean energy of a sheet with E = 1.

    Parameters
    ----------
    nu : float
        Poisson's ratio at small strain [1].
    plane : str
        ``"stress"`` or ``"strain"``.
    """

    def __init__(self, nu, plane):
        self.shear = 1 / (2 * (1 + nu))
        self.bulk = np.inf if nu >= 0.5 else 1 / (3 * (1 - 2 * nu))
        self.plane = plane

    def state(self, gradient):
        """Stress and tangent at deformation gradients, shape (2, 2, ...)."""
        return (_Incompressible if np.isinf(self.bulk) else _Compressible)(self, gradient)


class _Incompressible:
    """W = mu/2 (F:F + J^-2 - 3)."""

    def __init__(self, material, f):
        self.shear, self.area, self.turned = material.shear, f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0], _cofactor(f)
        self.stress = self.shear * (f - self.area**-3 * self.turned)

    def increment(self, d):
        """Derivative of the first Piola-Kirchhoff stress along d."""
        growth = _dot(self.turned, d)
        return self.shear * (d - self.area**-3 * _cofactor(d) + 3 * self.area**-4 * growth * self.turned)


class _Compressible:
    """W of the module's docstring, the stretch across eliminated in plane stress."""

    def __init__(self, material, f):
        mu, bulk = material.shear, material.bulk
        self.mu, self.bulk, self.f = mu, bulk, f
        self.area, self.turned = f[0, 0] * f[1, 1] - f[0, 1] * f[1, 0], _cofactor(f)
        self.condensed = material.plane == "stress"
        self.across = np.ones(self.area.shape)
        if self.condensed:
            self.across = 1 / self.area
            for _ in range(30):
                self._parts()
                step = self.slope / self.bend
                self.across = np.maximum(self.across - step, 0.2 * self.across)
                if np.nanmax(np.abs(step)) < 1e-14:
                    break
        self._parts()
        self.stress = mu * self.iso * f + self.pressure / self.area * self.turned

    def _parts(self):
        """Parts of the derivatives; `slope` and `bend` are those by the stretch across."""
        mu, across = self.mu, self.across
        self.volume = self.area * across
        self.iso = self.volume ** (-2 / 3)
        self.trace = _dot(self.f, self.f) + across**2
        self.pressure = -mu / 3 * self.iso * self.trace + self.bulk * (self.volume - 1) * self.volume
        self.iso_across = -2 / 3 * self.iso / across
        self.pressure_across = -mu / 3 * (self.iso_across * self.trace + 2 * self.iso * across)
        self.pressure_across = self.pressure_across + self.bulk * (2 * self.volume - 1) * self.area
        self.slope = mu * self.iso * across + self.pressure / across
        self.bend = mu * (self.iso + self.iso_across * across)
        self.bend = self.bend + self.pressure_across / across - self.pressure / across**2

    def increment(self, d):
        """Derivative of the first Piola-Kirchhoff stress along d."""
        mu, growth = self.mu, _dot(self.turned, d)
        iso = -2 / 3 * self.iso * growth / self.area
        pressure = -mu / 3 * (iso * self.trace + 2 * self.iso * _dot(self.f, d))
        pressure = pressure + self.bulk * (2 * self.volume - 1) * self.across * growth
        change = mu * (iso * self.f + self.iso * d) + pressure / self.area * self.turned
        change = change + self.pressure * (_cofactor(d) / self.area - self.turned * growth / self.area**2)
        if self.condensed:
            mixed = mu * self.iso_across * self.f + self.pressure_across / self.area * self.turned
            change = change - mixed * _dot(mixed, d) / self.bend
        return change
