"""Models of the sections of a study; the JSON schema and the tables of config/README.md are generated from them."""

from collections.abc import Iterator
from functools import cache
from itertools import chain, product
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, ConfigDict, Field, WithJsonSchema, create_model, model_validator

from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.problem.materials import INCOMPRESSIBLE_REASON, MOST_TERMS, AnisotropicMaterial, AnyMaterial, Material

from . import fields
from .fields import Named, OneOrMore, Section, default, one_of
from .messages import refuse, words
from .model import StudyKind


class BeamConfig(Section):
    """A rectangular sheet, its length along x."""

    length: fields.Length
    """Along x, the direction of the load."""

    height: fields.Length
    """Along y."""

    thickness: fields.Length = default("1 mm")
    """Out of the plane."""


class StiffnessConfig(Section):
    """Stiffness of a sheet in plane stress; the matrix is positive definite."""

    C11: fields.Stress
    """From strain along x to stress along x."""

    C22: fields.Stress
    """From strain along y to stress along y."""

    C12: fields.SignedStress
    """From strain along y to stress along x."""

    C66: fields.Stress
    """From shear angle to shear stress."""

    C16: fields.SignedStress = default("0 Pa")
    """From strain along x to shear stress."""

    C26: fields.SignedStress = default("0 Pa")
    """From strain along y to shear stress."""


MATERIAL_FORMS = (
    ("young_modulus", "poisson_ratio"),
    ("young_modulus_x", "young_modulus_y", "poisson_ratio_xy", "shear_modulus"),
    ("stiffness",),
    ("uniaxial_test",),
)
"""Keys of the four forms of a material; a material has the keys of one form."""


class MaterialConfig(Section):
    """A material, in one of four forms.

    Isotropic: `young_modulus` and `poisson_ratio`. Orthotropic: `young_modulus_x`, `young_modulus_y`,
    `poisson_ratio_xy` and `shear_modulus`. Any anisotropy: `stiffness`. Rubber: `uniaxial_test`, to which Yeoh's law
    is fitted; in small strain it has its initial modulus and nu = 0.5. Beams need an isotropic material or rubber.
    """

    model_config = ConfigDict(json_schema_extra={"oneOf": [{"required": [*form]} for form in MATERIAL_FORMS]})

    young_modulus: fields.Stress | None = None
    """Young's modulus E."""

    poisson_ratio: fields.PoissonRatio | None = None
    """Poisson's ratio nu; 0.5 is allowed in plane stress."""

    plane: fields.Plane | None = None
    """Plane stress (a thin sheet, the default) or plane strain (a slice of a long body), of an isotropic material. E
    and nu are three-dimensional in both."""

    young_modulus_x: fields.Stress | None = None
    """Young's modulus along the fibres."""

    young_modulus_y: fields.Stress | None = None
    """Young's modulus across the fibres."""

    poisson_ratio_xy: fields.OrthotropicRatio | None = None
    """Contraction across the fibres over extension along them."""

    shear_modulus: fields.Stress | None = None
    """Shear modulus along and across the fibres."""

    angle: fields.Angles | None = None
    """Angle from the x axis to the fibres, counter-clockwise; 0 by default. Several angles make a symmetric laminate of
    equal plies."""

    stiffness: StiffnessConfig | None = None
    """Elastic constants in plane stress."""

    uniaxial_test: fields.FileName | None = None
    """CSV file of a uniaxial test of rubber, with a head such as `stretch,nominal stress [MPa]` or
    `strain [%],nominal stress [MPa]`. The definition `yeoh` uses the fitted law."""

    terms: fields.Terms | None = None
    """Terms of the fitted law; 3 by default; 1 is the neo-Hookean law."""

    equibiaxial_test: fields.FileName | None = None
    """CSV file of an equibiaxial test, to check the law."""

    pure_shear_test: fields.FileName | None = None
    """CSV file of a pure-shear test, to check the law."""

    density: fields.Density | None = None
    """Density, needed for dynamics and gravity."""

    @model_validator(mode="after")
    def _check_form(self) -> Self:
        given = [[key for key in form if getattr(self, key) is not None] for form in MATERIAL_FORMS]
        keys = [keys for keys in given if keys]
        if len(keys) > 1:
            both = f"both '{keys[0][0]}' and '{keys[1][0]}', which are of two forms; a material is isotropic"
            raise refuse(f"{both}, orthotropic, has a stiffness or a test: keep the keys of one", keys[1][0])
        form = next((form for form, own in zip(MATERIAL_FORMS, given) if own), MATERIAL_FORMS[0])
        if self.angle is not None and form is not MATERIAL_FORMS[1]:
            raise refuse("turns the axes of orthotropic moduli, which this material does not have; remove it", "angle")
        if self.plane is not None and form is not MATERIAL_FORMS[0]:
            raise refuse("is for isotropic materials; remove it, and give a 'stiffness' in plane strain", "plane")
        for key in ("terms", "equibiaxial_test", "pure_shear_test"):
            if getattr(self, key) is not None and form is not MATERIAL_FORMS[3]:
                raise refuse("needs a 'uniaxial_test', which this material does not have; remove it", key)
        if self.plane == "strain" and self.poisson_ratio == 0.5:
            raise refuse(f"is {INCOMPRESSIBLE_REASON}", "poisson_ratio")
        for key in form:
            if getattr(self, key) is None:
                raise refuse(f"'{key}' is missing; give {words(type(self).model_fields[key])}", key)
        return self

    def material(self, name: str, folder: Path = Path()) -> AnyMaterial:
        """Return the material; files are relative to a folder. Raises ValueError for impossible constants."""
        if self.uniaxial_test is not None:
            from springtune.problem.materials import fit_rubber

            files = {key: getattr(self, f"{key}_test") for key in ("uniaxial", "equibiaxial", "pure_shear")}
            tests = {key: folder / file for key, file in files.items() if file}
            return fit_rubber(**tests, terms=self.terms or MOST_TERMS, density=self.density, name=name)
        if self.young_modulus is not None and self.poisson_ratio is not None:
            return Material(self.young_modulus, self.poisson_ratio, self.density, name, self.plane or "stress")
        if self.stiffness is not None:
            return AnisotropicMaterial(**self.stiffness.model_dump(), density=self.density, name=name)
        ply = AnisotropicMaterial.orthotropic(**{key: getattr(self, key) for key in MATERIAL_FORMS[1]}, name=name)
        return AnisotropicMaterial.laminate([(ply, angle, 1.0) for angle in self.angle or [0.0]], self.density, name)


class StatedStiffness(Section):
    """The stiffness for one mesh type and material."""

    mesh_type: fields.MeshType
    """Mesh type."""

    material: fields.MaterialName
    """Material."""

    value: fields.Stiffness
    """Stiffness of every spring."""


class PaperConfig(Section):
    """The definition `paper`: stiffnesses from print."""

    stiffness: list[StatedStiffness] = Field(
        min_length=1, title="a list such as [{mesh_type: structured, material: steel, value: 170e6 N/m}]"
    )
    """One entry per mesh type and material."""


class CalibratedConfig(Section):
    """The definition `calibrated`: the mean of the best stiffnesses of one beam and load over all mesh sizes."""

    beam: fields.BeamName
    """Beam to calibrate on."""

    load: fields.Load
    """Load to calibrate on."""


class DefinitionsConfig(Section):
    """Parameters of two definitions. `springtune definitions` lists all."""

    paper: PaperConfig | None = None
    """Needed if a grid uses `paper`."""

    calibrated: CalibratedConfig | None = None
    """Needed if a grid uses `calibrated`."""


class SensitivityConfig(Section):
    """The stiffnesses of sensitivity curves, equally spaced, as multiples of sqrt(3)/2 E t."""

    start: fields.Ratio = default("0.4", alias="from")
    """Smallest stiffness."""

    stop: fields.Ratio = default("1.6", alias="to")
    """Largest stiffness."""

    points: fields.Points = default("61")
    """Number of stiffnesses, with both ends."""

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if not self.start < self.stop:
            raise refuse(f"{self.start:g} is not below 'to', {self.stop:g}; give a smaller 'from'", "from")
        return self


class MeshFileConfig(Section):
    """A mesh file that fills a beam; its lower left corner may be anywhere."""

    file: fields.FileName
    """The mesh file."""

    beam: fields.BeamName
    """Beam that the mesh fills."""

    mesh_size: fields.Length
    """Its name in grids and in the dataset."""

    unit: fields.Length = default("1 m")
    """Unit of the coordinates in the file."""


def _rows_may_give(schema: dict[str, Any]) -> None:
    """Required keys may come from a file of rows."""
    schema["anyOf"] = [{"required": schema.pop("required")}, {"required": ["rows"]}]


class GridConfig(Section):
    """Every combination of the values is a scene.

    `thickness`, `young_modulus`, `poisson_ratio`, `stiffness_scale` and several forces add dimensions to the dataset.
    """

    model_config = ConfigDict(json_schema_extra=_rows_may_give)

    beam: OneOrMore[fields.BeamName]
    """Beams."""

    mesh_type: OneOrMore[fields.MeshType] = Field(
        description="A name under `mesh_files`, or one of these. "
        + " ".join(f"`{name}`: {one.summary}." for name, one in MESH_TYPES.items())
    )
    mesh_size: fields.Lengths
    """Lengths of edges, at most the smaller side of each beam."""

    material: OneOrMore[fields.MaterialName]
    """Materials."""

    load: OneOrMore[fields.Load]
    """Left end clamped: `traction` and `compression` act along x on the right end, `bending` along y. Lower side
    clamped: `shear` acts along x on the upper side, which stays level; `pressure` and `follower-pressure` press it
    down."""

    force: fields.GridForces | None = None
    """Size of the force. The load gives the sign. Several forces on one beam and material in one load are a dimension
    of the dataset."""

    pressure: fields.Stresses | None = None
    """Instead of `force`, for both pressure loads."""

    thickness: fields.Lengths | None = None
    """Replaces the beams' own."""

    young_modulus: fields.Stresses | None = None
    """Replaces the materials' own."""

    poisson_ratio: fields.PoissonRatios | None = None
    """Replaces the materials' own."""

    stiffness_scale: fields.Ratios | None = None
    """Factors on all stiffnesses and energies of a definition."""

    @property
    def force_owner(self) -> str:
        """Key of the grid that its forces belong to, `beam`, `material` or `load`; empty if they are for all."""
        if not isinstance(self.force, dict):
            return ""
        return next((name for name in ("material", "load") if self.force.keys() & {*getattr(self, name)}), "beam")

    @model_validator(mode="after")
    def _check_force(self) -> Self:
        free = next((load for load in self.load if not LOADS[load].kind.pressed), "")
        if self.force is None and self.pressure is None:
            remedy = "one for each beam, material or load" + ("" if free else ", or 'pressure'")
            raise refuse(f"'force' is missing; give a force such as '400 kN', or {remedy}")
        if self.force is not None and self.pressure is not None:
            raise refuse("both 'force' and 'pressure'; remove one", "pressure")
        if self.pressure is not None and free:
            raise refuse(f"load '{free}' has no pressed side; give 'force', or loads under pressure", "pressure")
        return self

    definition: OneOrMore[fields.DefinitionName]
    """`springtune definitions` lists them."""

    kinematics: OneOrMore[fields.Kinematics] = default("nonlinear")
    """`linear` springs keep their tangent at rest."""

    rows: Annotated[list[str], WithJsonSchema({"type": "string"}), Field(title="the path of a CSV file")] = []
    """CSV file with a combination in each row and a column per key, such as `mesh_size [mm]`. The grid's other keys are
    combined with each row."""

    sensitivity: fields.Flag = default("true")
    """Compute sensitivity curves. `calibrated` always gets its own."""


GRID_PARAMETERS = tuple(name for name in GridConfig.model_fields if name not in ("rows", "sensitivity"))
"""Keys of a grid whose values are combined."""


Factor = tuple[tuple[str, ...], list[tuple[Any, ...]]]
"""Names of zipped parameters, and one tuple of values for each combination."""

SAME_VALUE = 1e-9  # relative difference below which two numbers are the same value


def factors(grid: GridConfig) -> list[Factor]:
    """Factors whose product is all combinations of a grid; forces by beam, material or load go with it."""
    columns = tuple(grid.rows[1:])
    apart = {*columns, "force"} if isinstance(grid.force, dict) else {*columns}
    names = [name for name in GRID_PARAMETERS if getattr(grid, name) and name not in apart]
    groups = filter(None, (columns, *((name,) for name in names)))
    found = [(group, [*zip(*(getattr(grid, name) for name in group), strict=True)]) for group in groups]
    if isinstance(grid.force, dict):
        place = next(number for number, (group, _) in enumerate(found) if grid.force_owner in group)
        group, rows = found[place]
        owner = group.index(grid.force_owner)
        found[place] = (*group, "force"), [(*row, force) for row in rows for force in grid.force.get(row[owner], ())]
    return found


def combinations(grid: GridConfig) -> Iterator[dict[str, Any]]:
    """Yield the combinations of a grid."""
    parts = factors(grid)
    names = [*chain.from_iterable(group for group, _ in parts)]
    for rows in product(*(rows for _, rows in parts)):
        yield dict(zip(names, chain.from_iterable(rows)))


def _check_mesh_type_names(files: dict[str, Any]) -> dict[str, Any]:
    for name in filter(MESH_TYPES.__contains__, files):
        raise refuse(f"'{name}' is a mesh type that is made; rename yours", name)
    return files


class StyleConfig(Section):
    """Width of figures and size of their text."""

    width: fields.Length | None = None
    """Of a column; 89 mm by default."""

    font_size: Annotated[float, Field(ge=4, le=24, title="a number of points from 4 to 24")] | None = None
    """In points; 8 by default."""


class StudyConfig(Section):
    """The keys of a study."""

    title: fields.Text
    """Title, one line."""

    beams: Named[BeamConfig] = Field({}, title="a section for each beam, by name")
    """Beams."""

    materials: Named[MaterialConfig] = Field({}, title="a section for each material, by name")
    """Materials."""

    definitions: DefinitionsConfig = Field(default_factory=DefinitionsConfig)
    """Parameters of `paper` and `calibrated`."""

    sensitivity: SensitivityConfig = Field(default_factory=SensitivityConfig)
    """Range of stiffness of the sensitivity curves."""

    mesh_files: Annotated[Named[list[MeshFileConfig]], AfterValidator(_check_mesh_type_names)] | None = Field(
        None, title="a list of files for each mesh type, by name"
    )
    """Your own mesh types: one file per beam and mesh size."""

    outputs: list[str] = Field([])

    style: StyleConfig = Field(default_factory=StyleConfig)
    """Style of the figures."""

    further_references: OneOrMore[fields.FurtherReference] = []
    """References at finite strain, in addition to small strain: group `/finite_strain`, and `/block` under pressure.
    Each takes seconds. In plane strain the material must be compressible. `yeoh-plane-stress` needs a
    `uniaxial_test`."""

    printed: fields.FileName | None = None
    """CSV file of printed values to compare with."""

    grids: dict[str, GridConfig] = Field({})

    instead_of_grids: ClassVar[list[str]] = []
    """Keys of study kinds that a study may have instead of grids."""

    @model_validator(mode="before")
    @classmethod
    def _check_sections(cls, value: Any) -> Any:
        """Refuse a study without grids or a section that may replace them."""
        given = {key for key, content in value.items() if content is not None} if isinstance(value, dict) else set()
        if given and given <= {*cls.model_fields} - {"grids", *cls.instead_of_grids}:
            others = ", ".join(map(repr, cls.instead_of_grids))
            raise refuse(f"'grids' is missing; give {words(cls.model_fields['grids'])}, or {others}", "grids")
        return value


@cache
def study_model(kinds: tuple[StudyKind, ...]) -> type[StudyConfig]:
    """Model of a study: `StudyConfig` and the keys that study kinds add to it and to its grids."""
    made = [output for kind in kinds for output in kind.outputs]
    own: dict[str, Any] = {name: field for kind in kinds for name, field in kind.grid_fields.items()}
    grid = create_model("GridConfig", __base__=GridConfig, __doc__=GridConfig.__doc__, **own)
    added: dict[str, Any] = {name: field for kind in kinds for name, field in kind.study_fields.items()}
    keys: list[str] = []
    for kind in kinds:
        keys += kind.instead_of_grids or [key for key, (_, field) in kind.study_fields.items() if field.default is None]
    meanings = "; ".join(f"`{output.name}`: {output.meaning}" for output in made)
    meaning = f"Figures and tables: {meanings}. Figures of scenes show nonlinear kinematics if a grid has them."
    usual = Field([output.name for output in made if output.usual], description=meaning)
    added["outputs"] = OneOrMore[Annotated[str, *one_of("output", [output.name for output in made])]], usual
    meaning = f"Grids of scenes. Optional with one of {', '.join(f'`{name}`' for name in keys)}."
    several: Any = Field({}, min_length=1, title="a section for each grid, by name", description=meaning)
    added["grids"] = dict[str, grid], several
    model = create_model("StudyConfig", __base__=StudyConfig, __doc__=StudyConfig.__doc__, **added)
    model.instead_of_grids = keys
    model.model_config["json_schema_extra"] = {"anyOf": [{"required": [key]} for key in ("grids", *keys)]}
    return model
