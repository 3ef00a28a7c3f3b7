"""Errors of networks against references, and the stiffness without error on a sensitivity curve."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .quantities import Status

ROOT_TOLERANCE = 1e-10  # relative tolerance of a best stiffness, below that of the curve

MOST_BISECTIONS = 12  # bisections in search of a best stiffness where a curve ends

Solve = Callable[[float], float]  # displacement at a stiffness


def error_text(error: float) -> str:
    """Deformation error in words: two decimals below 10 %, otherwise three digits."""
    percent = 100 * error
    if percent != percent:
        return "no reference"
    return f"{round(percent, 2) + 0.0:+.2f} %" if abs(percent) < 10 else f"{percent:+.3g} %"


def deformation_error(displacement: ArrayLike, reference: ArrayLike) -> np.ndarray:
    """Signed error ``(network - reference) / |reference|`` [1]; positive means further along +x, see `sign_word`."""
    displacement, reference = np.asarray(displacement), np.asarray(reference)
    return (displacement - reference) / np.abs(reference)


def sign_word(error: float, reference: float, kind: str = "displacement") -> str:
    """Word for the sign of an error, "too soft" or "too large" by `kind` and opposites; empty for zero or NaN."""
    more, less = ("too soft", "too stiff") if kind == "displacement" else ("too large", "too small")
    return more if error * reference > 0 else less if error * reference < 0 else ""


def sign_sentence(references: Mapping[str, float], where: str = "under") -> str:
    """Say once which sign of errors means too soft, for displacements of references by load or by quantity."""
    against = [name for name, value in references.items() if value < 0]
    if not against:
        return "positive: too soft"
    if not any(value > 0 for value in references.values()):
        return "negative: too soft"
    names = " and ".join(filter(None, (", ".join(against[:-1]), against[-1])))
    return f"positive: too soft; {where} {names}, where displacements are negative, negative is too soft"


def quantity_errors(values: Mapping[str, float], known: Mapping[str, float]) -> dict[str, float]:
    """Return the `deformation_error` of each quantity of interest; NaN if its reference is missing or zero."""
    given = {name: known.get(name) or np.nan for name in values}
    return {name: float(deformation_error(value, given[name])) for name, value in values.items()}


@dataclass(frozen=True)
class Best:
    """Stiffness [N/m] at which a sensitivity curve meets the reference, or NaN and a `status` that says why."""

    stiffness: float
    status: Status
    message: str = ""


def best_stiffness(
    stiffness: np.ndarray, displacement: np.ndarray, stable: np.ndarray, reference: float, solve: Solve
) -> Best:
    """Find the stiffness [N/m] at which the stable part of a curve meets the reference, by ``solve(k)`` in 1/k."""
    if not np.isfinite(reference):
        return Best(np.nan, Status.FAILED, "the reference has no displacement")
    softness, error = 1.0 / np.asarray(stiffness)[::-1], np.asarray(displacement)[::-1] - reference
    solved = np.asarray(stable)[::-1] & np.isfinite(error)
    met = (np.sign(error[:-1]) * np.sign(error[1:]) <= 0) & np.isfinite(error[:-1] * error[1:])
    for place in range(len(error) - 1):
        if solved[place] and solved[place + 1]:
            if met[place]:
                ends = *softness[place : place + 2], *error[place : place + 2]
                return Best(_root(solve, reference, *ends), Status.SOLVED)
        elif solved[place] and (met[place] or not np.isfinite(error[place + 1])):
            gap = np.flatnonzero(np.isfinite(error[place + 1 :]))
            end = softness[place + 1 + gap[0]] if len(gap) else softness[-1]
            found = _last_root(solve, reference, softness[place], end, error[place])
            if found is not None:
                return Best(found, Status.SOLVED)
    if len(error) == 1 and solved[0] and error[0] == 0:
        return Best(float(stiffness[0]), Status.SOLVED)
    if met.any():
        place = int(np.argmax(met))
        between = f"{1 / softness[place + 1]:.6g} and {1 / softness[place]:.6g} N/m"
        return Best(np.nan, Status.UNSTABLE, f"the curve meets the reference where it is unstable, between {between}")
    known = np.flatnonzero(np.isfinite(error))
    across = [pair for pair in zip(known[:-1], known[1:]) if error[pair[0]] * error[pair[1]] <= 0]
    if not len(known) or across or len(known) < len(error) and known[-1] < len(error) - 1:
        first, last = across[0] if across else (known[-1] if len(known) else 0, len(error) - 1)
        between = f"between {1 / softness[last]:.6g} and {1 / softness[first]:.6g} N/m"
        return Best(np.nan, Status.NOT_CONVERGED, f"the curve may meet the reference in its gap {between}")
    between = f"from {stiffness[0]:.6g} to {stiffness[-1]:.6g} N/m"
    return Best(np.nan, Status.FAILED, f"the curve does not meet the reference {between}; widen `sensitivity`")


def _root(solve: Solve, reference: float, first: float, last: float, error_first: float, error_last: float) -> float:
    """Stiffness between two softnesses at which the displacement is the reference's."""
    known = {first: error_first, last: error_last}
    from scipy.optimize import brentq  # here: most jobs that compare look for no best stiffness

    def error(softness: float) -> float:
        return known[softness] if softness in known else solve(1.0 / softness) - reference

    return float(1.0 / brentq(error, first, last, xtol=1e-15 * first, rtol=ROOT_TOLERANCE))


def _last_root(solve: Solve, reference: float, softness: float, unsolved: float, error: float) -> float | None:
    """Stiffness between a softness that has an equilibrium and one that has none; None where there is no root."""
    for _ in range(MOST_BISECTIONS):
        middle = 0.5 * (softness + unsolved)
        there = solve(1.0 / middle) - reference
        if not np.isfinite(there):
            unsolved = middle
        elif there * error <= 0:
            return _root(solve, reference, softness, middle, error, there)
        else:
            softness, error = middle, there
    return None


def unbeaten(errors: np.ndarray, seconds: np.ndarray) -> np.ndarray:
    """Return whether no other case has a smaller error in no more time; False for NaN errors or times."""
    best = np.zeros(errors.shape, dtype=bool)
    for place in map(tuple, np.argwhere(np.isfinite(errors) & np.isfinite(seconds))):
        best[place] = not ((errors < errors[place]) & (seconds <= seconds[place])).any()
    return best
