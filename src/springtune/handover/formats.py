"""Files of nets: CSV; JSON, which gives back what was written, number by number; VTU; and models that run."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..mesh.formats import MOST_MESSAGE_CHARACTERS
from ..safe_io import check_folder, json_line, replacing, shown, write_text
from ..scene.single import Scene
from ..springs.base import Springs
from .mujoco import mjcf
from .net import NOT_COMPUTED, SpringNet
from .newton import newton_script
from .paraview import write_vtu
from .simulation import CORNER_VALUES, VALUES, Net, Terms
from .sofa import sofa_python
from .xpbd import xpbd


class Array(NamedTuple):
    """An array of a net: type, heads of its columns in a table, and the array that it has a row for each of."""

    dtype: type
    heads: tuple[str, ...]
    of: str = ""


ARRAYS = {
    "points": Array(float, ("x [m]", "y [m]")),
    "masses": Array(float, ("mass [kg]",), of="points"),
    "held": Array(bool, ("held_x", "held_y"), of="points"),
    "forces": Array(float, ("force_x [N]", "force_y [N]"), of="points"),
    "springs": Array(np.int64, ("first", "second")),
    "rest_lengths": Array(float, ("rest_length [m]",), of="springs"),
    "stiffness": Array(float, ("stiffness [N/m]",), of="springs"),
    "triangles": Array(np.int64, ("a", "b", "c")),
    "quads": Array(np.int64, ("a", "b", "c", "d")),
}
"""Arrays of a net."""

CELL_ARRAYS = {3: "triangles", 4: "quads"}  # arrays that cells stand in, by their corners


def write(path: str | Path, net: Net) -> list[Path]:
    """Write a net in the format of a name's ending; files appear whole or not at all."""
    path, ending = Path(path), check_target(path)
    net = replace(net, header=net.header | {"thickness": float(net.thickness)})
    if ending in NET_FORMATS:
        return NET_FORMATS[ending](path, net)
    program, text = SIMULATORS[ending]
    calibrated = net.header.get("calibrated")
    if calibrated and ending != (own := SETTING_ENDINGS.get(calibrated["engine"])):
        kept = " or ".join(filter(None, [own, ".csv, .json or .vtu"]))
        made_for = f"the stiffness is for {calibrated['engine']} at {calibrated['setting']}"
        raise ValueError(f"{path}: runs {program} at a step of its own, and {made_for}; give a name ending in {kept}")
    write_text(path, text(net))
    return [path]


def read(path: str | Path) -> Net:
    """Read a net from JSON."""
    path = Path(path)
    if ending_of(path) != ".json":
        raise ValueError(f"{path}: only nets that are written as .json are read; write the springs so")
    if not path.is_file():
        raise ValueError(f"{path}: there is no such file; give one that was written by springtune")
    try:
        return _checked(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        reason = " ".join(str(error).split())[:MOST_MESSAGE_CHARACTERS] or type(error).__name__
        raise ValueError(f"{path}: is damaged, or no net of springtune ({reason}); write it again") from None


def _checked(found: dict[str, Any]) -> Net:
    """Net of a file's content, whose arrays fit each other."""
    rows, arrays = dict[str, int](), dict[str, Any](masses=None)
    for name, about in ARRAYS.items():
        if found[name] is None and name == "masses":
            continue
        row = (len(about.heads),) if len(about.heads) > 1 else ()
        array: np.ndarray = np.array(found[name], dtype=about.dtype).reshape(-1, *row)
        arrays[name] = array
        if len(array) != rows.setdefault(about.of or name, len(array)):
            raise ValueError(f"{name} of {len(array)} rows in the place of {rows[about.of]}")
        if about.dtype is np.int64 and array.size and not (0 <= array.min() and array.max() < rows["points"]):
            raise ValueError(f"{name} of particles that it does not have")
    energies = [
        Terms(one["kind"], arrays[one["cells"]], {name: np.array(one["values"][name]) for name in VALUES[one["kind"]]})
        for one in found["energies"]
    ]
    if any(values.shape[:1] != (len(terms.cells),) for terms in energies for values in terms.values.values()):
        raise ValueError("its terms are not as many as cells")
    numbers = [arrays[name] for name, about in ARRAYS.items() if about.dtype is float and arrays[name] is not None]
    numbers += [values for terms in energies for values in terms.values.values()]
    if not all(np.isfinite(array).all() for array in numbers):
        raise ValueError("some of its numbers are not finite")
    header = found["header"]
    return Net(**arrays, energies=tuple(energies), thickness=float(header["thickness"]), header=header)


def arrays_of(net: Net) -> dict[str, np.ndarray]:
    """Arrays that a net has, by the names of `ARRAYS`."""
    return {name: getattr(net, name) for name in ARRAYS if getattr(net, name) is not None}


def _by_corners(energies: Iterable[Terms]) -> dict[int, dict[str, np.ndarray]]:
    """Columns of all terms by the corners of their cells: ``area_modulus``; ``angle_rest_angle``, one a corner."""
    found: dict[int, dict[str, np.ndarray]] = {}
    for terms in energies:
        columns = {f"{terms.kind}_{name}": values for name, values in terms.values.items()}
        found.setdefault(terms.cells.shape[1], {}).update(columns)
    return found


# -- CSV -----------------------------------------------------------------------------------------------------------


Heads = dict[str, Sequence[str]]  # heads of the columns of arrays in a table


def _of_arrays(*names: str) -> Heads:
    return {name: ARRAYS[name].heads for name in names}


def _of_terms(corners: int) -> Heads:
    """Heads of all values of terms, one for each corner where corners have their own."""
    ends = {False: [""], True: [f"_{corner}" for corner in "abcd"[:corners]]}
    return {
        f"{kind}_{name}": [f"{kind}_{name}{end} [{unit}]" for end in ends[name in CORNER_VALUES]]
        for kind, units in VALUES.items()
        for name, unit in units.items()
    }


TABLES = {
    "": _of_arrays("springs", "rest_lengths", "stiffness"),
    "particles": _of_arrays("points", "masses", "held", "forces"),
    "triangles": _of_arrays("triangles") | _of_terms(3),
    "quads": _of_arrays("quads") | _of_terms(4),
}
"""Arrays that stand beside each other in a table."""


def _write_csv(path: Path, net: Net) -> list[Path]:
    arrays, terms = arrays_of(net), _by_corners(net.energies)
    tables_beside = ("particles", *CELL_ARRAYS.values())  # such as net.particles.csv
    others = {name: path.with_name(f"{path.stem}.{name}{path.suffix}") for name in tables_beside}
    texts = {others["particles"]: _csv_text(arrays, TABLES["particles"])}
    for count, name in CELL_ARRAYS.items():
        if len(arrays[name]):
            texts[others[name]] = _csv_text(arrays | terms.get(count, {}), TABLES[name])
    comments = [f"# springs of a network; particles are counted from 0, and stand in {shown(others['particles'].name)}"]
    comments += [
        f"# cells of {count} corners, and what energies they have, stand in {shown(others[name].name)}"
        for count, name in CELL_ARRAYS.items()
        if others[name] in texts
    ]
    comments += [f"# {json_line(line)}" for line in json.dumps(net.header, indent=1, ensure_ascii=False).split("\n")]
    texts[path] = "\n".join([*comments, ""]) + _csv_text(arrays, TABLES[""])
    with ExitStack() as unfinished:  # the last one gets its name first: if that fails, none gets one
        for one, text in texts.items():
            unfinished.enter_context(replacing(one)).write_text(text, encoding="utf-8")
    for other in set(others.values()) - set(texts):
        other.unlink(missing_ok=True)  # left by another net
    *tables, _ = texts
    return [path, *tables]


def _csv_text(arrays: Mapping[str, np.ndarray], heads: Heads) -> str:
    """Table of some arrays."""
    import pandas as pd  # here: it takes half a second

    columns = []
    for name, titles in heads.items():
        if name in arrays:
            values = arrays[name].astype(int) if arrays[name].dtype == bool else arrays[name]
            columns.append(pd.DataFrame(values.reshape(len(values), -1), columns=[*titles]))
    return str(pd.concat(columns, axis=1).to_csv(index=False, lineterminator="\n"))


# -- JSON ----------------------------------------------------------------------------------------------------------


def _write_json(path: Path, net: Net) -> list[Path]:
    content = {
        "header": net.header,
        **dict.fromkeys(ARRAYS),
        **{name: array.tolist() for name, array in arrays_of(net).items()},
        "energies": [
            {
                "kind": terms.kind,
                "formula": terms.formula,
                "cells": CELL_ARRAYS[terms.cells.shape[1]],
                "units": terms.units,
                "values": {name: values.tolist() for name, values in terms.values.items()},
            }
            for terms in net.energies
        ],
    }
    parts = [f" {json.dumps(key)}: {json.dumps(value)}" for key, value in content.items()]
    write_text(path, "{\n" + ",\n".join(parts) + "\n}\n")
    return [path]


# -- VTU -----------------------------------------------------------------------------------------------------------

POINT_NAMES = {"masses": "mass", "held": "held", "forces": "load"}
LINE_NAMES = {"rest_lengths": "rest_length", "stiffness": "stiffness"}  # names of arrays in ParaView


def write_vtu_with(
    path: str | Path,
    net: Net,
    of_particles: Mapping[str, np.ndarray] | None = None,
    of_springs: Mapping[str, np.ndarray] | None = None,
    numbers: Mapping[str, float] | None = None,
) -> list[Path]:
    """Write a net for ParaView, with more data of its particles, (n_points,) or (n_points, 2), and of its springs."""
    arrays = arrays_of(net)
    data = {new: arrays[old] for old, new in POINT_NAMES.items() if old in arrays}
    data["held"] = data["held"].astype(np.int8)
    cell_data = {new: {2: arrays[old]} for old, new in LINE_NAMES.items()}
    cell_data |= {name: {2: values} for name, values in (of_springs or {}).items()}
    for count, columns in _by_corners(net.energies).items():
        for name, values in columns.items():
            cell_data.setdefault(name, {})[count] = values
    write_vtu(
        path,
        arrays["points"],
        {2: arrays["springs"], 3: arrays["triangles"], 4: arrays["quads"]},
        data | dict(of_particles or {}),
        cell_data,
        {"thickness": net.header["thickness"]} | dict(numbers or {}),
        json.dumps(net.header, indent=1),
    )
    return [Path(path)]


# -- formats -------------------------------------------------------------------------------------------------------


NET_FORMATS = {".csv": _write_csv, ".json": _write_json, ".vtu": write_vtu_with}
"""Functions that write a net, by the ending of the name of its file."""

MUJOCO_ENDINGS = (".xml", ".mjcf")  # endings of files for MuJoCo

SIMULATORS: dict[str, tuple[str, Callable[[Net], str]]] = {
    **dict.fromkeys(MUJOCO_ENDINGS, ("MuJoCo", mjcf)),
    ".py": ("SOFA", sofa_python),
    ".xpbd.json": ("XPBD", xpbd),
    ".newton.py": ("Newton", newton_script),
}
"""Programs, and the text of a net for them, by the ending of the name of its file."""

SETTING_ENDINGS = {"newton-vbd": ".newton.py", "xpbd": ".xpbd.json"}
"""Endings of files that run a calibrated stiffness at the setting that it is for, by engine."""


def check_target(path: str | Path) -> str:
    """Return the ending of a file to write; refuse an unknown format or a missing folder."""
    ending = ending_of(path)
    check_folder(path)
    return ending


def ending_of(path: str | Path) -> str:
    """Return the ending of a file of springs; refuse an unknown format."""
    path = Path(path)
    known = {**NET_FORMATS, **SIMULATORS}
    # The longest ending that fits: .xpbd.json is not .json.
    ending = max((one for one in known if path.name.lower().endswith(one)), key=len, default="")
    if not ending:
        raise ValueError(f"{path}: '{path.suffix}' is no format of springs; give a name ending in {', '.join(known)}")
    if path.name.lower() == ending:
        raise ValueError(f"'{path}' is an ending alone; give a name before it, such as net{ending}")
    return ending


# -- scenes --------------------------------------------------------------------------------------------------------


def write_springs(path: str | Path, scene: Scene, springs: Springs, **options: Any) -> list[Path]:
    """Write springs of a scene, see `springtune.handover.net.SpringNet.write`."""
    check_target(path)
    return SpringNet.from_scene(scene, springs=springs, **options).write(path)


def write_displaced(path: str | Path, scene: Scene, displacements: np.ndarray, compared: bool) -> list[Path]:
    """Write a network at some displacements [m] for ParaView, with the reference's where they are compared."""
    from ..reference.small_strain import ReferenceNotConvergedError  # here: finite elements are slow to import

    path = Path(path)
    if path.suffix.lower() != ".vtu":
        raise ValueError(f"{path}: '{path.suffix}' is no format of displacements; give a name ending in .vtu")
    check_folder(path)
    net = SpringNet.from_scene(scene, errors=False)
    of_particles = {"displacement": displacements}
    if compared:
        try:
            reference = scene.reference().at(scene.mesh.points)
        except ReferenceNotConvergedError as error:
            net.header["reference"] = f"{NOT_COMPUTED}: {error}"
        else:
            of_particles |= {"reference_displacement": reference, "error": displacements - reference}
            strain = "finite" if scene.finite_strain and not scene.objection else "small"
            net.header["reference"] = scene.objection or f"finite elements, {strain} strain, converged"
    forces = scene.springs.reference * scene.network.spring_forces_over_k(displacements, scene.kinematics == "linear")
    numbers = {"displacement_of_the_load": scene.displacement_of(displacements)}
    return write_vtu_with(path, net, of_particles, {"force": forces}, numbers)
