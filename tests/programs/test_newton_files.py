"""Files for Newton, read and run by it: the script of its ModelBuilder."""

import importlib.util
import runpy

import numpy as np
import pytest

import springtune as st

from engine_scenes import TEN, scene

newton = pytest.importorskip("newton")

CASES = {
    "triangles": ("sheet", "free", "traction", "foam", "delingette"),
    "springs": ("sheet", "free", "traction", "foam", "patch"),
    "rollers": ("sheet", "structured", "shear", "foam", "delingette"),
}


def script(one, folder):
    """The script of a scene as a module, and its path."""
    [path] = one.springs.write(folder / "net.newton.py", errors=False)
    spec = importlib.util.spec_from_file_location("net_of_newton", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module, path


def off(found, exact):
    return np.abs(found - exact).max() / np.abs(exact).max()


@pytest.mark.parametrize("case", CASES)
def test_a_script_comes_to_rest_in_our_equilibrium(case, tmp_path):
    one = scene(*CASES[case])
    module, _ = script(one, tmp_path)
    exact = one.solve().displacements
    # Springs have our law; triangles have Newton's, which is ours at small strain.
    assert off(module.EXPECTED, exact) < (1e-9 if case == "springs" else 0.02)
    assert off(module.run(module.build()), module.EXPECTED) < 1e-3


def test_a_calibrated_script_comes_to_the_promised_displacement(tmp_path):
    """In an order of particles of its own, at a setting that is 1 % off without the factor."""
    one = scene("sheet", "structured", "traction", "foam", "delingette")
    fit = st.fit_engine(one, "newton-vbd", dt="1/60", substeps=20, iterations=10, loads=["traction"], needed=False)
    promised = fit.result.displacement
    assert promised == pytest.approx(one.reference().displacement, rel=1e-3) and abs(fit.untuned.error) > 5e-3
    [path] = fit.net().write(tmp_path / "tuned.newton.py")
    module = runpy.run_path(str(path))
    assert module["along"](module["run"](module["build"]())) == pytest.approx(promised, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("definition", ["delingette", "patch"])
@pytest.mark.parametrize("case", TEN, ids="-".join)
def test_ten_scenes(case, definition, tmp_path):
    module, _ = script(scene(*case, definition), tmp_path)
    found = module.run(module.build())
    assert module.along(found) == pytest.approx(module.along(module.EXPECTED), rel=1e-3)
    assert off(found, module.EXPECTED) < 1e-2  # across the load, single precision rounds


def test_the_law_of_triangles_is_that_of_the_definition_at_small_strain(tmp_path):
    """Newton's law and St. Venant-Kirchhoff's differ by a share of the strain."""
    shares = []
    for factor in (1.0, 0.5):
        whole = scene("sheet", "structured", "traction", "rubber", "delingette")
        one = st.Scene(
            whole.beam, whole.mesh, whole.material, "traction", factor * whole.force, definition="delingette"
        )
        shares.append(off(script(one, tmp_path)[0].EXPECTED, one.solve().displacements))
    assert shares[0] / shares[1] == pytest.approx(2, rel=0.05)


def test_a_script_prints_what_it_finds_and_what_it_expects(tmp_path, capsys):
    beam = st.Beam("40 mm", "20 mm")
    rubber = st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    one = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), rubber, "traction", "0.1 N", definition="delingette")
    _, path = script(one, tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    said = [line for line in capsys.readouterr().out.splitlines() if line.endswith(" mm")]
    found, expected = (float(line.split(":")[1].split()[0]) for line in said)
    assert found == pytest.approx(expected, rel=1e-3)
    assert expected == pytest.approx(1e3 * one.solve().displacement, rel=0.02)
