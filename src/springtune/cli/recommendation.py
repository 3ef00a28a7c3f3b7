"""Texts of `springtune predict` and `springtune springs`."""

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..problem.compare import error_text, sign_sentence, sign_word
from ..problem.shapes import QUANTITY_UNITS, size_text
from ..safe_io import TabledList, aligned, mesh_size_text

if TYPE_CHECKING:
    from ..engines.calibration import EngineFit
    from ..handover.net import SpringNet
    from ..prediction.choices import Choice
    from ..prediction.search import MeshSearch
    from ..problem.materials import Material
    from ..problem.shapes import Beam
    from ..scene.boundary_problem import ShapeProblem


class Subject(NamedTuple):
    """A beam under loads, or a shape under a load case; `known` has references by load or quantity."""

    name: str
    made_of: str
    known: Any
    compared: dict[str, tuple[float, str]]
    of_beam: bool

    def meaning(self, solved: str) -> list[str]:
        """Lines that define the errors."""
        what = "the displacement of the loaded side" if self.of_beam else "each quantity"
        found = [self.known[name].error_estimate for name in self.compared]
        moved = {name: value for name, (value, kind) in self.compared.items() if kind == "displacement"}
        of = "errors" if len(moved) == len(self.compared) else "errors of displacements"
        return [
            f"Errors are (network - reference) / |reference| of {what}: {solved},",
            "with linear kinematics (small strain), against the converged reference of small strain (error estimate "
            f"{100 * max(found, default=0):.1g} %).",
            *([f"Of {of}, {sign_sentence(moved, 'under' if self.of_beam else 'of')}."] if moved else []),
        ]


def beam_subject(beam: "Beam", material: "Material", known: Any) -> Subject:
    """Beam of a prediction."""
    from ..problem.loads import LOADS

    def constants(one: "Material") -> str:
        size, unit = (1e9, "GPa") if one.young_modulus >= 1e9 else (1e6, "MPa")
        return f"E = {one.young_modulus / size:.6g} {unit}, nu = {one.poisson_ratio:.4g}"

    made_of = f"{material.name}, {constants(material)}, t = {1e3 * beam.thickness:g} mm"
    if material.plane == "strain":
        made_of += f", plane strain: in the plane {constants(material.in_plane)}"
    compared = {load: (LOADS[load].sign, "displacement") for load, one in known.items() if not isinstance(one, str)}
    return Subject(beam.label, made_of, known, compared, True)


def shape_subject(problem: "ShapeProblem", known: Any) -> Subject:
    """Shape of a prediction."""
    kinds = {one.name: one.kind for one in problem.case.quantities}
    compared = {name: (one.value, kinds[name]) for name, one in known.items() if not isinstance(one, str)}
    sides = np.ptp(problem.mesh.points, axis=0).tolist()
    made_of = f"{size_text(*sides)}, {problem.named_materials}, t = {1e3 * problem.thickness:g} mm"
    return Subject(f"{problem.shape.name}, load {problem.load}", made_of, known, compared, False)


def prediction_text(subject: Subject, mesh_name: str, counts: str, choices: "Sequence[Choice]") -> str:
    """Text of a prediction."""
    rows = TabledList(choices).table()
    best = {one.definition: one for one in recommended(choices) if one}
    first, plain = (one.definition if one else "none" for one in recommended(choices))
    lines = [
        f"{subject.name}, {mesh_name}: {counts}; {subject.made_of}",
        "",
        f"recommended: {first}; with springs alone: {plain}",
        *(f"type for {name}: {_stiffness(one)}" for name, one in best.items()),
        *([f"at worst: {', '.join(_worst(subject, one) for one in best.values())}"] if best else []),
        "",
        aligned(rows, left=2, right=range(3, len(rows[0]) - 1)),
        "",
        *subject.meaning("solved on this mesh"),
        "The first row is the best one by its worst error."
        + (" E, its error, and nu are of a patch test between rollers, in the plane." if subject.of_beam else ""),
        *_also_tried(choices),
    ]
    if not subject.of_beam and subject.compared:
        table = [
            (name, f"{value:.6g} {QUANTITY_UNITS[kind]}", f"{100 * subject.known[name].error_estimate:.1g} %")
            for name, (value, kind) in subject.compared.items()
        ]
        lines += ["", aligned([("quantity", "reference", "error estimate"), *table], left=1, right=(1, 2))]
    lines += [f"{name}: no reference; {found}" for name, found in subject.known.items() if isinstance(found, str)]
    return "\n".join(
        [*lines, *(f"{one.definition}, {part}: {why}" for one in choices for part, why in one.failures.items())]
    )


def recommended(choices: "Sequence[Choice]") -> "tuple[Choice | None, Choice | None]":
    """Best choice, and best choice with springs alone, or None."""
    solved = [choice for choice in choices if choice.worst < math.inf]
    return next(iter(solved), None), next((choice for choice in solved if not choice.energies), None)


def _stiffness(choice: "Choice") -> str:
    """Text on the stiffness of a choice."""
    if math.isnan(choice.inside):
        return "one for each spring, see --write"
    besides = "" if choice.extra == "none" else f", {choice.extra.replace('; ', ', ')}"
    return f"{choice.inside:.5g} N/m inside, {choice.outline:.5g} N/m on the outline{besides}"


def _worst(subject: Subject, choice: "Choice") -> str:
    """Text on the largest error of a choice: its load or quantity, too soft or too stiff."""
    bounds = [(error, name) for name, error in choice.errors.items() if error == error]
    worst, name = max(bounds, key=lambda one: abs(one[0]))
    words = [name, sign_word(worst, *subject.compared[name])]
    return f"{choice.definition} {error_text(worst)} ({', '.join(filter(None, words))})"


def _also_tried(choices: "Sequence[Choice]") -> list[str]:
    """Line with the definitions that were tried and have no row, and with those that were not."""
    from ..springs.base import DEFINITIONS

    rows = [choice.definition for choice in choices]
    tried = choices[0].tried if choices else ()
    slow = [name for name, one in DEFINITIONS.items() if one.cost > 1 and not one.needs and name not in (*tried, *rows)]
    left = f"; not tried, since they search for seconds: {', '.join(slow)}" if slow else ""
    return [f"Also tried: {', '.join(name for name in tried if name not in rows) or 'none'}{left}."] if tried else []


def search_text(subject: Subject, search: "MeshSearch", springs_alone: bool = False) -> str:
    """Text of a search for a mesh."""
    from ..prediction.search import answer_text, tried_names

    limit, where = f"{100 * search.error:.6g} %", "under" if subject.of_beam else "in"
    *loads, last = search.loads
    named = f"{', '.join(loads)} and {last}" if loads else last
    parts = {} if springs_alone else {"with any definition": (search.best, search.by_type)}
    parts["with springs alone"] = search.best_springs, search.springs_by_type
    lines = [f"{subject.name}; {subject.made_of}; an error of at most {limit} {where} {named}", ""]
    for what, (one, _) in parts.items():
        lines.append(f"{what.replace('with any definition', 'recommended')}: {answer_text(one)}")
    notes: dict[str, None] = {}
    for what, (_, found) in parts.items():
        chosen = sorted((one for one in found.values() if one), key=lambda one: one.particles)
        if chosen:
            table = TabledList(chosen).table()
            lines += ["", f"{what}:", aligned(table, left=2, right=range(3, len(table[0])))]
        for name in [name for name, one in found.items() if one is None]:
            notes[f"{name}, {what}: {_nearest(search, name, what == 'with springs alone')}"] = None
    counts, names = [one.particles for one in search.tried], tried_names(search.tried, springs_alone)
    lines += [
        "",
        f"Solved: {len(search.tried)} meshes of {min(counts, default=0):,} to {max(counts, default=0):,} particles.",
        f"Tried: {', '.join(name for name in names if any(one.worst(name) < math.inf for one in search.tried))}.",
        f"A mesh counts if its error and that of all finer meshes tried, up to twice as fine, stay below {limit},",
        "also if they change once more by as much as over the last refinement.",
        "Sizes between whole divisions are tried, too.",
        *subject.meaning("solved on each mesh"),
        "A definition is dropped if its error, at the rate of the last doubling, stays too large on finer meshes.",
        "Meshes are ranked by their particles. Largest step: of undamped explicit integrators, about rest, free of",
        "supports; it needs a density.",
    ]
    return "\n".join([*lines, *notes])


def _nearest(search: "MeshSearch", mesh_type: str, springs_alone: bool) -> str:
    """Text on why no mesh keeps the error, with the nearest mesh."""
    from ..prediction.search import tried_names

    tried = [one for one in search.tried if one.mesh_type == mesh_type]
    on = [(one, name) for one in tried for name in tried_names(tried, springs_alone) if name in one.errors]
    near = [(round(one.worst(name), 9), one.particles, name, one.size) for one, name in on]
    worst, particles, name, size = min(near, default=(math.inf, 0, "", 0.0))
    if worst == math.inf:
        return f"none; of at most {search.most:,} particles there is no mesh, or no network on it is stable"
    further = "; finer ones do not confirm it" if worst <= search.error else ""
    nearest = f"{name} at {mesh_size_text(size)} ({particles:,} particles), {100 * worst:.3g} % off at worst"
    return f"none up to {max(count for _, count, *_ in near):,} particles; nearest is {nearest}{further}"


def fit_text(fit: "EngineFit", mesh_name: str, tried: Sequence[str] = ()) -> str:
    """Text of a calibration with the definitions that were `tried`; its end has the numbers to type."""
    from ..engines.calibration import MOST_SPREAD

    about, mesh = fit.scene.boundary_problem, fit.scene.mesh
    lines = [
        f"{about.body}, {mesh_name}: {len(mesh.points)} particles, {len(mesh.edges)} springs; "
        f"{about.named_materials}; {about.label}; definition {fit.scene.definition.name}",
        aligned(fit._table(), left=2),
    ]
    off = [one.load for one in fit.bands[1:] if abs(one.error - one.definition_error) > MOST_SPREAD / 2]
    if fit.bands:
        others = "" if len(fit.bands) == 1 else "; other loads give finite elements the same displacement"
        lines += ["", f"errors at parts of each load{others}:", aligned(fit.bands.table(), left=2)]
        if off:
            where = f"under {fit.scene.load}, but not under {', '.join(off)}"
            lines.append(f"The solver has not converged; the factor makes up for it {where}.")
    if fit.needed:
        what = f"under {fit.scene.load}, solver error below 1 % without a factor:"
        lines += ["", what, aligned(fit.needed.table(), left=2)]
    lines += ["", f"Tried: {', '.join(tried)}."] if tried else []
    return "\n".join([*lines, "", *_to_type(fit, bool(off))])


def _to_type(fit: "EngineFit", too_narrow: bool) -> Iterator[str]:
    """Lines with the numbers to type: with the factor, and if it is `too_narrow` or missing, without one."""
    from ..engines.calibration import CONVERGED_ERROR, typed_text
    from ..engines.run import error_words

    if found := fit.factor == fit.factor:
        yield f"type at {fit.result.setting}, for {fit.scene.load}: {typed_text(fit.typed_rows())}"
    best = min(fit.needed, key=lambda one: (not one.found, one.frame_seconds if one.found else abs(one.solver_error)))
    if best.found and (too_narrow or not found):
        yield f"type at {best.setting}, without a factor: {best.typed}"
    elif not found:
        yield f"no setting that was tried has a solver error below {100 * CONVERGED_ERROR:g} %; the nearest one:"
        yield f"type at {best.setting}, {error_words(best.solver_error)} by its solver: {best.typed}"


def written_text(net: "SpringNet", written: Iterable[Path]) -> str:
    """Written files and their expected errors, as text."""
    from ..handover.formats import MUJOCO_ENDINGS, ending_of
    from ..handover.mujoco import for_versions

    header, (first, *others) = net.header, written
    springs = f"{len(net.springs)} springs" if net.stiffness.any() else f"{len(net.springs)} edges with no own springs"
    extent = [] if header["beam"] else [size_text(*np.ptp(net.points, axis=0).tolist())]
    besides = [f"{terms.kind} terms of {len(terms.cells)} cells" for terms in net.energies]
    counts = [*extent, f"{len(net.points)} particles", springs, *besides]
    lines = [f"{first}: {', '.join(counts)} of definition {header['definition']}"]
    lines += [f"beside it: {', '.join(map(str, others))}"] if others else []
    lines += [for_versions(net.energies)] if ending_of(first) in MUJOCO_ENDINGS else []
    errors, what = header["expected_error"], "error of the displacement" if header["beam"] else "errors"
    if isinstance(errors, dict):
        known = [f"{load} {100 * error:+.3g} %" for load, error in errors.items() if isinstance(error, float)]
        lines += [f"{what}, solved on this mesh: {', '.join(known)}"] if known else []
        lines += [f"{load}: {why}" for load, why in errors.items() if isinstance(why, str)]
    else:
        lines.append(f"{what}: {errors}")
    if isinstance(steps := header["largest_stable_step"], dict):
        step = min(step for step in steps.values() if isinstance(step, float))
        lines.append(f"largest stable step of explicit integrators, undamped: {step:.4g} s")
    return "\n".join(lines)
