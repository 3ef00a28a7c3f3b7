"""The unit problem behind a small-strain reference: what of a beam, material and load its answer depends on.

Lengths over half the height and stresses over the traction leave a problem of the aspect ratio, of Poisson's ratio and
of the kind of load alone. Beams that differ in size or thickness and materials that differ in Young's modulus share it.
"""

from ..problem.geometry import Beam
from ..problem.loads import LoadKind
from ..problem.materials import Material


def unit_problem(beam: Beam, material: Material, kind: LoadKind) -> tuple[float, float, LoadKind]:
    """Aspect ratio [1], Poisson's ratio [1] and kind of load."""
    return float(f"{beam.length / beam.height:.12g}"), material.poisson_ratio, kind


def unit_scales(beam: Beam, material: Material, kind: LoadKind) -> tuple[float, float]:
    """What lengths and displacements of the unit problem are multiplied with.

    Returns
    -------
    length : float
        Half the height [m].
    displacement : float
        Displacement for 1 N [m]: half the height times the traction over Young's modulus.
    """
    side = kind.side_length(beam)
    return beam.height / 2, beam.height / 2 / (side * beam.thickness * material.young_modulus)
