"""Materials: closed forms of their constants, what is refused, and what results of studies are found by."""

import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as some

import springtune as st
from springtune.problem.materials import CONSTANTS, material_of
from springtune.studies.config.expand import declared
from springtune.studies.config.messages import Problems
from springtune.studies.config.model import kinds
from springtune.studies.config.sections import study_model
from springtune.studies.runs.keys import beam_key, material_key
from springtune.studies.runs.source import hash_of

from tables import STUDIES

REPOSITORY = Path(__file__).parents[2]

PLY = st.AnisotropicMaterial.orthotropic("140 GPa", "10 GPa", 0.3, "5 GPa", name="ply")


# -- constants ---------------------------------------------------------------------------------------------------------


def test_engineering_constants_are_those_that_were_given():
    found = PLY.constants_at(0)
    assert found[:4] == pytest.approx((140e9, 10e9, 0.3, 5e9), rel=1e-9)
    assert found.shear_by_x == pytest.approx(0, abs=1e-9)
    turned = st.AnisotropicMaterial.orthotropic("140 GPa", "10 GPa", 0.3, "5 GPa", "-25 deg").constants_at("-25 deg")
    assert turned[:4] == pytest.approx(found[:4], rel=1e-9)


@given(angle=some.floats(-7, 7))
def test_young_modulus_at_an_angle_has_the_textbook_form(angle):
    """1/E = c4/E_x + s4/E_y + c2 s2 (1/G - 2 nu/E_x) (Jones, Mechanics of composite materials)."""
    c, s = math.cos(angle), math.sin(angle)
    expected = c**4 / 140e9 + s**4 / 10e9 + c * c * s * s * (1 / 5e9 - 2 * 0.3 / 140e9)
    assert 1 / PLY.constants_at(angle).young_modulus_x == pytest.approx(expected, rel=1e-9)
    shear = 4 * c * c * s * s * (1 / 140e9 + 1 / 10e9 + 2 * 0.3 / 140e9) + (c * c - s * s) ** 2 / 5e9
    assert 1 / PLY.constants_at(angle).shear_modulus == pytest.approx(shear, rel=1e-9)


@given(angle=some.floats(-7, 7), other=some.floats(-7, 7))
def test_turning_keeps_what_no_turn_changes(angle, other):
    turned = PLY.rotated(angle)
    assert turned.C11 + turned.C22 + 2 * turned.C12 == pytest.approx(PLY.C11 + PLY.C22 + 2 * PLY.C12, rel=1e-9)
    assert turned.C66 - turned.C12 == pytest.approx(PLY.C66 - PLY.C12, rel=1e-9)
    twice, once = turned.rotated(other).plane_stress, PLY.rotated(angle + other).plane_stress
    assert np.abs(twice - once).max() <= 1e-9 * PLY.C11


def test_turning_is_counter_clockwise():
    """Fibres that rise to the right give a positive shear stress as they are stretched."""
    assert PLY.rotated("30 deg").C16 > 0 > PLY.rotated("-30 deg").C16
    assert PLY.rotated("90 deg").C22 == pytest.approx(PLY.C11, rel=1e-9)


@given(nu=some.floats(-0.9, 0.5), angle=some.floats(-7, 7))
def test_isotropic_constants_are_the_same_at_every_angle(nu, angle):
    steel = st.Material(210e9, nu)
    found = st.AnisotropicMaterial.of(steel.plane_stress).constants_at(angle)
    assert found[:4] == pytest.approx((210e9, 210e9, nu, 210e9 / (2 * (1 + nu))), rel=1e-9, abs=1e-9)


def test_a_laminate_is_the_mean_of_its_plies():
    cross = st.AnisotropicMaterial.laminate([(PLY, 0, "0.25 mm"), (PLY, "90 deg", "0.5 mm"), (PLY, 0, "0.25 mm")])
    assert (cross.C11, cross.C66) == pytest.approx(((PLY.C11 + PLY.C22) / 2, PLY.C66), rel=1e-9)
    assert cross.C11 == pytest.approx(cross.C22, rel=1e-9)
    angle_ply = st.AnisotropicMaterial.laminate([(PLY, "45 deg", 1), (PLY, "-45 deg", 1)])
    assert abs(angle_ply.C16) <= 1e-9 * angle_ply.C11
    heavy, light = replace(PLY, density=2000.0), st.Material("1 GPa", 0.3, "1000 kg/m^3")
    assert st.AnisotropicMaterial.laminate([(heavy, 0, 3), (light, 0, 1)]).density == pytest.approx(1750)
    assert st.AnisotropicMaterial.laminate([(heavy, 0, 3), (PLY, 0, 1)]).density is None


# -- refusals ----------------------------------------------------------------------------------------------------------


@given(some.lists(some.floats(-2, 2), min_size=6, max_size=6))
def test_what_is_accepted_is_positive_definite_and_nothing_else(numbers):
    c11, c22, c12, c66, c16, c26 = numbers
    matrix = np.array([[c11, c12, c16], [c12, c22, c26], [c16, c26, c66]])
    least = np.linalg.eigvalsh(matrix)[0]
    try:
        st.AnisotropicMaterial(c11, c22, c12, c66, c16, c26)
    except ValueError:
        assert least <= 1e-9
    else:
        assert least >= -1e-9


# -- keys --------------------------------------------------------------------------------------------------------------


def test_results_depend_on_every_constant_and_on_no_label():
    known = hash_of(material_key(PLY))
    assert hash_of(material_key(replace(PLY, name="other", density=3.0))) == known
    for constant in CONSTANTS:
        assert hash_of(material_key(replace(PLY, **{constant: getattr(PLY, constant) + 1e6}))) != known
    assert hash_of(material_key(replace(PLY, density=3.0), density=True)) != hash_of(material_key(PLY, density=True))


def test_of_a_beam_all_but_its_label_is_in_a_key():
    known = beam_key(st.Beam(0.2, 0.04, 1e-3, "200x40"))
    assert known == {"length": 0.2, "height": 0.04, "thickness": 1e-3, "name": ""}


def test_keys_of_isotropic_materials_are_what_they_were():
    """Results that are stored are found."""
    found = material_key(st.Material(210e9, 0.3, 7850.0, "steel"))
    assert found == {"young_modulus": 210e9, "poisson_ratio": 0.3, "name": ""}
    assert asdict(st.Material(210e9, 0.3)) == {
        "young_modulus": 210e9, "poisson_ratio": 0.3, "density": None, "name": "material", "plane": "stress"
    }  # fmt: skip
    assert material_key(st.Material(210e9, 0.3, plane="strain"))["plane"] == "strain"


def test_a_material_is_made_again_of_its_fields():
    steels = (st.Material(210e9, 0.3, 7850.0, "steel", plane) for plane in ("stress", "strain"))
    for material in (PLY, PLY.rotated(0.3), *steels):
        assert material_of(asdict(material)) == material
        assert material.isotropic == isinstance(material, st.Material)


STUDY = STUDIES["materials"]

# -- studies -----------------------------------------------------------------------------------------------------------


def test_a_study_declares_all_three_forms(load):
    assert len(load(STUDY).scenes) == 1
    config = study_model(kinds()).model_validate(yaml.load(STUDY, yaml.BaseLoader))
    found = declared(config, Problems("study.yaml")).materials
    assert found["ply"] == replace(PLY.rotated("-30 deg"), name="ply")
    plies = yaml.load(STUDY.replace("angle: -30 deg", "angle: [0 deg, 90 deg, 90 deg, 0 deg]"), yaml.BaseLoader)
    cross = declared(study_model(kinds()).model_validate(plies), Problems("study.yaml")).materials["ply"]
    assert cross == st.AnisotropicMaterial.laminate([(PLY, f"{angle} deg", 1) for angle in (0, 90, 90, 0)], name="ply")
    assert found["board"] == st.AnisotropicMaterial(9e9, 4e9, -1.5e9, 2e9, density=600.0, name="board")


def sections():
    """Studies that have a section with a material, and where it stands."""
    yield (REPOSITORY / "config/laying.yaml").read_text(), "laying", "material"
    yield (REPOSITORY / "config/laying.yaml").read_text(), "laying", "support"
    yield (REPOSITORY / "config/stability.yaml").read_text(), "stability", "material"
    yield (REPOSITORY / "config/benchmark.yaml").read_text(), "benchmark", "scenes"


@pytest.mark.parametrize(("text", "section", "key"), list(sections()))
def test_sections_of_beams_take_isotropic_materials_alone(refusal, text, section, key):
    study = yaml.load(text, yaml.BaseLoader)
    study["materials"]["ply"] = yaml.load(STUDY, yaml.BaseLoader)["materials"]["ply"]
    inside = study[section]
    if section == "benchmark":
        inside, key = next(iter(inside["scenes"].values())), "material"
    inside[key] = "ply"
    message = refusal(yaml.safe_dump(study))
    assert section in message and "'ply' is anisotropic, and beams are of isotropic materials" in message
