"""Materials: isotropic, linearly elastic."""

from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np

from .quantities import positive


@dataclass(frozen=True)
class Material:
    """An isotropic linearly elastic material.

    Parameters
    ----------
    young_modulus : float or str
        Young's modulus E [Pa], or a text with its unit.
    poisson_ratio : float
        Poisson's ratio nu [1], above -1 and at most 0.5, which is legal, since sheets are in plane stress.
    density : float, str or None
        Density rho [kg/m3], or a text with its unit; statics need none.
    name : str
        Label of the material, e.g. ``"steel"``.

    Raises
    ------
    ValueError
        If a quantity is not above zero or of another kind, the name no text, or Poisson's ratio out of its range.

    Examples
    --------
    >>> import springtune as st
    >>> st.Material("210 GPa", 0.3, density="7850 kg/m^3", name="steel")
    Material(young_modulus=210000000000.0, poisson_ratio=0.3, density=7850.0, name='steel')
    """

    young_modulus: float
    poisson_ratio: float
    density: float | None = None
    name: str = "material"

    if TYPE_CHECKING:  # what it takes, where what it holds are numbers

        def __init__(
            self,
            young_modulus: float | str,
            poisson_ratio: float,
            density: float | str | None = None,
            name: str = "material",
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise ValueError(f"name: {self.name!r} is not a text; give one such as 'steel', or none")
        set_ = object.__setattr__  # of a frozen class
        set_(self, "young_modulus", positive(self.young_modulus, "stress", "Young's modulus"))
        if self.density is not None:
            set_(self, "density", positive(self.density, "density", "density"))
        if not (isinstance(self.poisson_ratio, Real) and -1 < self.poisson_ratio <= 0.5):
            raise ValueError(
                f"Poisson's ratio of {self.name!r} is {self.poisson_ratio!r}: isotropic materials have -1 < nu <= 0.5; "
                "give a number in that range"
            )

    @property
    def plane_stress(self) -> np.ndarray:
        """Stiffness in plane stress [Pa], shape (3, 3): stresses xx, yy, xy of strains xx, yy and the shear angle xy.

        Examples
        --------
        >>> import springtune as st
        >>> (st.Material("210 GPa", 0.3).plane_stress / 1e9).round(2).tolist()
        [[230.77, 69.23, 0.0], [69.23, 230.77, 0.0], [0.0, 0.0, 80.77]]
        """
        modulus, nu = self.young_modulus, self.poisson_ratio
        diagonal, coupling, shear = modulus / (1 - nu**2), modulus * nu / (1 - nu**2), modulus / (2 * (1 + nu))
        return np.array([[diagonal, coupling, 0.0], [coupling, diagonal, 0.0], [0.0, 0.0, shear]])
