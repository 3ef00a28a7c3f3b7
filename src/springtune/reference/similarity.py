"""The unit problem behind a small-strain reference: what of a beam, material and load its answer depends on.

Lengths over half the height and stresses over the traction leave a problem of the aspect ratio, of Poisson's ratio and
of the kind of load alone. Beams that differ in size or thickness and materials that differ in Young's modulus share it.
"""


def unit_problem(beam, material, kind):
    """Aspect ratio [1], Poisson's ratio [1] and kind of load.

    Parameters
    ----------
    beam : Beam
    material : Material
    kind : str
        Kind of load, one of `springtune.problem.loads.KINDS`.

    Returns
    -------
    tuple of float, float and str
        The aspect ratio to twelve digits, so that it is the same for .2 over .04 and for .1 over .02.
    """
    return float(f"{beam.length / beam.height:.12g}"), material.poisson_ratio, kind


def unit_scales(beam, material, kind):
    """What lengths and displacements of the unit problem are multiplied with.

    Parameters
    ----------
    beam, material, kind
        As in `unit_problem`.

    Returns
    -------
    length : float
        Half the height [m].
    displacement : float
        Displacement for 1 N [m]: half the height times the traction over Young's modulus.
    """
    side = beam.length if kind in ("shear", "face") else beam.height
    return beam.height / 2, beam.height / 2 / (side * beam.thickness * material.young_modulus)
