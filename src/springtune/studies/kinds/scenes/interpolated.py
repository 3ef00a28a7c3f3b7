"""Choice of the references that are interpolated: where that takes fewer solves.

An interpolant has no whole fields; references that need one are solved one by one.
"""

from math import ceil, floor, log, log10
from typing import TYPE_CHECKING

from springtune.problem.loads import LOADS
from springtune.reference.answers import unit_problem
from springtune.springs import DEFINITIONS

from ...config.model import keeps_fields, once_a_study, shown

if TYPE_CHECKING:
    from springtune.problem.geometry import Beam
    from springtune.problem.materials import Material

    from ...config.model import Study

    Body = tuple[Beam, Material, str]
    Box = tuple[tuple[float, float], tuple[float, float]]

WITH_FIELDS = ("block", "definitions")
"""Outputs that show whole fields of all references."""

NODES_OF_ASPECTS = ((0.5, 5), (1.2, 9), (3.6, 17), (7.0, 33))
"""Nodes along aspect ratios that interpolants took, by the largest logarithm of the last over the first one. Others
took up to 65."""

NODES_OF_NUS = ((0.1, 5), (0.6, 9))
"""The same by the largest difference of Poisson's ratios; others took 17."""

CHECKS = 24
"""Solves that an interpolant is compared with."""

ASPECT_STEPS = 10
"""Ends of ranges of aspect ratios: so many in a decade, each 1.26 times the one before. Aspect ratios that are added to
a study mostly leave its interpolant as it is."""

NU_STEP = 0.05
"""Distance of the ends of ranges of Poisson's ratio [1]."""


@once_a_study("grids", "outputs")
def interpolants(study: "Study") -> "dict[str, tuple[Box, dict[Body, tuple[float, float]]]]":
    """Interpolants of a study by kind of load: their box, and the unit problem of each body in it."""
    if any(name in study.outputs for name in WITH_FIELDS):
        return {}
    scenes = [scene for grid in study.grids for scene in grid.scenes]
    # Bodies are few and shared; comparing them for each of 100,000 scenes is no way to find them.
    bodies = {(id(one.mesh.beam), id(one.material), one.load): one for one in scenes}
    if len(bodies) <= CHECKS:
        return {}
    wanted = [one for one in scenes if DEFINITIONS[one.definition].needs == "cases"]
    if keeps_fields(study):
        wanted += shown(scenes, study.swept)
    # Bodies and loads that share a unit problem share its solution, too.
    whole = {unit_problem(one.mesh.beam, one.material, LOADS[one.load].kind) for one in wanted}
    kinds: dict[str, dict[Body, tuple[float, float]]] = {}
    for one in bodies.values():
        body = one.mesh.beam, one.material, one.load
        aspect_ratio, nu, kind = problem = unit_problem(body[0], body[1], LOADS[body[2]].kind)
        if problem not in whole and kind.mirrored and -1 < nu <= 0.5:
            kinds.setdefault(kind.name, {})[body] = aspect_ratio, nu
    boxes = {name: box_of(set(problems.values())) for name, problems in kinds.items()}
    return {
        name: (boxes[name], problems)
        for name, problems in kinds.items()
        if len(set(problems.values())) > expected_solves(boxes[name])
    }


def box_of(problems: set[tuple[float, float]]) -> "Box":
    """Box of aspect ratios and Poisson's ratios around unit problems, its ends rounded outwards.

    Examples
    --------
    >>> box_of({(1.5, 0.3), (5, 0.3)})
    ((1.258925, 5.011872), (0.3, 0.3))
    >>> box_of({(2, -0.98), (2, 0.49)})
    ((2.0, 2.0), (-0.98, 0.5))
    """
    aspects, nus = ([float(one[axis]) for one in problems] for axis in range(2))
    first, last, least, largest = min(aspects), max(aspects), min(nus), max(nus)
    if first < last:
        # An end that is one of the steps stays where it is, though its logarithm is rounded.
        lower, upper = floor(ASPECT_STEPS * log10(first) + 1e-5), ceil(ASPECT_STEPS * log10(last) - 1e-5)
        first, last = (
            min(first, float(f"{10 ** (lower / ASPECT_STEPS):.7g}")),
            max(last, float(f"{10 ** (upper / ASPECT_STEPS):.7g}")),
        )
    if least < largest:
        below, above = (
            round(floor(least / NU_STEP + 1e-6) * NU_STEP, 2),
            round(ceil(largest / NU_STEP - 1e-6) * NU_STEP, 2),
        )
        least, largest = min(least, below) if below > -1 else least, min(max(largest, above), 0.5)
    return (first, last), (least, largest)


def expected_solves(box: "Box") -> int:
    """Approximate number of solves for an interpolant over a box.

    Examples
    --------
    >>> expected_solves(((1, 12), (0, 0.5))), expected_solves(((4, 6), (0.3, 0.3)))
    (177, 29)
    """
    (first, last), (least, largest) = box
    count = 1
    for width, known, most in ((log(last / first), NODES_OF_ASPECTS, 65), (largest - least, NODES_OF_NUS, 17)):
        if width:
            count *= next((nodes for widest, nodes in known if width <= widest), most)
    return count + CHECKS
