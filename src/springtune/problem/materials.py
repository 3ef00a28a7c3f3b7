"""Materials: isotropic, linearly elastic."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """An isotropic linearly elastic material.

    Attributes
    ----------
    name : str
        Label of the material, e.g. ``"steel"``.
    young_modulus : float
        Young's modulus E [Pa].
    poisson_ratio : float
        Poisson's ratio nu [1]; 0.5 is legal, since sheets are in plane stress.
    density : float or None
        Density rho [kg/m3]; statics need none.
    """

    name: str
    young_modulus: float
    poisson_ratio: float
    density: float | None = None
