"""Studies with materials in plane strain: the dataset says their plane, and each is compared in its own."""

import numpy as np
import pytest

from springtune.studies.kinds import collect
from springtune.studies.output.dataset import against_own_laws
from springtune.studies.runs import keys

import campaigns
from tables import STUDIES

STUDY = STUDIES["planes"]


@pytest.fixture
def gathered(tmp_path):
    """Groups of a study's dataset, and its attributes."""

    def gather(text):
        study = campaigns.load_text(tmp_path, text)
        campaigns.do_stages(study, tmp_path)
        return collect.groups_of_study(study, tmp_path), keys.origin(study)

    return gather


def test_a_material_in_plane_strain_is_compared_in_its_plane(gathered):
    groups, attributes = gathered(STUDY.replace("MATERIALS", "[rock, sheet, clay]"))
    root, finite = groups["/"], groups["/finite_strain"]
    assert attributes["plane_strain"] == "rock, clay"
    assert root.material_plane.values.tolist() == ["strain", "stress", "strain"]
    np.testing.assert_array_equal(groups["/moduli"].poisson_ratio, [0.3, 1 / 3, 0.45 / 0.55])
    assert abs(groups["/moduli"].young_modulus_error.sel(definition="delingette")).max() < 1e-9
    own = against_own_laws(root, finite).reference_displacement.sel(kinematics="nonlinear").squeeze()
    np.testing.assert_allclose(own, root.reference_displacement.squeeze(), rtol=1e-3)
    asked = finite.sel(reference="neo-hooke-plane-stress", material="rock")
    assert "is in plane strain: its reference is 'neo-hooke-plane-strain'" in asked.reference_message.item()
    refused = root.message.sel(material="rock", definition="neo-hooke", kinematics="linear").item()
    assert "is in plane strain; choose 'delingette', or plane 'stress'" in refused
    assert groups["/block"].reference.values[0] == "small-strain"
    curve = groups["/sensitivity"].sel(material="rock", kinematics="linear").squeeze()
    np.testing.assert_allclose(curve.stiffness, curve.stiffness_ratio * 32e9 * 1e-3)


def test_plane_stress_leaves_the_dataset_as_it_was(gathered):
    groups, attributes = gathered(STUDY.replace("MATERIALS", "sheet").replace("plane: strain", "plane: stress"))
    assert "plane_strain" not in attributes
    assert not any("material_plane" in group for group in groups.values())
    assert groups["/block"].reference.values[0] == "small-strain-plane-stress"
