"""Stage `reference`: one finite-element solution a unit problem, and one a scene at finite strain."""

import time
from functools import partial

from ...jobs import store
from ...problem.geometry import Beam
from ...problem.loads import LOAD_KINDS
from ...problem.materials import Material
from ...reference.small_strain import ReferenceNotConvergedError, solve_unit


def run(tasks, spent):
    """Solve the references of a bundle that are not there yet.

    Parameters
    ----------
    tasks : dict
        ``folder``, ``references``, each with ``key`` and ``problem``, what
        `springtune.reference.similarity.unit_problem` gives with the name of the kind of load, and ``finite``, each
        with ``key, beam, material, force, load, plane, follower``, where ``load`` is the name of the kind.
    spent : Spent
        What tasks cost is added to it.
    """
    for kind, section, solve in (("reference", "references", _unit), ("finite", "finite", _finite)):
        for path, task in store.missing(tasks["folder"], tasks[section], spent.limits):
            begin = time.perf_counter()
            result = spent.attempt(task["key"], partial(solve, task), _hole)
            if result is None:
                continue
            result["seconds"] = time.perf_counter() - begin
            store.add(path, {task["key"]: result})
            spent.add(kind, 0, result["seconds"])


def lose(tasks, key, why, limits):
    """Store that a reference is beyond its limits.

    Parameters
    ----------
    tasks : dict
        As of `run`.
    key, why, limits : str
        Of the reference; what became of it; the limits.
    """
    store.lose(tasks["folder"], key, _hole(why), limits)


def _hole(why):
    return {"message": why, "seconds": 0.0}


def _unit(task):
    """Result of a unit problem."""
    aspect_ratio, nu, kind = task["problem"]
    try:
        solution = solve_unit(aspect_ratio, nu, LOAD_KINDS[kind])
    except ReferenceNotConvergedError as error:
        return {"message": str(error)}
    names = ("displacement", "mean_displacement", "error_estimate", "rotation", "strain", "x", "y", "displacements")
    return {name: getattr(solution, name) for name in names} | {"message": ""}


def _finite(task):
    """Result at finite strain."""
    # Here, since few studies need it.
    from ...reference.finite_strain import FiniteStrainError, IncompressibleError, solve_neo_hooke

    beam, material, kind = Beam(**task["beam"]), Material(**task["material"]), LOAD_KINDS[task["load"]]
    try:
        solution = solve_neo_hooke(beam, material, task["force"], kind, task["plane"], task["follower"])
    except (FiniteStrainError, IncompressibleError) as error:
        return {"message": str(error)}
    names = ("displacement", "mean_displacement", "error_estimate", "positions", "profile")
    return {name: getattr(solution, name) for name in names} | {"message": ""}
