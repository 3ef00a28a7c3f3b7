"""Text of `springtune predict`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..problem.compare import error_text, sign_sentence, sign_word
from ..problem.geometry import size_text
from ..problem.shapes import QUANTITY_UNITS
from ..safe_io.tables import TabledList, aligned, mesh_size_text

if TYPE_CHECKING:
    from ..prediction.choices import Choice, References, ShapeReferences
    from ..prediction.search import MeshSearch
    from ..problem.geometry import Beam
    from ..problem.materials import Material
    from ..scene.statements import ShapeStatement


@dataclass(frozen=True)
class Subject:
    """A beam under loads, or a shape under a load case, as a prediction names it.

    `name` and `made_of` (material, thickness) are texts, `known` the references by load, of a shape by quantity.
    `compared` has the values and kinds of those that were found, `sign` the meaning of an error's sign.
    """

    name: str
    made_of: str
    known: "References | ShapeReferences"
    compared: dict[str, tuple[float, str]]
    sign: list[str]
    of_beam: bool
    plane_strain: bool = False

    @property
    def estimate(self) -> str:
        """Largest error estimate of the references."""
        estimates = [found.error_estimate for found in self.known.values() if not isinstance(found, str)]
        return f"{100 * max(estimates, default=0):.1g} %"

    @property
    def meaning(self) -> str:
        """What an error is of."""
        what = "the displacement of the loaded side" if self.of_beam else "each quantity"
        return f"Errors are (network - reference) / |reference| of {what}"


def beam_subject(beam: "Beam", material: "Material", known: "References") -> Subject:
    """Beam of a prediction."""
    from ..problem.loads import LOADS

    def constants(one: "Material") -> str:
        young = one.young_modulus
        return f"E = {young / 1e9:.6g} GPa" if young >= 1e9 else f"E = {young / 1e6:.6g} MPa"

    made_of = f"{material.name}, {constants(material)}, nu = {material.poisson_ratio:g}, "
    made_of += f"t = {1e3 * beam.thickness:g} mm"
    strain = material.plane == "strain"
    if strain:
        sheet = material.in_plane
        made_of += f", plane strain: in the plane {constants(sheet)}, nu = {sheet.poisson_ratio:.4g}"
    signs = {load: LOADS[load].sign for load in known}
    compared = {load: (sign, "displacement") for load, sign in signs.items()}
    return Subject(beam.label, made_of, known, compared, [f"Of errors, {sign_sentence(signs)}."], True, strain)


def shape_subject(statement: "ShapeStatement", known: "ShapeReferences") -> Subject:
    """Shape of a prediction."""
    kind = {one.name: one.kind for one in statement.case.quantities}
    compared = {name: (found.value, kind[name]) for name, found in known.items() if not isinstance(found, str)}
    moved = {name: value for name, (value, of) in compared.items() if of == "displacement"}
    of = "errors" if len(moved) == len(compared) else "errors of displacements"
    sign = [f"Of {of}, {sign_sentence(moved, 'of')}."] if moved else []
    sides = np.ptp(statement.mesh.points, axis=0).tolist()
    made_of = f"{size_text(*sides)}, {statement.named_materials}, t = {1e3 * statement.thickness:g} mm"
    return Subject(f"{statement.shape.name}, load {statement.load}", made_of, known, compared, sign, False)


def prediction_text(
    subject: Subject, mesh_name: str, counts: str, choices: "Sequence[Choice]", sizes: Sequence[float] = ()
) -> str:
    """Text of a prediction; `sizes` [m] are of the meshes that bands are extrapolated from."""
    of_beam = subject.of_beam
    heads, *rows = TabledList(choices).table()
    kept = [place for place, head in enumerate(heads) if of_beam or head not in ("E", "nu")]
    rows = [[row[place] for place in kept] for row in (heads, *rows)]
    if subject.plane_strain:
        rows[0] = ["nu in plane" if head == "nu" else head for head in rows[0]]
    notes = [f"{name}: no reference; {found}" for name, found in subject.known.items() if isinstance(found, str)]
    for choice in choices:
        notes += [f"{choice.definition}, {part}: {reason}" for part, reason in choice.failures.items()]
    first, plain = (name or "none" for name in recommended(choices))
    by_rule = recommended([choice for choice in choices if choice.definition != "best-springs"])
    how = "solved on this mesh"
    if sizes:
        low, high = 1e3 * min(sizes), 1e3 * max(sizes)
        mesh_type = mesh_name.partition(" ")[0]
        how = f"bands, extrapolated from solutions on {len(sizes)} {mesh_type} meshes of {low:.3g} to {high:.3g} mm"
    estimate = f" (error estimate {subject.estimate})" if of_beam else ""
    tests = " E, its error, and nu are of a patch test between rollers." if of_beam else ""
    lines = [
        f"{subject.name}, {mesh_name}: {counts}; {subject.made_of}",
        "",
        f"recommended: {first}; with springs alone: {plain}",
        *_at_worst(subject, choices, (first, plain, *map(str, by_rule))),
        "",
        aligned(rows, left=2, right=range(3, 3 + len(subject.known) + 2 * of_beam)),
        "",
        f"{subject.meaning}{': ' if of_beam else ', '}{how},",
        f"{KINEMATICS_TEXT}{estimate}.",
        *subject.sign,
        f"The first row is the best one by its worst error.{tests}",
        *_also_tried(choices),
    ]
    if not of_beam and subject.compared:
        table = [["quantity", "reference", "error estimate"]]
        for name, (value, kind) in subject.compared.items():
            estimate = f"{100 * subject.known[name].error_estimate:.1g} %"  # type: ignore[union-attr]
            table.append([name, f"{value:.6g} {QUANTITY_UNITS[kind]}", estimate])
        lines += ["", aligned(table, left=1, right=(1, 2))]
    return "\n".join([*lines, *([""] if notes and not of_beam else []), *notes])


def search_text(subject: Subject, search: "MeshSearch", springs_alone: bool = False) -> str:
    """Text of a search for a mesh."""
    from ..prediction.search import answer_text, tried_names

    where = "under" if subject.of_beam else "in"
    wanted = f"{100 * search.error:.6g} %"
    lines = [
        f"{subject.name}; {subject.made_of}; an error of at most {wanted} {where} {_listed(search.loads)}",
        "",
        *([] if springs_alone else [f"recommended: {answer_text(search.best)}"]),
        f"with springs alone: {answer_text(search.best_springs)}",
    ]
    notes, steps = [], False
    tables = [] if springs_alone else [("with any definition", search.by_type, False)]
    tables.append(("with springs alone", search.springs_by_type, True))
    for what, found, alone in tables:
        chosen = sorted((one for one in found.values() if one), key=lambda one: (not one.confirmed, one.particles))
        notes += [f"{name}, {what}: {_nearest(search, name, alone)}" for name, one in found.items() if one is None]
        if chosen:
            table = TabledList(chosen).table()
            steps |= "largest step" in table[0]
            lines += ["", f"{what}:", aligned(table, left=2, right=range(3, len(table[0])))]
    answers = [one for _, found, _ in tables for one in found.values()]
    explained = []
    if any(one and not one.confirmed for one in answers):
        few = f"up to {search.most:,} particles these are too few to be sure"
        explained.append(f"* kept on all finer meshes tried, but {few}.")
    if None in answers:
        change = "extrapolated by its change over the last doubling"
        explained.append(f"None: a definition is given up if its error, {change},")
        explained.append(f"is too large at {search.most:,} particles, too.")
    counts, names = [one.particles for one in search.tried], tried_names(search.tried, springs_alone)
    lines += [
        "",
        f"Solved: {len(search.tried)} meshes of {min(counts, default=0):,} to {max(counts, default=0):,} particles.",
        f"Tried: {', '.join(name for name in names if any(one.worst(name) < math.inf for one in search.tried))}.",
        f"A mesh counts if its error and that of all finer meshes tried, up to twice as fine, stay below {wanted},",
        "with a margin: the last change may happen once more. Sizes between whole divisions are tried, too.",
        "Meshes are ranked by their particles.",
        f"{subject.meaning}, solved on each mesh,",
        f"{KINEMATICS_TEXT} (error estimate {subject.estimate}).",
        *subject.sign,
        "Static solve: of one load with its network assembled and factorized, measured here once.",
    ]
    lines += ["Largest step: of undamped explicit integrators, about rest, held nowhere."] if steps else []
    return "\n".join([*lines, *explained, *notes])


def recommended(choices: "Sequence[Choice]") -> tuple[str | None, str | None]:
    """The best definition, and the best with springs alone; None if there is none."""
    solved = [choice for choice in choices if choice.worst < math.inf]
    plain = [choice for choice in solved if not choice.energies]
    return (solved[0].definition if solved else None), (plain[0].definition if plain else None)


KINEMATICS_TEXT = "with linear kinematics (small strain), against the converged reference of small strain"
"""Kinematics and reference of the errors."""


def _at_worst(subject: Subject, choices: "Sequence[Choice]", names: Sequence[str]) -> list[str]:
    """Line with the largest error of each recommended definition, its part and what its sign means."""
    texts = []
    for choice in choices:
        if choice.definition in names:
            bounds = ((error, name) for name, value in choice.errors.items() for error in np.ravel(value))
            worst, name = max((one for one in bounds if one[0] == one[0]), key=lambda one: abs(one[0]))
            word = sign_word(worst, *subject.compared[name])
            texts.append(f"{choice.definition} {error_text(worst)} ({name}{word and ', '}{word})")
    return [f"at worst: {', '.join(texts)}"] if texts else []


def _also_tried(choices: "Sequence[Choice]") -> list[str]:
    """Line with the definitions that were tried and have no row, and with those that were not."""
    from ..springs.base import DEFINITIONS

    if not choices:
        return []
    rows, tried = [choice.definition for choice in choices], choices[0].tried
    slow = [name for name, one in DEFINITIONS.items() if one.cost > 1 and not one.needs and name not in (*tried, *rows)]
    left = f"; not tried, since they search for seconds: {', '.join(slow)}" if slow else ""
    return [f"Also tried: {', '.join(name for name in tried if name not in rows) or 'none'}{left}."]


def _listed(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if words[1:] else words)


def _nearest(search: "MeshSearch", mesh_type: str, springs_alone: bool) -> str:
    """Reason why no mesh was found, and the nearest one."""
    from ..prediction.search import tried_names

    tried = [one for one in search.tried if one.mesh_type == mesh_type]
    allowed = tried_names(tried, springs_alone)
    near = [
        (round(one.worst(name), 9), name in one.energies, one.particles, name, one.size)
        for one in tried
        for name in one.errors
        if name in allowed
    ]
    worst, _, particles, name, size = min(near, default=(math.inf, False, 0, "", 0.0))
    if worst == math.inf:
        return f"none; of at most {search.most:,} particles there is no mesh, or no network on it is stable"
    none = f"none up to {max(count for _, _, count, *_ in near):,} particles;"
    where, off = f"{name} at {mesh_size_text(size)} ({particles:,} particles)", f"{100 * worst:.3g} % off at worst"
    if worst <= search.error:
        return f"{none} {where} keeps it, {off}, but finer ones do not"
    return f"{none} nearest is {where}, {off}"
