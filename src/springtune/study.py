"""Studies: what a config file asks for, validated, named, free of duplicates and in a canonical order.

`load_study` reads a YAML file. `StudyConfig` and the models it is made of say what the file may hold; the JSON schema
for editors and the tables of config/README.md are generated from them (`springtune schema --write`).
"""

import csv
import math
import re
from collections import Counter
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from itertools import product
from pathlib import Path
from typing import Annotated, get_args, get_origin

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import PydanticCustomError, core_schema

from . import units
from .geometry import Beam, Strip, Trapezoid
from .loads import LOADINGS, LOADS
from .materials import Material
from .mesh import MESH_TYPES, QUADS
from .schemes import AXES, CURVE_COUNTS, EXPERIMENTS, ONCE, RIVALS, method_names
from .springs import DEFINITIONS
from .springs.lattice import COEFFICIENT

KINEMATICS = ("nonlinear", "linear")
"""Kinematics of a network: springs that keep their length law, or their tangent at rest."""

PLAUSIBLE = 20.0
"""A stated stiffness farther than this factor from sqrt(3)/2 E t is taken for an error of units."""

MOST_PARTICLES = 5e6
"""A mesh with more particles is taken for an error of units."""

MOST_POINTS = 10_001
"""Most points of a sensitivity curve."""

OUTPUTS = ("sensitivity", "size", "deformed", "tables", "definitions", "block", "laying", "stability", "benchmark")
"""What is made from a dataset: figures of curves, of errors against mesh size and of deformed networks; tables as the
paper's; figures and tables that compare definitions; the figure of a pressed block, that of laid strips, and figures
and the pages of the experiments on stability and of the benchmark."""

FURTHER_REFERENCES = ("neo-hooke-plane-stress", "neo-hooke-plane-strain")
"""Kinds of reference besides the small-strain one, for scenes under pressure."""

SHOWN_PROBLEMS = 5
"""Problems that one message lists; it counts the others."""


class StudyError(ValueError):
    """A study that cannot be run; the message names file, line, key, value and remedy."""


# -- what is asked -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class MeshSpec:
    """A mesh that a study asks for.

    Attributes
    ----------
    beam : Beam
    mesh_type : str
        Key of `springtune.mesh.MESH_TYPES`, or the name of meshes from files.
    mesh_size : float
        Asked length of an edge [m].
    file : Path or None
        The file that it is read from.
    unit : float
        Unit of the coordinates in the file [m].
    """

    beam: Beam
    mesh_type: str
    mesh_size: float
    file: Path | None = None
    unit: float = 1.0

    @property
    def name(self):
        """File stem, e.g. ``"200x40_structured_5mm"``."""
        return f"{self.beam.name}_{self.mesh_type}_{1e3 * self.mesh_size:g}mm"


@dataclass(frozen=True)
class Scene:
    """One boundary-value problem on one mesh.

    Attributes
    ----------
    mesh : MeshSpec
    material : Material
    load : str
        Key of `springtune.loads.LOADS`.
    force : float
        Force on the loaded side, tension positive [N].
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    kinematics : str
        One of `KINEMATICS`.
    """

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    definition: str
    kinematics: str

    @property
    def name(self):
        """Readable name, unique in a study."""
        return f"{self.mesh.name}_{self.material.name}_{self.load}_{self.definition}_{self.kinematics}"


@dataclass(frozen=True)
class Curve:
    """A sensitivity curve: attributes as a `Scene`'s, its stiffness running through `Study.stiffness_ratios`."""

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    kinematics: str


@dataclass(frozen=True)
class Reference:
    """A finite-element answer: attributes as a `Scene`'s."""

    beam: Beam
    material: Material
    load: str
    force: float


@dataclass(frozen=True)
class Moduli:
    """Effective moduli of a definition on a patch, see `Study.patch`.

    Attributes
    ----------
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    mesh_type : str
    mesh_size : float
        Length of an edge [m].
    poisson_ratio : float
        Poisson's ratio that the definition is asked for [1].
    """

    definition: str
    mesh_type: str
    mesh_size: float
    poisson_ratio: float


@dataclass(frozen=True)
class Laying:
    """A strip to lay on a trapezoid, see `springtune.laying`.

    Attributes
    ----------
    strip : Strip
    trapezoid : Trapezoid
    material, support : Material
        Of the strip and of the trapezoid.
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    mesh_size : float
        Length of an edge [m].
    loading : str
        One of `springtune.loads.LOADINGS`.
    pressure : float
        Pressure on the strip, or its weight over its upper face [Pa].
    friction : float
        Coulomb's coefficient [1].
    """

    strip: Strip
    trapezoid: Trapezoid
    material: Material
    support: Material
    definition: str
    mesh_size: float
    loading: str
    pressure: float
    friction: float


@dataclass(frozen=True)
class Experiment:
    """An experiment on numerical stability, see `springtune.stability`.

    Attributes
    ----------
    name : str
        Key of `springtune.schemes.EXPERIMENTS`.
    beam : Beam
    material : Material
        With a density.
    force : float
        Traction [N].
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    mesh_type : str
    mesh_sizes : tuple of float
        Lengths of an edge [m], ascending.
    """

    name: str
    beam: Beam
    material: Material
    force: float
    definition: str
    mesh_type: str
    mesh_sizes: tuple


@dataclass(frozen=True)
class Race:
    """A scene of the benchmark, see `springtune.benchmark`.

    Attributes
    ----------
    name : str
    beam : Beam
    material : Material
        With a density.
    load : str
        Key of `springtune.loads.LOADS`.
    force : float
        Force on the loaded side, tension positive [N].
    methods : tuple of str
    mesh_sizes : tuple of float
        Lengths of an edge [m], ascending.
    most_seconds, most_thorough : float
        Seconds that a run may take: of most methods, and of those below.
    thorough : tuple of str
    """

    name: str
    beam: Beam
    material: Material
    load: str
    force: float
    methods: tuple
    mesh_sizes: tuple
    most_seconds: float
    most_thorough: float
    thorough: tuple


@dataclass(frozen=True)
class Grid:
    """What one grid of a study asks for, whether or not other grids ask for it, too.

    Attributes
    ----------
    name : str
    scenes : tuple of Scene
    curves : tuple of Curve
    moduli : tuple of Moduli
    """

    name: str
    scenes: tuple
    curves: tuple
    moduli: tuple = ()


@dataclass(frozen=True)
class PrintedCell:
    """A cell of a printed table, as printed.

    Attributes
    ----------
    table : int
        Number of the table.
    beam, mesh_type, material, load : str
        Labels of the cell.
    mesh_size : float
        Length of an edge [m].
    force : float
        Force, without sign [N].
    stiffness : float
        Stiffness of the springs [N/m].
    reference_displacement, displacement : float
        Displacement by finite elements and of the network, without sign [m].
    deformation_error : float
        Deformation error, without sign [1].
    remark : str
        Where the print contradicts itself; empty otherwise.
    """

    table: int
    beam: str
    mesh_type: str
    mesh_size: float
    material: str
    load: str
    force: float
    stiffness: float
    reference_displacement: float
    displacement: float
    deformation_error: float
    remark: str


@dataclass(frozen=True)
class Study:
    """A study, ready to run.

    All tuples are free of duplicates and ordered by beam and material as declared, then by mesh type, mesh size, load,
    definition and kinematics, whatever the order of grids and of the lists in them.

    Attributes
    ----------
    name : str
        Stem of the file.
    path : Path
        The file.
    text : str
        The file as read.
    title : str
    meshes : tuple of MeshSpec
    scenes : tuple of Scene
    curves : tuple of Curve
    references : tuple of Reference
    moduli : tuple of Moduli
    patch : Beam or None
        Box on whose meshes moduli are measured; its thickness does not matter.
    mesh_files : dict
        `MeshSpec` of meshes from files by (mesh type, beam's name, mesh size).
    outputs : tuple of str
        What is made from the dataset: of `OUTPUTS`.
    further_references : tuple of str
        Of `FURTHER_REFERENCES`.
    laying : tuple of Laying
    laying_references : tuple of Laying
        Strips of finite elements that the others are compared with: one a loading and friction.
    stability : tuple of Experiment
    benchmark : tuple of Race
    grids : tuple of Grid
        In the order of the file.
    stiffness_ratios : tuple of float
        k / (E t) along every curve, ascending [1].
    stiffness_table : dict
        Stiffness [N/m] of the definition ``paper`` by (mesh type, material).
    calibration : tuple of str or None
        Beam and load whose curves calibrate the definition ``calibrated``.
    printed : tuple of PrintedCell
    printed_path : Path or None
        File of the printed values.
    axes : dict of str to tuple
        Labels of each dimension of the dataset: texts, for ``mesh_size`` numbers [m].
    """

    name: str
    path: Path
    text: str
    title: str
    meshes: tuple
    scenes: tuple
    curves: tuple
    references: tuple
    moduli: tuple
    patch: Beam | None
    mesh_files: dict
    outputs: tuple
    further_references: tuple
    laying: tuple
    laying_references: tuple
    stability: tuple
    benchmark: tuple
    grids: tuple
    stiffness_ratios: tuple
    stiffness_table: dict
    calibration: tuple | None
    printed: tuple
    printed_path: Path | None
    axes: dict


# -- problems ----------------------------------------------------------------------------------------------------------


class _Problems:
    """Collects what is wrong with a file and raises it as one `StudyError`.

    Parameters
    ----------
    file : str
        The file as its user named it.
    lines : dict of tuple to int, optional
        Line of each path of keys.
    """

    def __init__(self, file, lines=None):
        self._file, self._lines, self._found = file, lines or {}, []

    def add(self, path, message, line=0):
        path = tuple(path)
        # What is missing has no line of its own; that of what should hold it helps.
        above = (path[:size] for size in range(len(path), 0, -1))
        line = line or next((self._lines[keys] for keys in above if keys in self._lines), 0)
        place = f"{self._file}:{line}" if line else self._file
        keys = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).removeprefix(".")
        self._found.append((line, f"{place}: {keys}: {message}" if keys else f"{place}: {message}"))

    def stop(self):
        """Raise if anything was found."""
        if not self._found:
            return
        messages = list(dict.fromkeys(message for _, message in sorted(self._found, key=lambda found: found[0])))
        more = len(messages) - SHOWN_PROBLEMS
        messages[SHOWN_PROBLEMS:] = [f"... and {more} more"] if more > 0 else []
        raise StudyError("\n".join(messages))


def _refuse(message, *path):
    """Error of a validator; `path` leads from the validated value to the culprit inside it."""
    return PydanticCustomError("study", "{message}", {"message": message, "path": path})


def _show(value):
    """A value of the file, for a message."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    if value is None:
        return "nothing"
    return f"'{value}'" if len(value) <= 60 else f"'{value[:57]}...'"


def _nearest(word, words):
    """``did you mean ...? `` if one of the words is near, and all of them."""
    words = list(words)
    near = get_close_matches(word, words, n=1, cutoff=0.6)
    hint = f"did you mean '{near[0]}'? " if near else ""
    return f"{hint}known: {', '.join(words)}"


# -- YAML with line numbers --------------------------------------------------------------------------------------------


def _read_yaml(text, file):
    """Content of a YAML text as dicts, lists and texts, and the line of each path of keys.

    Scalars stay the texts they are, so that names such as ``1e3`` or ``no`` are no numbers or booleans, and messages
    show what the file holds.
    """
    lines = {}
    try:
        root = yaml.compose(text, Loader=yaml.SafeLoader)
        return _content(root, (), lines, file), lines
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        line = f":{mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or getattr(error, "reason", None) or "unreadable"
        raise StudyError(
            f"{file}{line}: not YAML: {problem}; check colons, brackets and indentation of this line and the one above"
        ) from None
    except RecursionError:
        raise StudyError(f"{file}: not a study: nested too deeply; see config/README.md for what it may hold") from None


def _content(node, path, lines, file):
    if node is None or node.tag == "tag:yaml.org,2002:null":
        return None
    lines.setdefault(path, node.start_mark.line + 1)
    if isinstance(node, yaml.ScalarNode):
        return node.value
    if isinstance(node, yaml.SequenceNode):
        return [_content(item, (*path, number), lines, file) for number, item in enumerate(node.value)]
    content, merged = {}, {}
    for key, value in node.value:
        line = key.start_mark.line + 1
        if not isinstance(key, yaml.ScalarNode):
            raise StudyError(f"{file}:{line}: a list or mapping cannot be a key; write a name before the colon")
        if key.tag == "tag:yaml.org,2002:merge":
            for base in value.value if isinstance(value, yaml.SequenceNode) else [value]:
                inherited = _content(base, path, {}, file)
                if not isinstance(inherited, dict):
                    raise StudyError(f"{file}:{line}: '<<' merges mappings only; give it an alias such as *name")
                merged = inherited | merged
            continue
        inside = (*path, key.value)
        if key.value in content:
            problems = _Problems(file, {inside: line})
            problems.add(inside, f"'{key.value}' is given twice, first in line {lines[inside]}; rename or remove one")
            problems.stop()
        lines[inside] = line
        content[key.value] = _content(value, inside, lines, file)
    return merged | content


# -- what a file may hold ----------------------------------------------------------------------------------------------


class _Scalar:
    """Annotation of a field: how its text is read, its JSON schema and words for the manual."""

    def __init__(self, read, schema, words):
        self.read, self.schema, self.words = read, schema, words

    def __get_pydantic_core_schema__(self, source, handler):
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(self, schema, handler):
        return dict(self.schema)

    def _read(self, value):
        if not isinstance(value, str) or not value.strip():
            raise _refuse(f"{_show(value)} instead of {self.words}; give {self.words}")
        return self.read(value)


def _quantity(kind, negative="give a size above zero"):
    example = units.KINDS[kind].example

    def read(value):
        try:
            number = units.parse(value, kind)
        except units.UnitError as error:
            raise _refuse(str(error)) from None
        if not number > 0:
            raise _refuse(f"'{value}' is not above zero; {negative}, such as '{example}'")
        return number

    schema = {"type": "string", "pattern": r"^\s*\+?[0-9.]+([eE][+-]?[0-9]+)?\s*[^0-9\s].*$", "examples": [example]}
    return Annotated[float, _Scalar(read, schema, f"a {kind} such as '{example}'")]


def _number(words, low, high, *, above=False, whole=False):
    def read(value):
        try:
            number = int(value) if whole else float(value)
        except ValueError:
            raise _refuse(f"'{value}' is not a {'whole ' if whole else ''}number; give {words}") from None
        if not (low < number if above else low <= number) or not number <= high or not math.isfinite(number):
            raise _refuse(f"'{value}' is out of range; give {words}")
        return number

    schema = {"type": "integer" if whole else "number", "exclusiveMinimum" if above else "minimum": low}
    if math.isfinite(high):
        schema["maximum"] = high
    return Annotated[int if whole else float, _Scalar(read, schema, words)]


def _one_of(what, names):
    names = list(names)

    def read(value):
        if value not in names:
            raise _refuse(f"unknown {what} '{value}'; {_nearest(value, names)}")
        return value

    return Annotated[str, _Scalar(read, {"enum": names}, " or ".join(f"'{name}'" for name in names))]


def _read_flag(value):
    if value.lower() not in ("true", "false"):
        raise _refuse(f"'{value}' is neither true nor false; give one of them")
    return value.lower() == "true"


_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]*")
_NAME_RULE = "use letters, digits, '.', '_' and '-', and no '.' in front: names become parts of file names"

Length = _quantity("length")
Force = _quantity("force", "the load's name carries the sign: give a magnitude")
Stiffness = _quantity("stiffness")
Stress = _quantity("stress")
Density = _quantity("density")
PoissonRatio = _number("a number from 0 to 0.5, such as 0.3", 0, 0.5)
Ratio = _number("a number above 0", 0, math.inf, above=True)
Points = _number(f"a whole number from 2 to {MOST_POINTS}, such as 61", 2, MOST_POINTS, whole=True)
MeshType = Annotated[
    str, _Scalar(str, {"type": "string", "examples": list(MESH_TYPES)}, "a mesh type such as 'structured'")
]
Load = _one_of("load", LOADS)
Output = _one_of("output", OUTPUTS)
Loading = _one_of("loading", LOADINGS)
Rival = _one_of("method", RIVALS)
Seconds = _number("a number of seconds above 0, such as 0.5", 0, 3600, above=True)
ExperimentName = _one_of("experiment", EXPERIMENTS)
Friction = _number("a coefficient from 0 to 2, such as 0.3", 0, 2)
FurtherReference = _one_of("reference", FURTHER_REFERENCES)
Kinematics = _one_of("kinematics", KINEMATICS)
DefinitionName = _one_of("definition", DEFINITIONS)
Flag = Annotated[bool, _Scalar(_read_flag, {"type": "boolean"}, "true or false")]
Text = Annotated[str, _Scalar(str, {"type": "string", "minLength": 1}, "a text")]
FileName = Annotated[str, _Scalar(str, {"type": "string", "minLength": 1}, "the path of a file")]
BeamName = Annotated[str, _Scalar(str, {"type": "string"}, "the name of a beam")]
MaterialName = Annotated[str, _Scalar(str, {"type": "string"}, "the name of a material")]


class _OneOrMore:
    """Annotation of a list: no duplicates, not empty; a single value stands for a list of one."""

    def __get_pydantic_core_schema__(self, source, handler):
        return core_schema.no_info_wrap_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(self, schema, handler):
        array = handler(schema["schema"]) | {"minItems": 1, "uniqueItems": True}
        return {"anyOf": [array["items"], array]}

    @staticmethod
    def _read(value, handler):
        listed = [value] if isinstance(value, str) else value
        if not isinstance(listed, list):
            raise _refuse(f"{_show(value)} instead of a value or a list; write it as [first, second]")
        if not listed:
            raise _refuse("an empty list leaves the grid empty; give at least one value, or remove the grid")
        items = handler(listed)
        for number, item in enumerate(items):
            if item in items[:number]:
                raise _refuse(f"{_show(listed[number])} is listed twice; remove one", number)
        return items


class _PerBeam:
    """Annotation of a mapping from beams to quantities; a single quantity, kept under None, stands for all beams."""

    words = "a force such as '400 kN', or one for each beam"

    def __get_pydantic_core_schema__(self, source, handler):
        single = handler.generate_schema(Force)
        each = core_schema.no_info_wrap_validator_function(self._read_each, handler(source))
        choices = {"single": core_schema.no_info_after_validator_function(lambda force: {None: force}, single)}
        choices["each"] = each
        return core_schema.tagged_union_schema(choices, lambda value: "each" if isinstance(value, dict) else "single")

    def __get_pydantic_json_schema__(self, schema, handler):
        each = handler(schema["choices"]["each"]["schema"])
        return {"anyOf": [each["additionalProperties"], each | {"minProperties": 1}]}

    @staticmethod
    def _read_each(value, handler):
        if not value:
            raise _refuse("no force at all; give one for each beam, such as {200x40: 400 kN}")
        return handler(value)


class _Named:
    """Annotation of a mapping from names to sections: names that can be parts of file names, and at least one."""

    def __init__(self, what, for_files=True):
        self.what, self.for_files = what, for_files
        self.words = f"a section for each {what}, by name; see below"

    def __get_pydantic_core_schema__(self, source, handler):
        return core_schema.no_info_wrap_validator_function(self._read, handler(source))

    def __get_pydantic_json_schema__(self, schema, handler):
        described = handler(schema["schema"]) | {"minProperties": 1}
        if self.for_files:
            described["propertyNames"] = {"pattern": f"^{_NAME.pattern}$"}
        return described

    def _read(self, value, handler):
        if not isinstance(value, dict) or not value:
            shown = _show(value) if value else f"no {self.what} at all"
            raise _refuse(f"{shown}; give at least one {self.what}, its name followed by a colon and its keys")
        seen = {}
        for name in value if self.for_files else ():
            if not _NAME.fullmatch(name):
                raise _refuse(f"'{name}' cannot name a {self.what}; {_NAME_RULE}", name)
            other = seen.setdefault(name.casefold(), name)
            if other != name:
                message = f"'{name}' and '{other}' differ in case only, which file systems may ignore; rename one"
                raise _refuse(message, name)
        return handler(value)


def expected_value(field):
    """Words for what a field of a section expects, e.g. ``a length such as '200 mm'``."""
    for note in field.metadata:
        if isinstance(note, _OneOrMore):
            item = get_args(field.annotation)[0]
            return f"{get_args(item)[1].words}, or a list"
        if hasattr(note, "words"):
            return note.words
    listed = get_origin(field.annotation) is list
    text = next((note.words for part in get_args(field.annotation) for note in get_args(part)[1:]), None)
    return text or ("a list of sections; see below" if listed else "a section; see below")


class Section(BaseModel):
    """A mapping of known keys in a study."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, value):
        names = {field.alias or name: field for name, field in cls.model_fields.items()}
        if not isinstance(value, dict):
            raise _refuse(f"{_show(value)} instead of keys and values; give the keys {', '.join(names)}")
        for key in value:
            if key not in names:
                raise _refuse(f"unknown key '{key}'; {_nearest(key, names)}", key)
        given = {key: content for key, content in value.items() if content is not None}
        for name, field in names.items():
            if field.is_required() and name not in given:
                raise _refuse(f"'{name}' is missing; give {expected_value(field)}", name)
        return given


class BeamConfig(Section):
    """A rectangular sheet, its length along x."""

    length: Length = Field(description="Extent along x, the direction of the load.")
    height: Length = Field(description="Extent along y.")
    thickness: Length = Field("1 mm", validate_default=True, description="Extent out of the plane.")


class MaterialConfig(Section):
    """An isotropic, linearly elastic material."""

    young_modulus: Stress = Field(description="Young's modulus E.")
    poisson_ratio: PoissonRatio = Field(
        description="Poisson's ratio nu; 0.5 is legal, since sheets are in plane stress."
    )
    density: Density | None = Field(None, description="Density rho; for dynamics, statics need none.")


class StatedStiffness(Section):
    """One stated stiffness."""

    mesh_type: MeshType = Field(description="Mesh type that it is for.")
    material: MaterialName = Field(description="Material that it is for.")
    value: Stiffness = Field(
        description=f"Stiffness of every spring; refused if farther than a factor of {PLAUSIBLE:g} from sqrt(3)/2 E t."
    )


class PaperConfig(Section):
    """Parameters of the definition `paper`: stiffnesses that are stated, not derived."""

    stiffness: list[StatedStiffness] = Field(
        description="One entry for each mesh type and material that a grid uses with `paper`.", min_length=1
    )

    @model_validator(mode="before")
    @classmethod
    def _listed(cls, value):
        rows = value.get("stiffness") if isinstance(value, dict) else None
        if rows is not None and (not isinstance(rows, list) or not rows):
            example = "- {mesh_type: structured, material: steel, value: 170e6 N/m}"
            raise _refuse(f"{_show(rows)} instead of a list; give entries such as {example}", "stiffness")
        return value


class CalibratedConfig(Section):
    """Parameters of the definition `calibrated`.

    Its stiffness is found per mesh type, material and kinematics: the mean over the mesh sizes of the best stiffness of
    this study's own sensitivity curves of one beam and load.
    """

    beam: BeamName = Field(description="Beam whose curves calibrate.")
    load: Load = Field(description="Load whose curves calibrate.")


class DefinitionsConfig(Section):
    """Parameters of those definitions that have any; `springtune definitions` lists all definitions."""

    paper: PaperConfig | None = Field(None, description="Table of stiffnesses; needed where a grid uses `paper`.")
    calibrated: CalibratedConfig | None = Field(
        None, description="Where the stiffness is calibrated; needed where a grid uses `calibrated`."
    )


class SensitivityConfig(Section):
    """Uniform stiffnesses of every sensitivity curve, equally spaced, in units of sqrt(3)/2 E t."""

    start: Ratio = Field("0.4", validate_default=True, alias="from", description="Smallest stiffness.")
    stop: Ratio = Field("1.6", validate_default=True, alias="to", description="Largest stiffness.")
    points: Points = Field("61", validate_default=True, description="Number of stiffnesses, both ends included.")


class MeshFileConfig(Section):
    """One mesh from a file, of a format that meshio reads; it fills its beam and its lower left corner is anywhere."""

    file: FileName = Field(description="The file, its path relative to the study's folder.")
    beam: BeamName = Field(description="Beam that it meshes.")
    mesh_size: Length = Field(description="Length of an edge that it goes by in grids and in the dataset.")
    unit: Length = Field("1 m", validate_default=True, description="Unit of the coordinates in the file.")


class PatchConfig(Section):
    """Box on whose meshes effective moduli are measured: between rollers for E and nu, under even shear for G.

    Rows of triangles come as the exact lattice there, with staggered ends, not stretched to the box.
    """

    length: Length = Field("100 mm", validate_default=True, description="Extent along x.")
    height: Length = Field("20 mm", validate_default=True, description="Extent along y.")


class TrapezoidConfig(Section):
    """A symmetric trapezoid that stands on its lower base."""

    lower_base: Length = Field(description="Length of the base on the floor.")
    upper_base: Length = Field(description="Length of the upper base.")
    height: Length = Field(description="Height.")


class LayingConfig(Section):
    """A strip laid on a trapezoid: every combination of the values listed, as in a grid.

    The reference of a loading and friction is a strip of linear triangles on a mesh of its own.
    """

    strip: BeamName = Field(description="Beam that is the strip.")
    trapezoid: TrapezoidConfig = Field(description="What it is laid on.")
    material: MaterialName = Field(description="Material of the strip.")
    support: MaterialName = Field(description="Material of the trapezoid; from 1e4 times as stiff on it is rigid.")
    definition: Annotated[list[DefinitionName], _OneOrMore()] = Field(
        description="Definitions that derive a stiffness and need no reference."
    )
    mesh_size: Annotated[list[Length], _OneOrMore()] = Field(description="Lengths of an edge.")
    reference_size: Length = Field(
        "1 mm", validate_default=True, description="Length of an edge of the reference's mesh."
    )
    loading: Annotated[list[Loading], _OneOrMore()] = Field(
        "pressure",
        validate_default=True,
        description="`pressure`: on the upper face, following it; `gravity`: the same force as weight; `ends`: the "
        "ends are drawn down to the floor.",
    )
    pressure: Stress = Field(description="Pressure, or weight over the upper face.")
    friction: Annotated[list[Friction], _OneOrMore()] = Field(
        "0", validate_default=True, description="Coulomb's coefficients of friction."
    )


class StabilityConfig(Section):
    """Experiments on numerical stability: a beam in traction, in motion and under stress far beyond the study's own."""

    beam: BeamName = Field(description="Beam.")
    material: MaterialName = Field(description="Material, with a density.")
    force: Force = Field(description="Traction on the right end.")
    definition: Annotated[list[DefinitionName], _OneOrMore()] = Field(
        description="Definitions that derive a stiffness and need no reference; the first one stands for all where an "
        "experiment is not about definitions."
    )
    mesh_type: MeshType = Field("structured", validate_default=True, description="Mesh type of triangles.")
    mesh_size: Annotated[list[Length], _OneOrMore()] = Field(
        description="Lengths of an edge; most experiments take the coarsest."
    )
    experiment: Annotated[list[ExperimentName], _OneOrMore()] = Field(
        list(EXPERIMENTS),
        validate_default=False,
        description="; ".join(f"`{name}`: {text}" for name, text in EXPERIMENTS.items()) + ". All of them without.",
    )


class BenchmarkSceneConfig(Section):
    """A scene of the benchmark."""

    beam: BeamName = Field(description="Beam.")
    material: MaterialName = Field(description="Material, with a density.")
    load: Load = Field(description="`traction`, `compression`, `bending` or `pressure`.")
    force: Force = Field(description="Magnitude of the force.")


class BenchmarkConfig(Section):
    """Run time against error: every definition on every mesh type, and other methods; one method at a time."""

    scenes: Annotated[dict[str, BenchmarkSceneConfig], _Named("scene")] = Field(description="Scenes.")
    definition: Annotated[list[DefinitionName], _OneOrMore()] = Field(
        description="Definitions that derive a stiffness and need no reference."
    )
    mesh_type: Annotated[list[MeshType], _OneOrMore()] = Field(description="Mesh types of the definitions.")
    method: Annotated[list[Rival], _OneOrMore()] = Field(
        list(RIVALS),
        validate_default=False,
        description="Other methods: finite elements, CalculiX where it is on the machine, motion to rest, and what the "
        "paper names: tensor-mass, pre-computed responses, boundary elements, free-form deformation. All without.",
    )
    mesh_size: Annotated[list[Length], _OneOrMore()] = Field(description="Lengths of an edge.")
    most_seconds: Seconds = Field(
        "0.2",
        validate_default=True,
        description="Seconds that a run may take; a finer size that would take more is left out.",
    )
    thorough: Annotated[list[Text], _OneOrMore()] = Field(
        [], validate_default=False, description="Methods that may take more, such as `delingette/structured`."
    )
    most_thorough: Seconds = Field("8", validate_default=True, description="Seconds that a run of those may take.")


class GridConfig(Section):
    """A product of parameters: every combination of the values listed is a scene.

    A single value stands for a list of one. A scene that two grids ask for is solved once.
    """

    beam: Annotated[list[BeamName], _OneOrMore()] = Field(description="Beams, by name.")
    mesh_type: Annotated[list[MeshType], _OneOrMore()] = Field(
        description="`structured`: equilateral rows fitted to the box; "
        "`free`: Delaunay inside an outline of imposed edge size; `right`, `alternating`: squares with one diagonal; "
        "`braced`: squares with both; `isosceles-0.3`, `isosceles-0.5`: rows of triangles whose shape sets that "
        "Poisson's ratio; or a name under `mesh_files`."
    )
    mesh_size: Annotated[list[Length], _OneOrMore()] = Field(
        description="Lengths of an edge; at most the smaller side of each beam."
    )
    material: Annotated[list[MaterialName], _OneOrMore()] = Field(description="Materials, by name.")
    load: Annotated[list[Load], _OneOrMore()] = Field(
        description="`traction`, `compression`: along x on the right end, `bending`: along y there, the left end "
        "clamped; `shear`: along x on the upper side, which stays level, the lower side clamped; `pressure`, "
        "`follower-pressure`: down on the upper side, the lower side clamped. Spread evenly."
    )
    force: Annotated[dict[str, Force], _PerBeam()] | None = Field(
        None,
        description="Magnitude of the force: one for all beams, or one for each. The load's name carries the sign. "
        "A beam, material and load have the same force in all grids.",
    )
    pressure: Stress | None = Field(
        None,
        description="Pressure on the upper side, in place of `force`; for loads `pressure` and `follower-pressure`.",
    )

    @model_validator(mode="after")
    def _one_force(self):
        if (self.force is None) == (self.pressure is None):
            both = "both 'force' and 'pressure'; remove one"
            missing = "'force' is missing; give a force such as '400 kN', or one for each beam"
            raise _refuse(missing if self.force is None else both, *(() if self.force is None else ("pressure",)))
        for load in self.load if self.pressure is not None else ():
            if LOADS[load].kind != "face":
                raise _refuse(f"load '{load}' has no pressed side; give 'force', or loads under pressure", "pressure")
        return self

    definition: Annotated[list[DefinitionName], _OneOrMore()] = Field(
        description="Rules that give every spring its stiffness; `springtune definitions` explains them."
    )
    kinematics: Annotated[list[Kinematics], _OneOrMore()] = Field(
        "nonlinear",
        validate_default=True,
        description="Whether springs keep their length law or their tangent at rest.",
    )
    sensitivity: Flag = Field(
        "true",
        validate_default=True,
        description="Whether each mesh, material, load and kinematics also gets a sensitivity curve. "
        "Curves that `calibrated` needs are made in any case.",
    )
    moduli: Flag = Field(
        "false",
        validate_default=True,
        description="Whether effective moduli are measured for each definition, mesh type, mesh size and Poisson's "
        "ratio, on the box under `patch`. Definitions that are told their stiffness have none.",
    )


class StudyConfig(Section):
    """A study."""

    title: Text = Field(description="What the study is, in one line.")
    beams: Annotated[dict[str, BeamConfig], _Named("beam")] = Field(description="Beams.")
    materials: Annotated[dict[str, MaterialConfig], _Named("material")] = Field(description="Materials.")
    definitions: DefinitionsConfig = Field(
        default_factory=DefinitionsConfig, description="Parameters of the definitions that have any."
    )
    sensitivity: SensitivityConfig = Field(
        default_factory=SensitivityConfig, description="Range of stiffness of the sensitivity curves."
    )
    mesh_files: Annotated[dict[str, list[MeshFileConfig]], _Named("mesh type")] | None = Field(
        None, description="Mesh types of your own: for each a list of files, one for each beam and mesh size."
    )
    patch: PatchConfig = Field(default_factory=PatchConfig, description="Box on whose meshes moduli are measured.")
    outputs: Annotated[list[Output], _OneOrMore()] = Field(
        ["sensitivity", "size", "deformed", "tables"],
        validate_default=False,
        description="What is made from the dataset: figures of sensitivity curves, of errors against mesh size, of "
        "deformed networks (and the group `/fields` behind them), tables as the paper's; `definitions`: figures and "
        "tables that compare definitions; `block`, `laying`, `stability`, `benchmark`: figures of these groups. "
        "Figures of scenes are of nonlinear kinematics.",
    )
    further_references: Annotated[list[FurtherReference], _OneOrMore()] = Field(
        [],
        description="References at finite strain besides the small-strain one, for scenes under pressure, in the group "
        "`/block`. An incompressible material has none in plane strain.",
    )
    laying: LayingConfig | None = Field(None, description="A strip laid on a trapezoid; it makes the group `/laying`.")
    stability: StabilityConfig | None = Field(
        None, description="Experiments on numerical stability; they make the group `/stability`."
    )
    benchmark: BenchmarkConfig | None = Field(
        None, description="Run time against error; it makes the group `/benchmark`."
    )
    printed: FileName | None = Field(
        None, description="CSV file of printed values to compare with, its path relative to the study's folder."
    )
    grids: Annotated[dict[str, GridConfig], _Named("grid", for_files=False)] = Field(
        description="Grids: what is asked."
    )


SECTIONS = {
    "": StudyConfig,
    "beams.<name>": BeamConfig,
    "materials.<name>": MaterialConfig,
    "definitions": DefinitionsConfig,
    "definitions.paper": PaperConfig,
    "definitions.paper.stiffness[]": StatedStiffness,
    "definitions.calibrated": CalibratedConfig,
    "sensitivity": SensitivityConfig,
    "mesh_files.<name>[]": MeshFileConfig,
    "patch": PatchConfig,
    "laying": LayingConfig,
    "laying.trapezoid": TrapezoidConfig,
    "stability": StabilityConfig,
    "benchmark": BenchmarkConfig,
    "benchmark.scenes.<name>": BenchmarkSceneConfig,
    "grids.<name>": GridConfig,
}
"""Model of each section of a study, by its place."""


def json_schema():
    """JSON schema of a study, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | StudyConfig.model_json_schema()


# -- from file to study ------------------------------------------------------------------------------------------------


def load_study(path):
    """Read, validate and expand a study.

    Parameters
    ----------
    path : str or Path
        YAML file.

    Returns
    -------
    Study

    Raises
    ------
    StudyError
        If anything is wrong with the file; nothing else is raised.
    """
    path, file = Path(path), str(path)
    try:
        text = path.read_bytes().decode()
    except (OSError, ValueError) as error:
        why = "it is not UTF-8 text" if isinstance(error, UnicodeDecodeError) else getattr(error, "strerror", error)
        raise StudyError(f"{file}: cannot be read: {why}; give the path of a study such as config/paper.yaml") from None
    if not _NAME.fullmatch(path.stem):
        raise StudyError(f"{file}: '{path.stem}' cannot name a study; rename the file: {_NAME_RULE}")
    content, lines = _read_yaml(text, file)
    problems = _Problems(file, lines)
    config = _validate(content, problems)
    _check_names(config, problems)
    problems.stop()
    _check_meshes(config, content, problems)
    problems.stop()
    mesh_files = _mesh_files(config, path.parent, problems)
    grids = _expand(config, mesh_files, problems)
    _check_definitions(config, content, grids, problems)
    problems.stop()
    printed_path = path.parent / config.printed if config.printed else None
    about = {"name": path.stem, "path": path, "text": text, "printed_path": printed_path, "mesh_files": mesh_files}
    return _study(config, grids, problems, about)


def _validate(content, problems):
    """Config of what a file holds."""
    if content is None:
        problems.add((), f"the file is empty; give the keys {', '.join(StudyConfig.model_fields)}")
        problems.stop()
    try:
        return StudyConfig.model_validate(content)
    except ValidationError as error:
        for details in error.errors(include_url=False):
            path, place = [], content
            # pydantic's path has steps that the file has not: branches of a union, the item of a single value.
            for step in details["loc"]:
                if isinstance(place, dict) and step in place or isinstance(place, list) and isinstance(step, int):
                    path.append(step)
                    place = place[step]
            own = details["type"] == "study"
            path += [step for step in details["ctx"]["path"] if isinstance(place, list | dict)] if own else []
            problems.add(path, details["msg"] if own else f"{_show(place)}: {details['msg']}; see config/README.md")
        problems.stop()


def _check_names(config, problems):
    """Names that refer to what the study declares, and pairs of numbers."""

    def known(path, what, name, names):
        if name not in names:
            problems.add(path, f"unknown {what} '{name}'; {_nearest(name, names)}; or declare it under {what}s")

    mesh_types = _mesh_types(config)
    for name in config.mesh_files or ():
        if name in MESH_TYPES:
            problems.add(("mesh_files", name), f"'{name}' is a mesh type that is made; rename yours")
        for number, row in enumerate(config.mesh_files[name]):
            known(("mesh_files", name, number, "beam"), "beam", row.beam, config.beams)
    for name, grid in config.grids.items():
        for mesh_type in grid.mesh_type:
            if mesh_type not in mesh_types:
                message = f"unknown mesh type '{mesh_type}'; {_nearest(mesh_type, mesh_types)}"
                problems.add(("grids", name, "mesh_type"), f"{message}; or declare it under mesh_files")
        for beam in grid.beam:
            known(("grids", name, "beam"), "beam", beam, config.beams)
        for material in grid.material:
            known(("grids", name, "material"), "material", material, config.materials)
        for beam in grid.force or ():
            if beam is not None:
                known(("grids", name, "force", beam), "beam", beam, config.beams)
        if grid.force and None not in grid.force:
            for beam in grid.beam:
                if beam not in grid.force:
                    problems.add(("grids", name, "force"), f"no force for beam '{beam}'; add '{beam}: <force>'")
    if config.laying:
        known(("laying", "strip"), "beam", config.laying.strip, config.beams)
        for key in ("material", "support"):
            known(("laying", key), "material", getattr(config.laying, key), config.materials)
        for name in config.laying.definition:
            if DEFINITIONS[name].needs or 3 not in DEFINITIONS[name].cells:
                able = [other for other, one in DEFINITIONS.items() if not one.needs and 3 in one.cells]
                message = f"'{name}' is for triangles with a reference or a stated stiffness, or for rectangles"
                problems.add(("laying", "definition"), f"{message}; choose of {', '.join(able)}")
        base = config.laying.trapezoid
        if not base.upper_base < base.lower_base:
            problems.add(("laying", "trapezoid", "upper_base"), "is not below 'lower_base'; give a shorter upper base")
    if config.benchmark:
        _check_benchmark(config, known, problems)
    if config.stability:
        _check_stability(config, known, problems)
    calibrated, paper = config.definitions.calibrated, config.definitions.paper
    if calibrated:
        known(("definitions", "calibrated", "beam"), "beam", calibrated.beam, config.beams)
    seen = set()
    for number, row in enumerate(paper.stiffness if paper else ()):
        path = ("definitions", "paper", "stiffness", number)
        known((*path, "material"), "material", row.material, config.materials)
        if row.mesh_type not in mesh_types:
            problems.add(
                (*path, "mesh_type"), f"unknown mesh type '{row.mesh_type}'; {_nearest(row.mesh_type, mesh_types)}"
            )
        if (row.mesh_type, row.material) in seen:
            problems.add(path, f"a second stiffness for {row.mesh_type} meshes of {row.material}; remove one")
        seen.add((row.mesh_type, row.material))
    if not config.sensitivity.start < config.sensitivity.stop:
        start, stop = config.sensitivity.start, config.sensitivity.stop
        problems.add(("sensitivity", "from"), f"{start:g} is not below 'to', {stop:g}; give a smaller 'from'")


def _check_benchmark(config, known, problems):
    """Names and numbers of the benchmark."""
    asked = config.benchmark
    for name, scene in asked.scenes.items():
        place = ("benchmark", "scenes", name)
        known((*place, "beam"), "beam", scene.beam, config.beams)
        known((*place, "material"), "material", scene.material, config.materials)
        if scene.material in config.materials and config.materials[scene.material].density is None:
            message = f"'{scene.material}' has no density; add one to it under materials, such as density: 7850 kg/m^3"
            problems.add((*place, "material"), message)
        if LOADS[scene.load].kind == "shear" or LOADS[scene.load].follower:
            problems.add((*place, "load"), f"'{scene.load}' is not raced; choose traction, bending or pressure")
        if scene.beam in config.beams:
            side = min(config.beams[scene.beam].length, config.beams[scene.beam].height)
            if max(asked.mesh_size) > side / 2:
                large = f"{1e3 * max(asked.mesh_size):g} mm"
                message = f"{large} is too large for '{scene.beam}'; give at most {500 * side:g} mm"
                problems.add(("benchmark", "mesh_size"), message)
    for name in asked.definition:
        if DEFINITIONS[name].needs:
            able = ", ".join(other for other, one in DEFINITIONS.items() if not one.needs)
            problems.add(("benchmark", "definition"), f"'{name}' needs more than mesh and material; choose of {able}")
    for name in asked.mesh_type:
        if name not in MESH_TYPES:
            problems.add(("benchmark", "mesh_type"), f"unknown mesh type '{name}'; {_nearest(name, MESH_TYPES)}")
    methods = method_names(asked.definition, asked.mesh_type, asked.method)
    for name in asked.thorough:
        if name not in methods:
            message = f"'{name}' is no method of this benchmark; {_nearest(name, methods)}"
            problems.add(("benchmark", "thorough"), message)


def _check_stability(config, known, problems):
    """Names and numbers of the experiments on stability."""
    asked = config.stability
    known(("stability", "beam"), "beam", asked.beam, config.beams)
    known(("stability", "material"), "material", asked.material, config.materials)
    if asked.material in config.materials and config.materials[asked.material].density is None:
        message = f"'{asked.material}' has no density; add one to it under materials, such as density: 7850 kg/m^3"
        problems.add(("stability", "material"), message)
    for name in asked.definition:
        if DEFINITIONS[name].needs or 3 not in DEFINITIONS[name].cells:
            able = [other for other, one in DEFINITIONS.items() if not one.needs and 3 in one.cells]
            message = f"'{name}' is for triangles with a reference or a stated stiffness, or for rectangles"
            problems.add(("stability", "definition"), f"{message}; choose of {', '.join(able)}")
    made = [name for name in MESH_TYPES if name not in QUADS]
    if asked.mesh_type not in made:
        message = f"'{asked.mesh_type}' is no mesh type of triangles that is made; choose of {', '.join(made)}"
        problems.add(("stability", "mesh_type"), message)
    if asked.beam in config.beams:
        side = min(config.beams[asked.beam].length, config.beams[asked.beam].height)
        if max(asked.mesh_size) > 0.3 * side:
            message = f"{1e3 * max(asked.mesh_size):g} mm leaves few particles inside; give at most {300 * side:g} mm"
            problems.add(("stability", "mesh_size"), message)


def _mesh_types(config):
    """Names of all mesh types, made ones first."""
    return [*MESH_TYPES, *(config.mesh_files or ())]


def _mesh_files(config, folder, problems):
    """Meshes from files by (mesh type, beam's name, mesh size)."""
    found = {}
    for name, rows in (config.mesh_files or {}).items():
        for number, row in enumerate(rows):
            path, label = folder / row.file, (name, row.beam, row.mesh_size)
            where = ("mesh_files", name, number)
            if not path.is_file():
                problems.add((*where, "file"), f"'{path}' is not a file; give its path relative to the study's folder")
            if label in found:
                problems.add(where, f"a second file for beam '{row.beam}' at this mesh size; remove one")
            beam = config.beams[row.beam]
            beam = Beam(row.beam, beam.length, beam.height, beam.thickness)
            found[label] = MeshSpec(beam, name, row.mesh_size, path, row.unit)
    problems.stop()
    return found


def _check_meshes(config, content, problems):
    """Mesh sizes against the beams they are for."""
    for name, grid in config.grids.items():
        if not any(mesh_type in MESH_TYPES for mesh_type in grid.mesh_type):
            continue
        written = content["grids"][name]["mesh_size"]
        for number, size in enumerate(grid.mesh_size):
            shown = f"'{written[number]}'" if isinstance(written, list) else f"'{written}'"
            path = ("grids", name, "mesh_size", number) if isinstance(written, list) else ("grids", name, "mesh_size")
            for beam in grid.beam:
                length, height = config.beams[beam].length, config.beams[beam].height
                if size > min(length, height):
                    side = f"{1e3 * min(length, height):g} mm"
                    problems.add(path, f"{shown} is larger than beam '{beam}'; give at most its smaller side, {side}")
                elif length * height / (COEFFICIENT * size**2) > MOST_PARTICLES:
                    particles = f"{length * height / (COEFFICIENT * size**2):.0e}"
                    least = f"{1.05e3 * math.sqrt(length * height / COEFFICIENT / MOST_PARTICLES):.2g} mm"
                    problems.add(path, f"{shown} gives beam '{beam}' {particles} particles; give {least} or more")


def _ranks(config):
    """Place of each label in the order of its dimension."""
    names = {
        "beam": config.beams,
        "mesh_type": _mesh_types(config),
        "material": config.materials,
        "load": LOADS,
        "definition": DEFINITIONS,
        "kinematics": KINEMATICS,
    }
    return {dimension: {name: rank for rank, name in enumerate(labels)} for dimension, labels in names.items()}


def _order(ranks):
    """Sort key of meshes, scenes, curves and references."""

    def key(item):
        mesh = item if isinstance(item, MeshSpec) else getattr(item, "mesh", None)
        beam = (mesh or item).beam
        found = [ranks["beam"][beam.name]]
        if mesh:
            found += [ranks["mesh_type"][mesh.mesh_type], mesh.mesh_size]
        if mesh is not item:
            found += [ranks["material"][item.material.name], ranks["load"][item.load]]
            for label in ("definition", "kinematics"):
                if hasattr(item, label):
                    found.append(ranks[label][getattr(item, label)])
        return found

    return key


def _expand(config, mesh_files, problems):
    """Grids with their scenes and curves, in canonical order."""
    order = _order(_ranks(config))
    beams = {name: Beam(name, beam.length, beam.height, beam.thickness) for name, beam in config.beams.items()}
    materials = _materials(config)
    forces, grids = {}, []
    for name, grid in config.grids.items():
        scenes, curves, absent = [], [], set()
        for beam, material, load in product(grid.beam, grid.material, grid.load):
            if grid.pressure is not None:
                magnitude = grid.pressure * beams[beam].length * beams[beam].thickness
            else:
                magnitude = grid.force[beam if beam in grid.force else None]
            other, other_grid = forces.setdefault((beam, material, load), (magnitude, name))
            if other != magnitude:
                problems.add(
                    ("grids", name, "force"),
                    f"{magnitude:g} N on beam '{beam}' of {material} in {load}, but grid '{other_grid}' has "
                    f"{other:g} N; give both the same force, or the other one a study of its own",
                )
            force = LOADS[load].sign * magnitude
            for mesh_type, size, kinematics in product(grid.mesh_type, grid.mesh_size, grid.kinematics):
                mesh = MeshSpec(beams[beam], mesh_type, size)
                if mesh_type not in MESH_TYPES:
                    mesh = mesh_files.get((mesh_type, beam, size))
                    if mesh is None:
                        absent.add((mesh_type, beam, f"{1e3 * size:g} mm"))
                        continue
                common = (mesh, materials[material], load, force)
                scenes += [Scene(*common, definition, kinematics) for definition in grid.definition]
                if grid.sensitivity and not LOADS[load].follower:  # k enters as F/k only where forces stay
                    curves.append(Curve(*common, kinematics))
        for mesh_type, beam, size in sorted(absent):
            row = f"{{file: <path>, beam: {beam}, mesh_size: {size}}}"
            problems.add(("grids", name, "mesh_size"), f"no file for {size}; add {row} to mesh_files.{mesh_type}")
        moduli = _moduli(grid, materials) if grid.moduli else ()
        grids.append(Grid(name, tuple(sorted(scenes, key=order)), tuple(sorted(curves, key=order)), moduli))
    problems.stop()
    return tuple(grids)


def _moduli(grid, materials):
    """Moduli that a grid asks for: of definitions that derive a stiffness."""
    derived = [name for name in grid.definition if DEFINITIONS[name].needs != "stiffness"]
    ratios = dict.fromkeys(materials[name].poisson_ratio for name in grid.material)
    return tuple(Moduli(*labels) for labels in product(derived, grid.mesh_type, grid.mesh_size, ratios))


def _check_kinds(grids, problems):
    """Definitions against the cells and loads of the grids that use them."""
    for grid in grids:
        found = {}
        for scene in grid.scenes:
            definition, mesh_type = DEFINITIONS[scene.definition], scene.mesh.mesh_type
            count = 4 if mesh_type in QUADS else 3
            if mesh_type in MESH_TYPES and count not in definition.cells:
                needs, has = ("triangles", "quadrilaterals") if count == 4 else ("rectangles", "triangles")
                found[f"'{definition.name}' needs {needs} and mesh type '{mesh_type}' has {has}; {SEPARATE}"] = None
            if LOADS[scene.load].kind not in definition.kinds:
                kinds = " and ".join(name for name, load in LOADS.items() if load.kind in definition.kinds)
                found[f"'{definition.name}' is for {kinds} and load '{scene.load}' is neither; {SEPARATE}"] = None
        for message in found:
            problems.add(("grids", grid.name, "definition"), message)


SEPARATE = "give them grids of their own"
"""Remedy where two values of a grid do not go together."""


def _check_definitions(config, content, grids, problems):
    """Parameters of the definitions against what the grids need of them."""
    _check_kinds(grids, problems)
    stated = {(row.mesh_type, row.material): row.value for row in _stated(config)}
    thicknesses = {}
    for grid in grids:
        lacking = set()
        for scene in grid.scenes:
            pair = (scene.mesh.mesh_type, scene.material.name)
            if scene.definition == "paper":
                thicknesses.setdefault(pair, {})[scene.mesh.beam.thickness] = None
                if pair not in stated and pair not in lacking:
                    lacking.add(pair)
                    row = f"{{mesh_type: {pair[0]}, material: {pair[1]}, value: <stiffness> N/m}}"
                    problems.add(
                        ("grids", grid.name, "definition"),
                        f"'paper' has no stiffness for {pair[0]} meshes of {pair[1]}; "
                        f"add {row} to definitions.paper.stiffness",
                    )
        if not config.definitions.calibrated and any(scene.definition == "calibrated" for scene in grid.scenes):
            problems.add(
                ("grids", grid.name, "definition"),
                "'calibrated' needs to know on what; add definitions.calibrated with a beam and a load",
            )
    every = {beam.thickness: None for beam in config.beams.values()}
    for number, row in enumerate(_stated(config)):
        modulus = config.materials[row.material].young_modulus
        for thickness in thicknesses.get((row.mesh_type, row.material), every):
            expected = COEFFICIENT * modulus * thickness
            if not expected / PLAUSIBLE <= row.value <= expected * PLAUSIBLE:
                written = content["definitions"]["paper"]["stiffness"][number]["value"]
                problems.add(
                    ("definitions", "paper", "stiffness", number, "value"),
                    f"'{written}' cannot be meant: sqrt(3)/2 E t of {row.material}, {1e3 * thickness:g} mm thick, is "
                    f"{expected:.4g} N/m; give a stiffness near that, in N/m",
                )
                break


def _stated(config):
    return config.definitions.paper.stiffness if config.definitions.paper else []


def _calibrating(config, scenes, problems):
    """Curves that calibrate the scenes of the definition ``calibrated``."""
    calibration = config.definitions.calibrated
    if not calibration:
        return []
    cells = {
        (scene.mesh, scene.material, scene.load, scene.force): None
        for scene in scenes
        if (scene.mesh.beam.name, scene.load) == (calibration.beam, calibration.load)
    }
    needed = {
        (scene.mesh.mesh_type, scene.material, scene.kinematics): None
        for scene in scenes
        if scene.definition == "calibrated"
    }
    curves = []
    for mesh_type, material, kinematics in needed:
        found = [Curve(*cell, kinematics) for cell in cells if (cell[0].mesh_type, cell[1]) == (mesh_type, material)]
        if not found:
            problems.add(
                ("definitions", "calibrated"),
                f"no grid has beam '{calibration.beam}' in {calibration.load} on {mesh_type} meshes of {material.name}"
                ", but scenes there are 'calibrated'; add it to a grid, or calibrate on another beam or load",
            )
        curves += found
    return curves


def _laying(config, materials):
    """Strips to lay, and their references."""
    asked = config.laying
    if not asked:
        return (), ()
    beam, base = config.beams[asked.strip], asked.trapezoid
    parts = {
        "strip": Strip(beam.length, beam.height, beam.thickness),
        "trapezoid": Trapezoid(base.lower_base, base.upper_base, base.height),
        "material": materials[asked.material],
        "support": materials[asked.support],
        "pressure": asked.pressure,
    }
    labels = list(product(asked.loading, asked.friction))
    strips = [
        Laying(**parts, definition=definition, mesh_size=size, loading=loading, friction=friction)
        for definition in DEFINITIONS
        if definition in asked.definition
        for size in sorted(asked.mesh_size)
        for loading, friction in labels
    ]
    references = [
        Laying(**parts, definition="delingette", mesh_size=asked.reference_size, loading=loading, friction=friction)
        for loading, friction in labels
    ]
    return tuple(strips), tuple(references)


def _stability(config, materials):
    """Experiments on stability: one a definition, or one in all."""
    asked = config.stability
    if not asked:
        return ()
    beam = config.beams[asked.beam]
    beam = Beam(asked.beam, beam.length, beam.height, beam.thickness)
    return tuple(
        Experiment(
            name, beam, materials[asked.material], asked.force, definition, asked.mesh_type,
            tuple(sorted(asked.mesh_size)),
        )
        for name in EXPERIMENTS
        if name in asked.experiment
        for definition in (asked.definition[:1] if name in ONCE else asked.definition)
    )  # fmt: skip


def _benchmark(config, materials):
    """Scenes of the benchmark."""
    asked = config.benchmark
    races = []
    for name, scene in asked.scenes.items() if asked else ():
        beam = config.beams[scene.beam]
        races.append(
            Race(
                name, Beam(scene.beam, beam.length, beam.height, beam.thickness), materials[scene.material],
                scene.load, LOADS[scene.load].sign * scene.force,
                method_names([one for one in DEFINITIONS if one in asked.definition], asked.mesh_type,
                             [one for one in RIVALS if one in asked.method]),
                tuple(sorted(asked.mesh_size)), asked.most_seconds, asked.most_thorough, tuple(asked.thorough),
            )
        )  # fmt: skip
    return tuple(races)


def _materials(config):
    return {
        name: Material(name, material.young_modulus, material.poisson_ratio, material.density)
        for name, material in config.materials.items()
    }


def _study(config, grids, problems, about):
    """Study of a config and its grids."""
    ranks = _ranks(config)
    order = _order(ranks)

    def in_order(items):
        return tuple(sorted(dict.fromkeys(items), key=order))

    scenes = in_order(scene for grid in grids for scene in grid.scenes)
    curves = [curve for grid in grids for curve in grid.curves] + _calibrating(config, scenes, problems)
    meshes = in_order(scene.mesh for scene in scenes)
    references = in_order(Reference(scene.mesh.beam, scene.material, scene.load, scene.force) for scene in scenes)
    _check_files(meshes, scenes, references, problems)
    problems.stop()
    used = {name: {getattr(scene, name) for scene in scenes} for name in ("load", "definition", "kinematics")}
    used["beam"] = {mesh.beam.name for mesh in meshes}
    used["mesh_type"] = {mesh.mesh_type for mesh in meshes}
    used["material"] = {scene.material.name for scene in scenes}
    axes = {name: tuple(label for label in ranks[name] if label in used[name]) for name in ranks}
    axes["mesh_size"] = tuple(sorted({mesh.mesh_size for mesh in meshes}))
    moduli = tuple(dict.fromkeys(one for grid in grids for one in grid.moduli))
    axes["poisson_ratio"] = tuple(sorted({one.poisson_ratio for one in moduli}))
    outputs = tuple(name for name in OUTPUTS if name in config.outputs)
    laying, laying_references = _laying(config, _materials(config))
    stability = _stability(config, _materials(config))
    # Groups of a dataset share their dimensions with its root.
    others = {one.definition for one in (*laying, *stability)}
    axes["definition"] = tuple(name for name in DEFINITIONS if name in others or name in axes["definition"])
    benchmark = _benchmark(config, _materials(config))
    if benchmark:
        axes |= {"scene": tuple(race.name for race in benchmark), "method": benchmark[0].methods}
        axes["curve_count"] = CURVE_COUNTS
    further = {one.mesh_size for one in laying}
    further |= {size for one in (*stability, *benchmark) for size in one.mesh_sizes}
    axes["mesh_size"] = tuple(sorted({*axes["mesh_size"], *further}))
    axes |= AXES if stability else {}
    axes["loading"] = tuple(name for name in LOADINGS if any(one.loading == name for one in laying))
    axes["friction"] = tuple(sorted({one.friction for one in laying}))
    if "laying" in outputs and not laying:
        problems.add(("outputs",), "'laying' shows laid strips and the study has none; add a section 'laying'")
        problems.stop()
    if "benchmark" in outputs and not benchmark:
        problems.add(("outputs",), "'benchmark' shows races and the study has none; add a section 'benchmark'")
        problems.stop()
    if "stability" in outputs and not stability:
        problems.add(("outputs",), "'stability' shows experiments and the study has none; add a section 'stability'")
        problems.stop()
    if "block" in outputs and not any(LOADS[scene.load].kind == "face" for scene in scenes):
        problems.add(("outputs",), "'block' shows scenes under pressure and no grid has them; add load 'pressure'")
        problems.stop()
    if "definitions" in outputs and not moduli:
        problems.add(("outputs",), "'definitions' compares moduli and no grid has them; add 'moduli: true' to a grid")
        problems.stop()
    first, last, points = config.sensitivity.start, config.sensitivity.stop, config.sensitivity.points
    steps = [first + (last - first) * step / (points - 1) for step in range(points)]
    calibrated = config.definitions.calibrated
    return Study(
        title=config.title,
        meshes=meshes,
        scenes=scenes,
        curves=in_order(curves),
        references=references,
        moduli=moduli,
        patch=Beam("patch", config.patch.length, config.patch.height, 1.0) if moduli else None,
        outputs=outputs,
        further_references=tuple(name for name in FURTHER_REFERENCES if name in config.further_references),
        laying=laying,
        laying_references=laying_references,
        stability=stability,
        benchmark=benchmark,
        grids=grids,
        stiffness_ratios=tuple(COEFFICIENT * step for step in steps),
        stiffness_table={(row.mesh_type, row.material): row.value for row in _stated(config)},
        calibration=(calibrated.beam, calibrated.load) if calibrated else None,
        printed=_read_printed(about["printed_path"], _mesh_types(config), problems) if about["printed_path"] else (),
        axes=axes,
        **about,
    )


def _check_files(meshes, scenes, references, problems):
    """Different things must not share a name: names become files."""
    parts = {(scene.mesh.beam.name, scene.mesh.mesh_type, scene.material.name) for scene in scenes}
    pairs = {(reference.beam.name, reference.material.name) for reference in references}
    sizes = {mesh.mesh_size for mesh in meshes}
    for path, what, names, remedy in (
        (("grids",), "mesh sizes", [f"{1e3 * size:g} mm" for size in sizes], "merge them, names keep six digits"),
        (("beams",), "meshes", [mesh.name for mesh in meshes], "rename a beam"),
        (("materials",), "references", ["_".join(pair) for pair in pairs], "rename a beam or a material"),
        (("materials",), "scenes", ["_".join(part) for part in parts], "rename a beam or a material"),
    ):
        name, count = Counter(name.casefold() for name in names).most_common(1)[0]
        if count > 1:
            problems.add(path, f"{count} different {what} are all named '{name}'; {remedy}")
            return


# -- printed values ----------------------------------------------------------------------------------------------------

_PRINTED_COLUMNS = {
    # column: field and unit of PrintedCell; without unit, a text
    "table": ("table", ""),
    "beam": ("beam", None),
    "mesh_type": ("mesh_type", None),
    "mesh_size_mm": ("mesh_size", "1e-3"),
    "material": ("material", None),
    "load": ("load", None),
    "force_N": ("force", "1"),
    "stiffness_N_per_m": ("stiffness", "1"),
    "reference_displacement_mm": ("reference_displacement", "1e-3"),
    "displacement_mm": ("displacement", "1e-3"),
    "deformation_error_percent": ("deformation_error", "1e-2"),
    "remark": ("remark", None),
}


def _read_printed(path, mesh_types, problems):
    """Cells of a CSV file of printed values; lines that begin with # are comments."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except (OSError, ValueError) as error:
        why = "not UTF-8 text" if isinstance(error, UnicodeDecodeError) else getattr(error, "strerror", error)
        problems.add(("printed",), f"'{path}' cannot be read: {why}; give the path of a CSV file, or remove the key")
        problems.stop()
    file_problems = _Problems(str(path))
    # Empty lines in place of comments, so that the reader's line numbers are the file's.
    rows = csv.reader("\n" if line.startswith("#") else line for line in text.splitlines(keepends=True))
    cells, header = {}, None
    try:
        for row in rows:
            if row and header is None:
                header = row
                if sorted(header) != sorted(_PRINTED_COLUMNS):
                    wanted = ",".join(_PRINTED_COLUMNS)
                    file_problems.add((), f"has columns {','.join(header)}; give {wanted}", rows.line_num)
                    break
            elif row:
                cell = _printed_cell(header, row, mesh_types, rows.line_num, file_problems)
                if cell:
                    label = (cell.beam, cell.mesh_type, cell.mesh_size, cell.material, cell.load)
                    first = cells.setdefault(label, (rows.line_num, cell))[0]
                    if first != rows.line_num:
                        file_problems.add((), f"is the cell of line {first} again; remove one", rows.line_num)
    except csv.Error as error:
        file_problems.add((), f"not CSV: {error}; correct or remove the line", rows.line_num)
    if not cells:
        file_problems.add((), f"no printed values; give a line {','.join(_PRINTED_COLUMNS)} and a line for each cell")
    file_problems.stop()
    return tuple(cell for _, cell in cells.values())


def _printed_cell(header, row, mesh_types, line, problems):
    if len(row) != len(header):
        problems.add((), f"{len(row)} values for {len(header)} columns; add or remove some", line)
        return None
    values = {}
    for column, text in zip(header, row):
        field, size = _PRINTED_COLUMNS[column]
        known = {"mesh_type": mesh_types, "load": LOADS}.get(field)
        if size is None:
            values[field] = text
            if known and text not in known:
                problems.add((column,), f"unknown {field.replace('_', ' ')} '{text}'; {_nearest(text, known)}", line)
                return None
            continue
        try:
            values[field] = int(text) if field == "table" else float(Decimal(text) * Decimal(size))
            if not math.isfinite(values[field]) or values[field] < 0:
                raise ValueError
        except (ValueError, ArithmeticError):
            problems.add((column,), f"'{text}' is not a number of 0 or more; give the printed one, unsigned", line)
            return None
    return PrintedCell(**values)
