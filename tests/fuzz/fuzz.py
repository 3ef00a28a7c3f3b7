"""Feed studies and mesh files that are spoiled: ``python tests/fuzz/fuzz.py [INPUTS] [SEED]``.

Each input is refused with a message, or accepted and then right: no traceback, no crash, no 10 s, no 1 GB.
The same seed and number make the same input again.
"""

import contextlib
import copy
import faulthandler
import io
import os
import re
import resource
import shutil
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from random import Random

import meshio
import numpy as np
import yaml

import springtune as st
from springtune.mechanics.continuum import PatchTest
from springtune.mesh.cells import corner_angles, signed_areas
from springtune.mesh.formats import read_beam_mesh, read_shape, write_mesh
from springtune.mesh.sheets import sheet_fault
from springtune.problem.shapes import AssumptionWarning
from springtune.studies.config.model import kinds
from springtune.studies.kinds.bodies.kind import summary

SECONDS, BYTES = 10, 1_000_000_000
"""Of the processor and of memory, for one input."""

BATCH = 100
"""Inputs of a process."""

CONFIG = Path(__file__).parents[2] / "config"
STUDIES = ("quick", "paper", "block", "laying", "stability")
BOX = 0.1, 0.02
"""Beam of the mesh files [m]."""

FORMATS = [("vtu", "vtu"), ("msh", "gmsh"), ("msh", "gmsh22"), ("inp", "abaqus"), ("med", "med")]
"""Endings, and meshio's name of the format."""

WORDS = (
    """
nan inf -inf -1 0 1e400 1e-400 1e9 ~ null true no * &a !!set {{ [ | ../../etc /dev/null 0x10 1_000 2001-99-99 <<
= % @ structured free traction core NSET 4294967295 0.05 < 9999999999999999999999999999 é \u202e
""".split()
    + ["", " ", "\t", "\n", "x" * 300, "1e-9 mm", "1e9 mm", "5 mm", "5 m m", "5 mm^9^9", "200 GPa", "1 kN"]
)
"""Values that are seldom meant."""

COUNTS = (4_000_000_000, 100_000_000, 2**62, 10**6)
"""Counts that no file of some kilobytes has."""


class Refused(Exception):
    """An input that is refused, with the message that its user reads."""


# -- ways to spoil -----------------------------------------------------------------------------------------------------


def spoil_bytes(random, content):
    """Bytes, some of them changed, cut out, doubled, or with words among them."""
    content = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 8))):
        at, length = random.randrange(len(content) + 1), random.choice((1, 2, 4, 16, 300))
        piece, word = bytes(content[at : at + length]), random.choice(WORDS).encode()
        new = random.choice((random.randbytes(length), b"", bytes(length), piece * random.choice((2, 40)), word))
        content[at : at + random.choice((0, length))] = new
    return bytes(content if random.random() < 0.9 else content[: random.randrange(len(content) + 1)])


def spoil_counts(random, content):
    """Bytes with a whole number of the text, or 4 or 8 of the bytes, in place of a count that cannot be."""
    count = random.choice(COUNTS)
    numbers = list(re.finditer(rb"(?<![\w.+-])\d+(?![\w.])", content))
    if numbers and (b"\0" not in content or random.random() < 0.3):
        found = random.choice(numbers)
        return content[: found.start()] + str(count).encode() + content[found.end() :]
    form = random.choice(("<Q", "<I", ">Q", ">I"))
    new = struct.pack(form, count % 2 ** (64 if form[1] == "Q" else 32))
    at = random.randrange(max(1, len(content) - len(new)))
    return content[:at] + new + content[at + len(new) :]


def places(tree):
    """All that a tree holds: its holder, key and value."""
    for key, value in list(tree.items() if isinstance(tree, dict) else enumerate(tree)):
        yield tree, key, value
        if isinstance(value, dict | list):
            yield from places(value)


def spoil_tree(random, tree):
    """Tree of dicts, lists and texts with some of what it holds taken out, doubled, swapped or replaced."""
    tree = copy.deepcopy(tree)
    for _ in range(random.choice((1, 2, 4))):
        held, word = list(places(tree)), random.choice(WORDS)
        if not 0 < len(held) < 40_000:
            break
        holder, key, value = random.choice(held)
        deep = value
        for _ in range(random.choice((5, 40, 200))):
            deep = [deep]
        many = [f"{1 + number / 1000:g} mm" for number in range(random.choice((3, 300, 30000)))]
        other = copy.deepcopy(random.choice(held)[2])
        new = random.choice((word, None, [value] * random.choice((0, 2, 30)), {word: value}, other, many, deep))
        if random.random() < 0.15:
            del holder[key]
        else:
            holder[key] = new
    return tree


# -- what is fed -------------------------------------------------------------------------------------------------------


@cache
def studies():
    return [(CONFIG / f"{name}.yaml").read_bytes() for name in STUDIES]


def written(content, folder):
    """Path of a study, beside the table that it names."""
    shutil.copy(CONFIG / "paper_tables.csv", folder)
    path = folder / "study.yaml"
    path.write_bytes(content)
    return path


def study_bytes(random, folder):
    return written(spoil_bytes(random, random.choice(studies())), folder)


def study_trees(random, folder):
    if random.random() < 0.05:  # aliases of aliases
        lines = [f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}, *a{n - 1}]" for n in range(1, random.randrange(3, 30))]
        return written("\n".join(["title: aliases", "a0: &a0 [x, y]", *lines]).encode(), folder)
    tree = spoil_tree(random, yaml.load(random.choice(studies()), Loader=yaml.BaseLoader))
    try:
        return written(yaml.dump(tree, allow_unicode=True, Dumper=yaml.CSafeDumper).encode(), folder)
    except RecursionError:  # deeper than can be written that way
        return written(b"title: " + 400 * b"[" + 400 * b"]", folder)


def read_study(path):
    try:
        study = st.load_study(path)
    except st.StudyError as error:
        raise Refused(str(error)) from None
    if len(study.scenes) <= 2_000:
        parts = [(kind, study.parts[kind.name]) for kind in kinds()]
        summary(study, [row for kind, part in parts if part for row in kind.summary(part)])


@cache
def files():
    """Endings and contents of good files: of a beam, and of a shape with groups."""
    hole = st.Hole.circle((0.05, 0.01), 0.004, part="core")
    grouped = st.mesh_shape(st.Shape.rectangle(*BOX, holes=[hole], points={"tip": (0.1, 0.013)}), 8e-3)
    points = {side: np.unique(edges) for side, edges in grouped.sides.items()}
    cells = {"core": [np.flatnonzero(grouped.parts["core"][3])]}
    blocks = [("triangle", grouped.mesh.triangles)]
    found = []
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        for number, (ending, name) in enumerate(FORMATS):
            mesh = st.MESH_TYPES["braced" if number % 2 else "free"](*BOX, 5e-3)
            kind, corners = ("quad", mesh.quads) if len(mesh.quads) else ("triangle", mesh.triangles)
            path = Path(folder) / f"{name}.{ending}"
            flat = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
            meshio.Mesh(flat, [(kind, corners)]).write(path, file_format=name)
        write_mesh(Path(folder) / "shape.vtu", grouped)
        meshio.Mesh(grouped.mesh.points, blocks, point_sets=points, cell_sets=cells).write(Path(folder) / "shape.inp")
        found = [(path.suffix, path.read_bytes()) for path in sorted(Path(folder).iterdir())]
    return found


def spoiled_file(random, folder):
    ending, content = random.choice(files())
    path = folder / f"mesh{ending}"
    path.write_bytes((spoil_counts if random.random() < 0.3 else spoil_bytes)(random, content))
    return path


def read_mesh(path):
    """Read a mesh file; what is accepted fills the beam and has the modulus of its material."""
    try:
        mesh = read_beam_mesh(path, *BOX)
    except st.MeshError as error:
        raise Refused(str(error)) from None
    area = sum(signed_areas(mesh.points, one).sum() for one in mesh.cells.values())
    assert abs(area / (BOX[0] * BOX[1]) - 1) < 1e-6, "is accepted and does not cover its beam"
    # Delingette's network is linear triangles: an even strain is exact on any mesh, whatever its cells.
    if set(mesh.cells) == {3} and corner_angles(mesh.points, mesh.cells[3]).min() > 1e-3:
        springs = st.DEFINITIONS["delingette"].springs(mesh, st.Material(1.0, 0.3), 1.0)
        modulus, ratio = PatchTest(mesh).axial(springs)
        assert abs(modulus * springs.reference - 1) < 1e-6 and abs(ratio - 0.3) < 1e-6, (modulus, ratio)


def read_groups(path):
    """Read a mesh file with groups; what is accepted is a sheet, whose groups are on its outline."""
    try:
        grouped = read_shape(path)
    except st.MeshError as error:
        raise Refused(str(error)) from None
    outline = {tuple(edge) for edge in grouped.mesh.edges[grouped.mesh.on_outline].tolist()}
    assert not sheet_fault(grouped.mesh), "is accepted and no sheet"
    for name, edges in grouped.sides.items():
        assert len(edges) and {tuple(sorted(edge)) for edge in edges.tolist()} <= outline, name
    assert all(";" in why for why in grouped.unusable.values()), f"says no remedy: {grouped.unusable}"


TARGETS = {
    "studies as bytes": (study_bytes, read_study, 36),
    "studies by structure": (study_trees, read_study, 28),
    "mesh files of beams": (spoiled_file, read_mesh, 20),
    "mesh files with groups": (spoiled_file, read_groups, 16),
}
"""How an input is made, how it is read, and how many of a hundred are of this kind."""


# -- the run -----------------------------------------------------------------------------------------------------------


def feed(name, numbers, seed, folder):
    """Outcomes of some inputs of a target, counted, and faults; the file of its first number names the one at work."""
    faulthandler.disable()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)  # meshio says what it leaves out
    make, read, _ = TARGETS[name]
    outcomes, faults = Counter(), []
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + 2 * BYTES, resource.RLIM_INFINITY))
    for number in numbers:
        Path(folder, f"{name} {numbers[0]}").write_text(str(number))
        with tempfile.TemporaryDirectory() as here:
            made = make(Random(f"{name} {seed} {number}"), Path(here))
            begin = time.process_time()
            resource.setrlimit(resource.RLIMIT_CPU, (int(begin) + SECONDS + 2, resource.RLIM_INFINITY))
            outcome, fault = judge(read, made)
        outcomes[outcome] += 1
        seconds = time.process_time() - begin
        fault = fault or (f"takes {seconds:.0f} s" if seconds > SECONDS else "")
        if fault:
            faults.append(f"{name}, input {number} of seed {seed}: {fault}")
    return outcomes, faults


def judge(read, made):
    """What becomes of an input, and what is wrong with that."""
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(None):
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", AssumptionWarning)  # words for people, not a fault
            read(made)
    except Refused as error:
        message = str(error)
        helps = 20 <= len(message) <= 4000 and "Traceback" not in message
        return "refused", "" if helps else f"is refused by a message that helps nobody: {message[:300]!r}"
    except BaseException:
        return "broken", traceback.format_exc(limit=-4)
    return "accepted", ""


def run(names, inputs, seed, processes=2):
    """Counted outcomes of targets, by their shares of a hundred inputs, and the faults."""
    outcomes, faults = {name: Counter() for name in names}, []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            numbers = range(-(-inputs * TARGETS[name][2] // 100))
            batches = [numbers[first : first + BATCH] for first in range(0, len(numbers), BATCH)]
            with ProcessPoolExecutor(processes, get_context("fork")) as pool:
                done = [pool.submit(feed, name, batch, seed, folder) for batch in batches]
                for batch, future in zip(batches, done):
                    try:
                        counted, found = future.result()
                        outcomes[name] += counted
                        faults += found
                    except BrokenProcessPool:  # one of these
                        at = Path(folder, f"{name} {batch[0]}")
                        faults.append(f"{name}, input {at.read_text() if at.exists() else '?'} of seed {seed}: dies")
    return outcomes, faults


def load():
    """Import what processes need, before they are made: each would pay for it else."""
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
        for make, read, _ in TARGETS.values():
            with contextlib.suppress(Exception):
                read(make(Random(0), Path(folder)))


def main(inputs=20_000, seed=1):
    load()
    outcomes, faults = run(list(TARGETS), int(inputs), int(seed))
    for name, counted in outcomes.items():
        print(f"{name}: " + ", ".join(f"{count} {word}" for word, count in sorted(counted.items())))
    print(*faults, f"{sum(map(Counter.total, outcomes.values()))} inputs, seed {seed}; {len(faults)} faults", sep="\n")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
