"""Unit problem of a small-strain reference.

With lengths over half the height and stresses over the traction only the aspect ratio, Poisson's ratio and the kind
of load remain. Beams that differ in size, thickness or Young's modulus share it.
"""

from ..problem.geometry import Beam
from ..problem.loads import LoadKind
from ..problem.materials import Material


def unit_problem(beam: Beam, material: Material, kind: LoadKind) -> tuple[float, float, LoadKind]:
    """Aspect ratio [1], Poisson's ratio [1] and kind of load."""
    return float(f"{beam.length / beam.height:.12g}"), material.poisson_ratio, kind


def unit_scales(beam: Beam, material: Material, kind: LoadKind) -> tuple[float, float]:
    """Return the scales of lengths and displacements of the unit problem.

    Half the height [m]; and for 1 N half the height times the traction over Young's modulus [m].
    """
    side = kind.side_length(beam)
    return beam.height / 2, beam.height / 2 / (side * beam.thickness * material.young_modulus)
