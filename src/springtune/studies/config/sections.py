"""Models of the sections of a study; the JSON schema and the tables of config/README.md are generated from them."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, ClassVar, NamedTuple, Self, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, create_model, model_validator
from pydantic.fields import FieldInfo

from springtune.mesh import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.problem.materials import MOST_TERMS, AnisotropicMaterial, AnyMaterial, Material
from springtune.problem.quantities import nearest
from springtune.registry import imported

from .fields import (
    Angle,
    BeamName,
    DefinitionName,
    Density,
    FileName,
    Flag,
    Forces,
    FurtherReference,
    Groups,
    Kinematics,
    Length,
    Lengths,
    LimitSeconds,
    Load,
    MaterialName,
    Memory,
    MeshType,
    Named,
    OneOrMore,
    OrthotropicRatio,
    PerBeam,
    Points,
    PoissonRatio,
    PoissonRatios,
    Ratio,
    Ratios,
    Sections,
    SignedStress,
    Stiffness,
    Stress,
    Stresses,
    Terms,
    Text,
    number,
    one_of,
)
from .kind import Kind, Output
from .messages import refuse, show

MOST_PARTS = 1000
"""Most parts that a study is split into."""

PLAUSIBLE = 20.0
"""A stated stiffness farther than this factor from sqrt(3)/2 E t is taken for an error of units."""


def expected_value(field: FieldInfo) -> str:
    """Words for what a field of a section expects, e.g. ``a length such as '200 mm'``."""
    # A field that may be absent has its notes one level deeper.
    for annotation, notes in ((field.annotation, field.metadata), *map(_parts, get_args(field.annotation))):
        for note in notes:
            if hasattr(note, "words"):
                return str(note.words)
            if isinstance(note, OneOrMore):
                item = get_args(annotation)[0]
                return f"{get_args(item)[1].words}, or a list"
    listed = get_origin(field.annotation) is list
    return "a list of sections; see below" if listed else "a section; see below"


def _parts(annotation: Any) -> tuple[Any, tuple[Any, ...]]:
    """What an `Annotated` annotates, and its notes; none of what is no such."""
    if get_origin(annotation) is not Annotated:
        return annotation, ()
    inside, *notes = get_args(annotation)
    return inside, tuple(notes)


class Section(BaseModel):
    """A mapping of known keys in a study."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, value: object) -> dict[str, object]:
        names = {field.alias or name: field for name, field in cls.model_fields.items()}
        if not isinstance(value, dict):
            raise refuse(f"{show(value)} instead of keys and values; give the keys {', '.join(names)}")
        for key in value:
            if key not in names:
                raise refuse(f"unknown key {show(key)}; {nearest(key, names)}", key)
        given = {key: content for key, content in value.items() if content is not None}
        for name, remedy in cls._needed(given).items():
            if name not in given:
                raise refuse(f"'{name}' is missing; give {expected_value(names[name])}{remedy}", name)
        return given

    @classmethod
    def _needed(cls, given: Mapping[str, object]) -> dict[str, str]:
        """Keys that have to be given beside those that are, and what else would do."""
        names = {field.alias or name: field for name, field in cls.model_fields.items()}
        return {name: "" for name, field in names.items() if field.is_required()}


def optional(section: Any, description: str) -> tuple[Any, Any]:
    """Type and field of a section that a study may leave out."""
    return section | None, Field(None, description=description)


class BeamConfig(Section):
    """A rectangular sheet, its length along x."""

    length: Length = Field(description="Extent along x, the direction of the load.")
    height: Length = Field(description="Extent along y.")
    thickness: Length = Field("1 mm", validate_default=True, description="Extent out of the plane.")


class StiffnessConfig(Section):
    """Stiffness of a sheet in plane stress, in the order xx, yy and xy with the shear angle; positive definite."""

    C11: Stress = Field(description="Stress along x for a strain along x.")
    C22: Stress = Field(description="Stress along y for a strain along y.")
    C12: SignedStress = Field(description="Stress along x for a strain along y.")
    C66: Stress = Field(description="Shear stress for a shear angle.")
    C16: SignedStress = Field("0 Pa", validate_default=True, description="Shear stress for a strain along x.")
    C26: SignedStress = Field("0 Pa", validate_default=True, description="Shear stress for a strain along y.")


MATERIAL_FORMS = (
    ("young_modulus", "poisson_ratio"),
    ("young_modulus_x", "young_modulus_y", "poisson_ratio_xy", "shear_modulus"),
    ("stiffness",),
    ("uniaxial_test",),
)
"""Keys that say what a material is: those of one form go together, and no other's with them."""


OF_A_TEST = ("terms", "equibiaxial_test", "pure_shear_test")
"""Keys that only a material with a test has."""


def _one_form(schema: dict[str, Any]) -> None:
    schema["oneOf"] = [{"required": list(form)} for form in MATERIAL_FORMS]


class MaterialConfig(Section):
    """A material, in one of four forms.

    Isotropic: `young_modulus` and `poisson_ratio`. Orthotropic, such as a ply of fibres: `young_modulus_x`,
    `young_modulus_y`, `poisson_ratio_xy` and `shear_modulus` along its own axes, turned by `angle`, or a laminate of
    such plies. Of any anisotropy: `stiffness`. Rubber: `uniaxial_test`, to which Yeoh's law is fitted; what knows
    small strain alone takes the law's initial modulus, and nu = 0.5. Beams are of isotropic ones or of rubber.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, json_schema_extra=_one_form)

    young_modulus: Stress | None = Field(None, description="Young's modulus E.")
    poisson_ratio: PoissonRatio | None = Field(
        None, description="Poisson's ratio nu; 0.5 is legal, since sheets are in plane stress."
    )
    young_modulus_x: Stress | None = Field(None, description="Young's modulus along the fibres.")
    young_modulus_y: Stress | None = Field(None, description="Young's modulus across the fibres.")
    poisson_ratio_xy: OrthotropicRatio | None = Field(
        None, description="Contraction across over extension along the fibres, pulled along them."
    )
    shear_modulus: Stress | None = Field(None, description="Shear modulus along and across the fibres.")
    angle: Annotated[list[Angle], OneOrMore(repeats=True)] | None = Field(
        None,
        description="By which the fibres are turned from the x axis, counter-clockwise; not at all without. Several "
        "are the plies of a laminate, of one thickness and symmetric stacking.",
    )
    stiffness: StiffnessConfig | None = Field(None, description="Its constants in plane stress.")
    uniaxial_test: FileName | None = Field(
        None,
        description="CSV file of a uniaxial test of rubber, its path relative to the study's folder: stretch and "
        "nominal stress under a head such as `stretch,nominal stress [MPa]`. Definition `yeoh` has its law.",
    )
    terms: Terms | None = Field(
        None, description="Terms of the law that is fitted to the test; 3 without, with 1 it is neo-Hooke's."
    )
    equibiaxial_test: FileName | None = Field(
        None, description="Such a file of an equibiaxial test, which the law is compared with."
    )
    pure_shear_test: FileName | None = Field(
        None, description="Such a file of a test in pure shear, which the law is compared with."
    )
    density: Density | None = Field(None, description="Density rho; for dynamics, statics need none.")

    @model_validator(mode="after")
    def _whole(self) -> Self:
        given = [[key for key in form if getattr(self, key) is not None] for form in MATERIAL_FORMS]
        keys = [keys for keys in given if keys]
        if len(keys) > 1:
            both = f"both '{keys[0][0]}' and '{keys[1][0]}', which are of two forms; a material is isotropic"
            raise refuse(f"{both}, orthotropic, has a stiffness or a test: keep the keys of one", keys[1][0])
        form = next((form for form, own in zip(MATERIAL_FORMS, given) if own), MATERIAL_FORMS[0])
        if self.angle is not None and form is not MATERIAL_FORMS[1]:
            raise refuse("turns the axes of an orthotropic material, and this is none; remove it", "angle")
        for key in OF_A_TEST:
            if getattr(self, key) is not None and form is not MATERIAL_FORMS[3]:
                raise refuse("goes with a 'uniaxial_test', and this material has none; remove it", key)
        for key in form:
            if getattr(self, key) is None:
                raise refuse(f"'{key}' is missing; give {expected_value(type(self).model_fields[key])}", key)
        if self.uniaxial_test is not None:
            return self  # files are read by who knows where they are
        try:
            self.material("material")
        except ValueError as error:
            raise refuse(str(error).removeprefix("material 'material': ")) from None
        return self

    def material(self, name: str, folder: Path = Path()) -> AnyMaterial:
        """The material; the names of its files are seen from a folder. ValueError where a file is no test."""
        if self.uniaxial_test is not None:
            from springtune.problem.rubber import fit_rubber  # here: few studies need it

            others = {"equibiaxial": self.equibiaxial_test, "pure_shear": self.pure_shear_test}
            return fit_rubber(
                folder / self.uniaxial_test,
                **{key: folder / file for key, file in others.items() if file is not None},
                terms=self.terms or MOST_TERMS,
                density=self.density,
                name=name,
            )
        if self.young_modulus is not None and self.poisson_ratio is not None:
            return Material(self.young_modulus, self.poisson_ratio, self.density, name)
        if self.stiffness is not None:
            return AnisotropicMaterial(**self.stiffness.model_dump(), density=self.density, name=name)
        own = {key: getattr(self, key) for key in MATERIAL_FORMS[1]}
        angles = self.angle or [0.0]
        if len(angles) == 1:
            return AnisotropicMaterial.orthotropic(**own, angle=angles[0], density=self.density, name=name)
        ply = AnisotropicMaterial.orthotropic(**own)
        return AnisotropicMaterial.laminate([(ply, angle, 1.0) for angle in angles], self.density, name)


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
    def _listed(cls, value: object) -> object:
        rows = value.get("stiffness") if isinstance(value, dict) else None
        if rows is not None and (not isinstance(rows, list) or not rows):
            example = "- {mesh_type: structured, material: steel, value: 170e6 N/m}"
            raise refuse(f"{show(rows)} instead of a list; give entries such as {example}", "stiffness")
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


class LimitsConfig(Section):
    """What one scene may take, or one mesh, curve, reference or other task: one beyond it is a hole, the others go on.

    Results do not depend on limits; where they change, what went beyond them is computed again, and nothing else.
    """

    seconds: LimitSeconds = Field(
        "3600", validate_default=True, description="Seconds of the processor, which a busy machine does not change."
    )
    memory: Memory = Field("8 GB", validate_default=True, description="Memory on top of what the job has.")


class MeshFileConfig(Section):
    """One mesh from a file, of a format that meshio reads; it fills its beam and its lower left corner is anywhere."""

    file: FileName = Field(description="The file, its path relative to the study's folder.")
    beam: BeamName = Field(description="Beam that it meshes.")
    mesh_size: Length = Field(description="Length of an edge that it goes by in grids and in the dataset.")
    unit: Length = Field("1 m", validate_default=True, description="Unit of the coordinates in the file.")


GRID_PARAMETERS = (
    "beam",
    "mesh_type",
    "mesh_size",
    "material",
    "load",
    "force",
    "pressure",
    "thickness",
    "young_modulus",
    "poisson_ratio",
    "stiffness_scale",
    "definition",
    "kinematics",
)
"""Parameters of a grid: its keys whose values are combined."""


class ExcludeConfig(Section):
    """Combinations that a grid leaves out: those that have one of the values given, of every parameter given."""

    beam: Annotated[list[BeamName], OneOrMore()] | None = Field(None, description="Beams.")
    mesh_type: Annotated[list[MeshType], OneOrMore()] | None = Field(None, description="Mesh types.")
    mesh_size: Lengths | None = Field(None, description="Lengths of an edge.")
    material: Annotated[list[MaterialName], OneOrMore()] | None = Field(None, description="Materials.")
    load: Annotated[list[Load], OneOrMore()] | None = Field(None, description="Loads.")
    force: Forces | None = Field(None, description="Magnitudes of the force.")
    pressure: Stresses | None = Field(None, description="Pressures.")
    thickness: Lengths | None = Field(None, description="Thicknesses.")
    young_modulus: Stresses | None = Field(None, description="Young's moduli.")
    poisson_ratio: PoissonRatios | None = Field(None, description="Poisson's ratios.")
    stiffness_scale: Ratios | None = Field(None, description="Scales of the stiffness.")
    definition: Annotated[list[DefinitionName], OneOrMore()] | None = Field(None, description="Definitions.")
    kinematics: Annotated[list[Kinematics], OneOrMore()] | None = Field(None, description="Kinematics.")

    @model_validator(mode="after")
    def _something(self) -> Self:
        if all(getattr(self, name) is None for name in GRID_PARAMETERS):
            raise refuse("no parameter at all would leave nothing; give values of one such as {mesh_size: 1 mm}")
        return self


def _rows_may_give(schema: dict[str, Any]) -> None:
    """What a grid needs may come from its file of rows, and a value may stand twice where it is zipped."""
    schema["anyOf"] = [{"required": schema.pop("required")}, {"required": ["rows"]}]
    once = {name: {"uniqueItems": True} for name in GRID_PARAMETERS}
    schema |= {"if": {"not": {"required": ["zip"]}}, "then": {"properties": once}}


class GridConfig(Section):
    """A product of parameters: every combination of the values listed is a scene.

    A single value stands for a list of one. A scene that two grids ask for is solved once. Numbers may be a range, both
    ends included: `{from: 1 mm, to: 5 mm, points: 9}`, with `spacing: logarithmic` where they are to grow by a factor.

    What a grid says of `thickness`, `young_modulus`, `poisson_ratio` or `stiffness_scale`, and a force that has several
    values, is a dimension of the dataset, beside `beam`, `mesh_type`, `mesh_size`, `material`, `load`, `definition` and
    `kinematics`.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, json_schema_extra=_rows_may_give)

    beam: Annotated[list[BeamName], OneOrMore(repeats=True)] = Field(description="Beams, by name.")
    mesh_type: Annotated[list[MeshType], OneOrMore(repeats=True)] = Field(
        description="A name under `mesh_files`, or one of these. "
        + " ".join(f"`{name}`: {one.summary}." for name, one in MESH_TYPES.items())
    )
    mesh_size: Lengths = Field(description="Lengths of an edge; at most the smaller side of each beam.")
    material: Annotated[list[MaterialName], OneOrMore(repeats=True)] = Field(description="Materials, by name.")
    load: Annotated[list[Load], OneOrMore(repeats=True)] = Field(
        description="`traction`, `compression`: along x on the right end, `bending`: along y there, the left end "
        "clamped; `shear`: along x on the upper side, which stays level, the lower side clamped; `pressure`, "
        "`follower-pressure`: down on the upper side, the lower side clamped. Spread evenly."
    )
    force: Annotated[dict[str, Forces], PerBeam()] | None = Field(
        None,
        description="Magnitude of the force: one for all beams, or one for each. The load's name carries the sign. "
        "Several make the force a dimension; where no grid has several, a beam, material and load have the same force "
        "in all grids.",
    )
    pressure: Stresses | None = Field(
        None,
        description="Pressure on the upper side, in place of `force`; for loads `pressure` and `follower-pressure`.",
    )
    thickness: Lengths | None = Field(None, description="Thicknesses, in place of the beams' own.")
    young_modulus: Stresses | None = Field(None, description="Young's moduli, in place of the materials' own.")
    poisson_ratio: PoissonRatios | None = Field(None, description="Poisson's ratios, in place of the materials' own.")
    stiffness_scale: Ratios | None = Field(
        None, description="Factors on all stiffnesses that a definition gives, its energies' included."
    )

    @model_validator(mode="after")
    def _one_force(self) -> Self:
        if (self.force is None) == (self.pressure is None):
            both = "both 'force' and 'pressure'; remove one"
            pressed = all(LOADS[load].kind.pressed for load in self.load)
            remedy = "one for each beam" + (", or 'pressure'" if pressed else "")
            missing = f"'force' is missing; give a force such as '400 kN', or {remedy}"
            raise refuse(missing if self.force is None else both, *(() if self.force is None else ("pressure",)))
        for load in self.load if self.pressure is not None else ():
            if not LOADS[load].kind.pressed:
                raise refuse(f"load '{load}' has no pressed side; give 'force', or loads under pressure", "pressure")
        return self

    definition: Annotated[list[DefinitionName], OneOrMore(repeats=True)] = Field(
        description="Rules that give every spring its stiffness; `springtune definitions` explains them."
    )
    kinematics: Annotated[list[Kinematics], OneOrMore(repeats=True)] = Field(
        "nonlinear",
        validate_default=True,
        description="Whether springs keep their length law or their tangent at rest.",
    )
    zip: Annotated[list[list[str]], Groups(GRID_PARAMETERS)] = Field(
        [],
        description="Parameters that go together, such as `[mesh_size, force]`: the first value of one with the first "
        "of the other, and so on, in place of all with all. A list of such lists for several groups.",
    )
    exclude: Annotated[list[ExcludeConfig], Sections()] = Field(
        [],
        description="Combinations that are left out, such as `{mesh_type: free, mesh_size: 1 mm}`; a list for several.",
    )
    rows: FileName | None = Field(
        None,
        description="CSV file of combinations, its path relative to the study's folder: a column a parameter, named as "
        "its key, a row a combination. A unit stands beside each number (`5 mm`), or in the head (`mesh_size [mm]`). "
        "What the file has not is combined with each row.",
    )
    sensitivity: Flag = Field(
        "true",
        validate_default=True,
        description="Whether each mesh, material, load and kinematics also gets a sensitivity curve. "
        "Curves that `calibrated` needs are made in any case.",
    )


DEALT_BY = ("mesh", "grid")
"""What stays together where a study is split."""


PartNumber = Annotated[int, number("a whole number from 1, such as 2", 1, MOST_PARTS, whole=True)]
PartCount = Annotated[int, number("a whole number from 2, such as 3", 2, MOST_PARTS, whole=True)]
DealtBy = Annotated[str, one_of("way to split", DEALT_BY)]


class PartConfig(Section):
    """Which part of a study this file asks for; `springtune split` writes it, and nobody by hand."""

    number: PartNumber = Field(description="Which one of the parts.")
    of: PartCount = Field(description="Number of parts.")
    by: DealtBy = Field(
        "mesh",
        validate_default=True,
        description="What stays together: the scenes of a `mesh`, but of one that alone is more than a part, or those "
        "of a `grid`.",
    )
    study: Text = Field(description="SHA-256 of the whole study: of what stands above this section's comment.")

    @model_validator(mode="after")
    def _among_them(self) -> Self:
        if self.number > self.of:
            raise refuse(f"{self.number} is more than the {self.of} parts; give a number from 1 to {self.of}", "number")
        return self


class StudyConfig(Section):
    """A study."""

    title: Text = Field(description="What the study is, in one line.")
    beams: Annotated[dict[str, BeamConfig], Named("beam")] = Field({}, description="Beams; needed by grids.")
    materials: Annotated[dict[str, MaterialConfig], Named("material")] = Field(description="Materials.")
    definitions: DefinitionsConfig = Field(
        default_factory=DefinitionsConfig, description="Parameters of the definitions that have any."
    )
    sensitivity: SensitivityConfig = Field(
        default_factory=SensitivityConfig, description="Range of stiffness of the sensitivity curves."
    )
    mesh_files: Annotated[dict[str, list[MeshFileConfig]], Named("mesh type")] | None = Field(
        None, description="Mesh types of your own: for each a list of files, one for each beam and mesh size."
    )
    outputs: list[str] = Field([], validate_default=False)
    further_references: Annotated[list[FurtherReference], OneOrMore()] = Field(
        [],
        description="References at finite strain besides the small-strain one, for every beam, material and load: in "
        "the group `/finite_strain` with the networks' errors, and under pressure in `/block`, too. They take seconds "
        "each. An incompressible material has none in plane strain. A material with a `uniaxial_test` has "
        "'yeoh-plane-stress', of the law that is fitted to it, and no other has.",
    )
    limits: LimitsConfig = Field(default_factory=LimitsConfig, description="What one scene may take.")
    printed: FileName | None = Field(
        None, description="CSV file of printed values to compare with, its path relative to the study's folder."
    )
    grids: dict[str, GridConfig] = Field({})
    part: PartConfig | None = Field(
        None, description="Which part of the study above is asked for; as `springtune split` writes it."
    )

    alone: ClassVar[dict[str, tuple[str, ...]]] = {}
    """Keys of study kinds in the place of which a study may have neither beams nor grids, and what goes with each."""

    @classmethod
    def _needed(cls, given: Mapping[str, object]) -> dict[str, str]:
        found = super()._needed(given)
        if "grids" in given or not set(cls.alone) & set(given):
            begun = [name for name, others in cls.alone.items() if set(others) & set(given)]
            if begun and not {"beams", "grids"} & set(given):
                found |= dict.fromkeys(begun, "")
            else:
                ways = [" and ".join(f"'{name}'" for name in (*others, key)) for key, others in cls.alone.items()]
                instead = "".join(f", or {way}" for way in ways)
                found |= {"beams": "" if "grids" in given else instead, "grids": instead}
        return {name: found[name] for name in cls.model_fields if name in found}


def _beams_or(alone: Iterable[str]) -> dict[str, Any]:
    """What the schema of a study says besides: which keys it has without beams and grids."""
    return {"anyOf": [{"required": ["beams", "grids"]}, *({"required": [name]} for name in alone)]}


class Later(NamedTuple):
    """Type of a field that is imported for studies that have it: sections cost milliseconds each."""

    module: str
    name: str

    def type(self) -> Any:
        """The type."""
        return imported(f"{self.module}:{self.name}")


def study_model(kinds: Sequence[Kind], given: Container[object] | None = None) -> type[StudyConfig]:
    """Model of a study: `StudyConfig` and the keys that study kinds add to it and to its grids."""
    # Of each field its type and pydantic's description.
    grid_fields: dict[str, Any] = {}
    study_fields: dict[str, Any] = {}
    outputs: list[Output] = []
    for kind in kinds:
        grid_fields |= kind.grid_fields
        for name, (annotation, field) in kind.study_fields.items():
            absent = given is not None and name not in given and field.default is None
            if isinstance(annotation, Later) and not absent:
                annotation = annotation.type()
            study_fields[name] = NoneType if absent else annotation, field
        outputs += kind.outputs
    grid = create_model("GridConfig", __base__=GridConfig, **grid_fields)
    grid.__doc__ = GridConfig.__doc__
    meanings = "; ".join(f"`{output.name}`: {output.meaning}" for output in outputs)
    output_name = Annotated[str, one_of("output", [output.name for output in outputs])]
    study_fields["outputs"] = (
        Annotated[list[output_name], OneOrMore()],
        Field(
            [output.name for output in outputs if output.usual],
            validate_default=False,
            description=f"What is made from the dataset: {meanings}. "
            "Figures of scenes are of nonlinear kinematics where a grid has them, else of linear ones.",
        ),
    )
    study_fields["grids"] = (
        Annotated[dict[str, grid], Named("grid", for_files=False)],
        Field({}, description="Grids: what is to be computed."),
    )
    model = create_model("StudyConfig", __base__=StudyConfig, **study_fields)
    model.__doc__ = StudyConfig.__doc__
    model.alone = {
        name: tuple(other for other in kind.study_fields if other not in kind.alone)
        for kind in kinds
        for name in kind.alone
    }
    model.model_config["json_schema_extra"] = _beams_or(model.alone)
    return model


def sections(model: type[Section], place: str = "") -> dict[str, type[Section]]:
    """Model of each section of a study, by its place."""
    found = {place: model}
    for name, field in model.model_fields.items():
        for inside, ending in _models(field.annotation):
            found |= sections(inside, f"{place}.{name}".lstrip(".") + ending)
    return found


def _models(annotation: object, ending: str = "") -> Iterator[tuple[type[Section], str]]:
    """Sections inside an annotation, and what follows the key to lead to them."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation, ending
    origin = get_origin(annotation)
    ending += ".<name>" if origin is dict else "[]" if origin is list else ""
    for part in get_args(annotation):
        yield from _models(part, ending)


def json_schema(model: type[StudyConfig]) -> dict[str, Any]:
    """JSON schema of a study, for editors."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | model.model_json_schema()
