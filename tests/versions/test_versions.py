"""The same numbers from other solvers, processors and versions of numpy and scipy, within what a solve promises.

Datasets are compared by `springtune diff`: statuses are the same or not, an equilibrium is as good as Newton's method
leaves it, a curve as its series are. A residual is what rounding leaves, and compared with nothing.
"""

import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import springtune as st
from springtune.linalg.factors import CHOLESKY
from springtune.mechanics.newton import REFINE_FROM_ERROR
from springtune.mechanics.series import CURVE_TOLERANCE

from tables import STUDIES, beside, cases

REPOSITORY = Path(__file__).parents[2]
PROGRAM = Path(__file__).with_name("computed.py")

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
DECLARED = PROJECT["project"]

NEEDED = [*DECLARED["dependencies"], *DECLARED["optional-dependencies"]["cholesky"]]
NEEDED = [one for one in NEEDED if not one.startswith("snakemake")]
"""Packages that physics may need. Snakemake is none, and what it needs may have no wheel for the newest Python."""

SNAKEMAKE = [one for one in DECLARED["dependencies"] if one.startswith("snakemake")]
"""Snakemake and the interface of its loggers."""

TESTERS = [one for one in PROJECT["dependency-groups"]["test"] if re.match("hypothesis|meshlane|pytest", str(one))]

PYTHONS = [one.rpartition(" ")[2] for one in DECLARED["classifiers"] if re.search(r":: 3\.\d+$", one)]
"""Versions of Python that are supported."""


PROCESSORS = beside(__file__)["PROCESSORS"]
"""Kernels of OpenBLAS, and what they ask of a processor; of the generic one numba compiles for no processor either."""

NOISE = ("contrast_error", "contrast_estimate", "buckling_load")
"""Variables that are not compared between processors: what rounding leaves, and an eigenvalue of the difference of two
equilibria, which agrees to 1e-8 only."""

ROUNDED = ("contrast_e*", "displacement_?")
"""Likewise of the study of many scenes. Where a particle stays, its displacement is what rounding leaves; forces of
springs, which follow from them, are compared."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("versions") / "many.yaml"
    path.write_text(STUDIES["company"])
    return path


def started(study, output, python=sys.executable, **environment):
    """A process that writes the dataset of a study by a Python."""
    usual = os.environ | {"PYTHONPATH": str(REPOSITORY / "src"), "OPENBLAS_NUM_THREADS": "1"}
    return subprocess.Popen([str(python), str(PROGRAM), str(study), str(output)], env=usual | environment)


def assert_same(one, other, tolerance, ignored):
    """Statuses and messages of two datasets are equal, and numbers within the tolerance."""
    call = [sys.executable, "-m", "springtune", "diff", "--relative", str(tolerance), str(one), str(other)]
    call += ["--rows", "1000000", *(word for name in ignored for word in ("--ignore", name))]
    found = subprocess.run(call, cwd=REPOSITORY, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr


@pytest.fixture(scope="module")
def usual(study):
    """Dataset of the study by this Python."""
    assert started(study, study.with_name("usual.nc")).wait() == 0
    return study.with_name("usual.nc")


def assert_as_usual(usual, study, name, python=sys.executable, **environment):
    """Compute the study by a Python, and compare it with the usual one; return the versions of its packages."""
    output = study.with_name(f"{name}.nc")
    assert started(study, output, python, **environment).wait() == 0
    assert_same(usual, output, REFINE_FROM_ERROR, ROUNDED)
    return software(output)


def software(path):
    """Versions of packages by which a dataset was made."""
    with st.open(path) as tree:
        return json.loads(tree.attrs["software"])


@pytest.mark.slow
@pytest.mark.skipif(not CHOLESKY, reason="CHOLMOD is not installed: SuperLU is what factorizes here")
def test_superlu_and_cholmod_agree(study, usual):
    assert_as_usual(usual, study, "superlu", SPRINGTUNE_SOLVER="superlu")


def environment(folder, python, packages):
    """A Python of its own with packages, and with what the physics tests are run by."""
    for command in (["venv", "--python", python, folder], ["pip", "install", "--python", folder, *packages, *TESTERS]):
        try:
            done = subprocess.run(["uv", *map(str, command)], capture_output=True, text=True)
        except OSError as error:
            pytest.skip(f"packages cannot be installed here: {error}")
        if done.returncode:
            pytest.skip(f"packages cannot be installed here: {done.stderr.strip()[-300:]}")
    return folder / "bin/python"


def processor(name, folder):
    """Environment that makes this processor compute as another one; skips the test if it cannot."""
    if platform.machine() != "x86_64" or not Path("/proc/cpuinfo").exists():
        pytest.skip("OpenBLAS's kernels are chosen by name on x86-64 under Linux alone")
    lacking = {*PROCESSORS[name]} - set(Path("/proc/cpuinfo").read_text().split())
    if lacking:
        pytest.skip(f"this processor has no {', '.join(sorted(lacking))}, so kernel {name} is left out")
    if name != "generic":
        return {"OPENBLAS_CORETYPE": name}
    return {"OPENBLAS_CORETYPE": "Prescott", "NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(folder / "numba")}


def assert_same_datasets(config, folder, environments, tolerance, ignored=()):
    """Compute a study in each environment at once, and compare the datasets with the first."""
    outputs = [folder / f"{number}.nc" for number in range(len(environments))]
    running = [started(config, output, **one) for output, one in zip(outputs, environments)]
    assert [one.wait() for one in running] == [0] * len(running)
    for output in outputs[1:]:
        assert_same(outputs[0], output, tolerance, ignored)


def test_the_quick_study_is_the_same_under_two_kernels(tmp_path):
    environments = [processor(name, tmp_path) for name in ("Nehalem", "Prescott")]
    assert_same_datasets(REPOSITORY / "config/quick.yaml", tmp_path, environments, 1e-9, NOISE)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROCESSORS)
def test_the_paper_study_is_the_same_on_every_processor(name, tmp_path):
    # The tolerance is that of displacements. Errors, displacement / reference - 1, follow from what is compared; where
    # a network is twice as soft they differ by twice as much.
    environments, follows = [{}, processor(name, tmp_path)], ["deformation_error"]
    assert_same_datasets(REPOSITORY / "config/paper.yaml", tmp_path, environments, CURVE_TOLERANCE, follows)


PHYSICS = [f"tests/{room}" for room in ("problem", "mesh", "springs", "mechanics", "linalg", "reference", "scene",
                                        "prediction", "handover", "engines")]  # fmt: skip


def physics(python, *tests, **environment):
    """Run tests, or else those of the physics, by a Python, and assert that they hold."""
    call = [str(python), "-m", "pytest", "-q", "-n", "2", "-m", "not slow", "-p", "no:cacheprovider"]
    call += tests or PHYSICS
    here = os.environ | {"PYTHONPATH": str(REPOSITORY / "src"), "OPENBLAS_NUM_THREADS": "1"} | environment
    done = subprocess.run(call, cwd=REPOSITORY, env=here, capture_output=True, text=True)
    print(done.stdout.splitlines()[-1:])
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]


@pytest.fixture(scope="module")
def oldest(tmp_path_factory):
    """A Python with the oldest packages that `pyproject.toml` allows: the newest releases of these minor versions."""
    floors = [one.partition(">=")[::2] for one in NEEDED]
    floors = [f"{name}=={least}{'' if '.' in least else '.0'}.*" for name, least in floors]
    return environment(tmp_path_factory.mktemp("oldest") / "venv", sys.executable, floors)


@pytest.mark.slow
def test_the_oldest_and_the_newest_packages_agree(study, usual, oldest):
    assert assert_as_usual(usual, study, "oldest", oldest)["numpy"] != software(usual)["numpy"]


@pytest.mark.slow
def test_physics_holds_with_the_oldest_packages(oldest):
    physics(oldest)


@pytest.mark.slow
@pytest.mark.parametrize("version", PYTHONS)
def test_every_python_agrees_with_the_newest_packages(version, study, usual, tmp_path):
    """Of those that are on PATH; which are not is what `-rs` tells."""
    python = shutil.which(f"python{version}")
    if python is None:
        pytest.skip(f"there is no python{version} on PATH")
    newest = environment(tmp_path / "venv", python, NEEDED)
    print(f"Python {version}:", assert_as_usual(usual, study, "newest", newest))
    physics(newest)


@pytest.mark.slow
@cases
def test_the_quick_study_runs_with_this_snakemake(packages, tmp_path):
    """The same scenes are solved, and a run with nothing to do says so, whichever private names it has."""
    python = environment(tmp_path / "venv", sys.executable, [*NEEDED, *packages])
    study = tmp_path / "study"
    study.mkdir()
    for name in ("Snakefile", "workflow", "config", "src"):
        (study / name).symlink_to(REPOSITORY / name)
    path = os.pathsep.join([str(python.parent), os.environ["PATH"]])
    here = os.environ | {"PYTHONPATH": str(REPOSITORY / "src"), "PATH": path, "CI": "true"}
    call = [str(python), "-m", "snakemake", "--configfile", "config/quick.yaml", "--cores", "2"]
    call += ["--workflow-profile", "workflow/profiles/default"]

    def run(*options):
        done = subprocess.run([*call, *options], cwd=study, env=here, capture_output=True, text=True)
        said = done.stdout + done.stderr
        assert done.returncode == 0, said[-3000:]
        assert "Error" not in said, said
        return said

    assert "collect" in run("--dry-run")
    assert re.search(r"^new +(?!nothing)\w", run(), re.M)
    assert "Nothing to be done" in run()
