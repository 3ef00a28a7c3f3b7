"""Models of the sections of a study; the JSON schema and the tables of config/README.md are generated from them."""

import json
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, ConfigDict, Field, WithJsonSchema, create_model, model_validator

from springtune.mesh.types import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.problem.materials import INCOMPRESSIBLE, MOST_TERMS, AnisotropicMaterial, AnyMaterial, Material

from . import fields
from .fields import Named, OneOrMore, Section, default, one_of
from .kind import Kind, kinds
from .messages import refuse, words

PLAUSIBLE = 20.0
"""Factor on sqrt(3)/2 E t beyond which a stated stiffness counts as an error of units."""


class BeamConfig(Section):
    """A rectangular sheet, its length along x."""

    length: fields.Length
    """Extent along x, the direction of the load."""

    height: fields.Length
    """Extent along y."""

    thickness: fields.Length = default("1 mm")
    """Extent out of the plane."""


class StiffnessConfig(Section):
    """Stiffness of a sheet in plane stress, in the order xx, yy and xy with the shear angle; positive definite."""

    C11: fields.Stress
    """Stress along x for a strain along x."""

    C22: fields.Stress
    """Stress along y for a strain along y."""

    C12: fields.SignedStress
    """Stress along x for a strain along y."""

    C66: fields.Stress
    """Shear stress for a shear angle."""

    C16: fields.SignedStress = default("0 Pa")
    """Shear stress for a strain along x."""

    C26: fields.SignedStress = default("0 Pa")
    """Shear stress for a strain along y."""


MATERIAL_FORMS = (
    ("young_modulus", "poisson_ratio"),
    ("young_modulus_x", "young_modulus_y", "poisson_ratio_xy", "shear_modulus"),
    ("stiffness",),
    ("uniaxial_test",),
)
"""Keys of the four forms of a material; a material has the keys of one form."""


OF_A_TEST = ("terms", "equibiaxial_test", "pure_shear_test")


def _one_form(schema: dict[str, Any]) -> None:
    schema["oneOf"] = [{"required": list(form)} for form in MATERIAL_FORMS]


class MaterialConfig(Section):
    """A material, in one of four forms.

    Isotropic: `young_modulus` and `poisson_ratio`. Orthotropic, such as a ply of fibres: `young_modulus_x`,
    `young_modulus_y`, `poisson_ratio_xy` and `shear_modulus` along its own axes, which `angle` turns; several angles
    make a laminate. Any anisotropy: `stiffness`. Rubber: `uniaxial_test`, to which Yeoh's law is fitted; in small
    strain it has the initial modulus of that law and nu = 0.5. Beams need an isotropic material or rubber.
    """

    model_config = ConfigDict(json_schema_extra=_one_form)

    young_modulus: fields.Stress | None = None
    """Young's modulus E."""

    poisson_ratio: fields.PoissonRatio | None = None
    """Poisson's ratio nu; 0.5 is allowed in plane stress."""

    plane: fields.Plane | None = None
    """'stress' of a thin sheet, the default, or 'strain' of a slice of a long body; E and nu are those of the
    material in three dimensions in both. Isotropic materials alone."""

    young_modulus_x: fields.Stress | None = None
    """Young's modulus along the fibres."""

    young_modulus_y: fields.Stress | None = None
    """Young's modulus across the fibres."""

    poisson_ratio_xy: fields.OrthotropicRatio | None = None
    """Contraction across the fibres over extension along them, when pulled along them."""

    shear_modulus: fields.Stress | None = None
    """Shear modulus along and across the fibres."""

    angle: fields.Angles | None = None
    """Angle of the fibres from the x axis, counter-clockwise; 0 by default. Several angles are the plies of a
    laminate of equal thicknesses and symmetric stacking."""

    stiffness: StiffnessConfig | None = None
    """Elastic constants in plane stress."""

    uniaxial_test: fields.FileName | None = None
    """CSV file of a uniaxial test of rubber, relative to the study's folder: stretch or strain and nominal stress
    under a head such as `stretch,nominal stress [MPa]` or `strain [%],nominal stress [MPa]`. Definition `yeoh` uses
    the fitted law."""

    terms: fields.Terms | None = None
    """Number of terms of the fitted law; 3 by default, 1 is the neo-Hookean law."""

    equibiaxial_test: fields.FileName | None = None
    """CSV file of an equibiaxial test, to compare the fitted law with."""

    pure_shear_test: fields.FileName | None = None
    """CSV file of a pure-shear test, to compare the fitted law with."""

    density: fields.Density | None = None
    """Density rho; needed for dynamics and gravity, not for statics."""

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
        if self.plane is not None and form is not MATERIAL_FORMS[0]:
            raise refuse("is for isotropic materials; remove it, and give a 'stiffness' in plane strain", "plane")
        for key in OF_A_TEST:
            if getattr(self, key) is not None and form is not MATERIAL_FORMS[3]:
                raise refuse("goes with a 'uniaxial_test', and this material has none; remove it", key)
        if self.plane == "strain" and self.poisson_ratio == 0.5:
            raise refuse(f"is {INCOMPRESSIBLE}", "poisson_ratio")
        for key in form:
            if getattr(self, key) is None:
                raise refuse(f"'{key}' is missing; give {words(type(self).model_fields[key])}", key)
        if self.uniaxial_test is not None:
            return self  # files are read by who knows where they are
        try:
            self.material("material")
        except ValueError as error:
            raise refuse(str(error).removeprefix("material 'material': ")) from None
        return self

    def material(self, name: str, folder: Path = Path()) -> AnyMaterial:
        """The material; its files are relative to a folder. Raises ValueError for a file that is not a test."""
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
            return Material(self.young_modulus, self.poisson_ratio, self.density, name, self.plane or "stress")
        if self.stiffness is not None:
            return AnisotropicMaterial(**self.stiffness.model_dump(), density=self.density, name=name)
        own = {key: getattr(self, key) for key in MATERIAL_FORMS[1]}
        angles = self.angle or [0.0]
        if len(angles) == 1:
            return AnisotropicMaterial.orthotropic(**own, angle=angles[0], density=self.density, name=name)
        ply = AnisotropicMaterial.orthotropic(**own)
        return AnisotropicMaterial.laminate([(ply, angle, 1.0) for angle in angles], self.density, name)


class StatedStiffness(Section):
    """A stated stiffness of one mesh type and material."""

    mesh_type: fields.MeshType
    """Mesh type."""

    material: fields.MaterialName
    """Material."""

    value: fields.Stiffness = Field(
        description=f"Stiffness of every spring; refused beyond a factor of {PLAUSIBLE:g} from sqrt(3)/2 E t."
    )


class PaperConfig(Section):
    """Parameters of the definition `paper`: stated stiffnesses."""

    stiffness: list[StatedStiffness] = Field(
        min_length=1, title="a list such as [{mesh_type: structured, material: steel, value: 170e6 N/m}]"
    )
    """One entry for each mesh type and material of the grids with `paper`."""


class CalibratedConfig(Section):
    """Parameters of the definition `calibrated`.

    For each mesh type, material and kinematics, the stiffness is the mean of the best stiffnesses of the study's
    sensitivity curves of one beam and load, over all mesh sizes.
    """

    beam: fields.BeamName
    """Beam whose curves calibrate."""

    load: fields.Load
    """Load whose curves calibrate."""


class DefinitionsConfig(Section):
    """Parameters of the two definitions that need some; `springtune definitions` lists all definitions."""

    paper: PaperConfig | None = None
    """Stated stiffnesses; needed if a grid uses `paper`."""

    calibrated: CalibratedConfig | None = None
    """Beam and load to calibrate on; needed if a grid uses `calibrated`."""


class SensitivityConfig(Section):
    """Equally spaced stiffnesses of every sensitivity curve, as multiples of sqrt(3)/2 E t."""

    start: fields.Ratio = default("0.4", alias="from")
    """Smallest stiffness."""

    stop: fields.Ratio = default("1.6", alias="to")
    """Largest stiffness."""

    points: fields.Points = default("61")
    """Number of stiffnesses, both ends included."""

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        if not self.start < self.stop:
            raise refuse(f"{self.start:g} is not below 'to', {self.stop:g}; give a smaller 'from'", "from")
        return self


class MeshFileConfig(Section):
    """A mesh from a file that meshio reads. It fills its beam; its lower left corner may be anywhere."""

    file: fields.FileName
    """The file, relative to the study's folder."""

    beam: fields.BeamName
    """Beam that the mesh fills."""

    mesh_size: fields.Length
    """Length of an edge, which names the mesh in grids and in the dataset."""

    unit: fields.Length = default("1 m")
    """Unit of the coordinates in the file."""


def _rows_may_give(schema: dict[str, Any]) -> None:
    """Required keys may come from a file of rows."""
    schema["anyOf"] = [{"required": schema.pop("required")}, {"required": ["rows"]}]


class GridConfig(Section):
    """A product of parameters: every combination of the listed values is a scene.

    A single value is a list of one. A scene of two grids is solved once. Numbers may be a range with both ends
    included: `{from: 1 mm, to: 5 mm, points: 9}`; with `spacing: logarithmic` the values grow by a constant factor.

    The dimensions of the dataset are `beam`, `mesh_type`, `mesh_size`, `material`, `load`, `definition` and
    `kinematics`. A grid that gives `thickness`, `young_modulus`, `poisson_ratio`, `stiffness_scale` or several forces
    adds these as dimensions.
    """

    model_config = ConfigDict(json_schema_extra=_rows_may_give)

    beam: OneOrMore[fields.BeamName]
    """Beams, by name."""

    mesh_type: OneOrMore[fields.MeshType] = Field(
        description="A name under `mesh_files`, or one of these. "
        + " ".join(f"`{name}`: {one.summary}." for name, one in MESH_TYPES.items())
    )
    mesh_size: fields.Lengths
    """Lengths of an edge, at most the smaller side of each beam."""

    material: OneOrMore[fields.MaterialName]
    """Materials, by name."""

    load: OneOrMore[fields.Load]
    """With the left end clamped, `traction` and `compression` act along x on the right end, `bending` along y. With
    the lower side clamped, `shear` acts along x on the upper side, which stays level, and `pressure` and
    `follower-pressure` act down on it. All are spread evenly."""

    force: fields.BeamForces | None = None
    """Magnitude of the force, for all beams or for each; the load gives its sign. Several values make the force a
    dimension. Otherwise a beam, material and load have the same force in all grids."""

    pressure: fields.Stresses | None = None
    """Pressure on the upper side instead of `force`, for the loads `pressure` and `follower-pressure`."""

    thickness: fields.Lengths | None = None
    """Thicknesses instead of the beams' own."""

    young_modulus: fields.Stresses | None = None
    """Young's moduli instead of the materials' own."""

    poisson_ratio: fields.PoissonRatios | None = None
    """Poisson's ratios instead of the materials' own."""

    stiffness_scale: fields.Ratios | None = None
    """Factors on all stiffnesses of a definition, including its energies."""

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

    definition: OneOrMore[fields.DefinitionName]
    """Rules for the stiffness of every spring; `springtune definitions` lists them."""

    kinematics: OneOrMore[fields.Kinematics] = default("nonlinear")
    """`nonlinear`: springs keep their length law. `linear`: they keep their tangent at rest."""

    rows: Annotated[list[str], WithJsonSchema({"type": "string"}), Field(title="the path of a CSV file")] = []
    """CSV file of combinations, relative to the study's folder: one column for each parameter, named as its key,
    and one row for each combination, such as a mesh size with its own force. Units stand beside the numbers (`5 mm`)
    or in the head (`mesh_size [mm]`). Other parameters of the grid are combined with each row."""

    sensitivity: fields.Flag = default("true")
    """Whether each mesh, material, load and kinematics gets a sensitivity curve. Curves that `calibrated` needs are
    always computed."""


GRID_PARAMETERS = tuple(name for name in GridConfig.model_fields if name not in ("rows", "sensitivity"))
"""Keys of a grid whose values are combined."""


def _own_names(files: dict[str, Any]) -> dict[str, Any]:
    for name in files:
        if name in MESH_TYPES:
            raise refuse(f"'{name}' is a mesh type that is made; rename yours", name)
    return files


class StudyConfig(Section):
    """A study."""

    title: fields.Text
    """Title of the study, one line."""

    beams: Named[BeamConfig] = Field({}, title="a section for each beam, by name")
    """Beams that grids and sections name."""

    materials: Named[MaterialConfig] = Field({}, title="a section for each material, by name")
    """Materials that grids and sections name."""

    definitions: DefinitionsConfig = Field(default_factory=DefinitionsConfig)
    """Parameters of the definitions `paper` and `calibrated`."""

    sensitivity: SensitivityConfig = Field(default_factory=SensitivityConfig)
    """Range of stiffness of the sensitivity curves."""

    mesh_files: Annotated[Named[list[MeshFileConfig]], AfterValidator(_own_names)] | None = Field(
        None, title="a list of files for each mesh type, by name"
    )
    """Your own mesh types: for each a list of files, one for each beam and mesh size."""

    outputs: list[str] = Field([])
    further_references: OneOrMore[fields.FurtherReference] = []
    """References at finite strain for every beam, material and load, besides the one of small strain. The group
    `/finite_strain` has them and the networks' errors; under pressure `/block` has them, too. Each takes seconds.
    Incompressible materials have none in plane strain. 'yeoh-plane-stress' needs a material with a `uniaxial_test`
    and uses its fitted law."""

    printed: fields.FileName | None = None
    """CSV file of printed values to compare with, relative to the study's folder."""

    grids: dict[str, GridConfig] = Field({})

    alone: ClassVar[dict[str, tuple[str, ...]]] = {}
    """Keys of study kinds that a study may have instead of grids, and the keys that each needs."""

    @model_validator(mode="before")
    @classmethod
    def _something(cls, value: Any) -> Any:
        """Refuse a study of no grids nor a section that may stand alone, and one that lacks what these need."""
        if not isinstance(value, dict):
            return value
        ways = {"grids": GRIDS_NEED} | cls.alone
        given = {key for key, content in value.items() if content is not None}
        needed = {name for way in given & {*ways} for name in ways[way]} if given & {*ways} else {"grids"}
        for name in sorted(needed - given if given <= {*cls.model_fields} else ()):
            others = f", or {', '.join(map(repr, cls.alone))}" if name == "grids" else ""
            raise refuse(f"'{name}' is missing; give {words(cls.model_fields[name])}{others}", name)
        return value


GRIDS_NEED = ("beams", "materials")


@cache
def study_model(kinds: tuple[Kind, ...]) -> type[StudyConfig]:
    """Model of a study: `StudyConfig` and the keys that study kinds add to it and to its grids."""
    made = [output for kind in kinds for output in kind.outputs]
    own: dict[str, Any] = {name: field for kind in kinds for name, field in kind.grid_fields.items()}
    grid = create_model("GridConfig", __base__=GridConfig, __doc__=GridConfig.__doc__, **own)
    added: dict[str, Any] = {name: field for kind in kinds for name, field in kind.study_fields.items()}
    alone: dict[str, tuple[str, ...]] = {}
    for kind in kinds:
        optional_keys = (name for name, (_, field) in kind.study_fields.items() if field.default is None)
        alone |= kind.alone or dict.fromkeys(optional_keys, GRIDS_NEED)
    meanings = "; ".join(f"`{output.name}`: {output.meaning}" for output in made)
    added["outputs"] = (
        OneOrMore[Annotated[str, *one_of("output", [output.name for output in made])]],
        Field(
            [output.name for output in made if output.usual],
            description=f"Figures and tables of the dataset: {meanings}. "
            "Figures of scenes show nonlinear kinematics if a grid has them, otherwise linear ones.",
        ),
    )
    listed = ", ".join(f"`{name}`" for name in alone)
    added["grids"] = (
        dict[str, grid],
        Field(
            {},
            min_length=1,
            title="a section for each grid, by name",
            description=f"Grids of scenes to compute. A study with one of {listed} needs none.",
        ),
    )
    model = create_model("StudyConfig", __base__=StudyConfig, __doc__=StudyConfig.__doc__, **added)
    model.alone = alone
    ways = {"grids": GRIDS_NEED} | alone
    model.model_config["json_schema_extra"] = {"anyOf": [{"required": [*needed, key]} for key, needed in ways.items()]}
    return model


def schema_text() -> str:
    """JSON schema of studies, for editors."""
    schema = study_model(kinds()).model_json_schema()
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema"} | schema, indent=2) + "\n"
