"""Foreign names in files that springtune writes: data give them back, programs have them as one line of comment."""

import ast
import json
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

import springtune as st

NAMES = yaml.safe_load(Path(__file__).with_name("hostile_names.yaml").read_text()) | {"long": "x" * 100_000}

PROGRAMS = (".xml", ".mjcf", ".py", ".newton.py", ".xpbd.json")


def renamed(tree, name):
    """A header whose texts, and keys of what a user names, all have a name in them."""
    if isinstance(tree, str):
        return tree + name
    if not isinstance(tree, dict):
        return tree
    own = {f"{key}{name}" if key == "bending" else key: renamed(value, name) for key, value in tree.items()}
    return own | ({name: "a key"} if "bending" in tree else {})


@pytest.fixture(scope="module", params=["delingette", "lattice"])
def plain(request):
    beam, rubber = st.Beam("40 mm", "20 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), rubber, "traction", "1 N", definition=request.param)
    net = st.SpringNet.from_scene(scene)
    return replace(net, header=net.header | {"other_materials": {"other": dict(net.header["material"])}})


def skeleton(path, ending):
    """What a program reads of a file: all but comments, titles and the header of JSON."""
    content = path.read_bytes()
    if ending.endswith(".py"):
        return ast.dump(ast.parse(content))
    if ending == ".xpbd.json":
        return json.loads(content) | {"header": None}
    root = ET.fromstring(content)
    root.attrib.pop("model", None)
    return ET.tostring(root)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("ending", PROGRAMS)
def test_no_name_is_read_by_a_program(ending, name, plain, tmp_path):
    if plain.energies and ending == ".py":  # SOFA has springs alone
        return
    before, after = tmp_path / f"before{ending}", tmp_path / f"after{ending}"
    plain.write(before)
    net = replace(plain, header=renamed(plain.header, NAMES[name]))
    net.write(after)
    lines = after.read_text(encoding="utf-8").split("\n")
    assert all(one.isprintable() for one in lines) and len(lines) == len(before.read_text().split("\n"))
    assert skeleton(before, ending) == skeleton(after, ending)
    if ending == ".xpbd.json":
        assert json.loads(after.read_bytes())["header"].items() >= net.header.items()


@pytest.mark.parametrize("name", NAMES)
def test_data_give_a_name_back(name, plain, tmp_path):
    net = replace(plain, header=renamed(plain.header, NAMES[name]))
    net.write(tmp_path / "net.json")
    back = st.SpringNet.read(tmp_path / "net.json")
    assert back.header == net.header and (back.stiffness == net.stiffness).all()
    assert print(back) is None and back._repr_html_()  # as a notebook has it
