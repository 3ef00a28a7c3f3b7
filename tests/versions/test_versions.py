"""The same numbers from other solvers, processors and versions of numpy and scipy, within what a solve promises.

What is compared how follows from what is computed: a state is the same or not; an equilibrium is as good as Newton's
method leaves it, a curve as its series are, an error as what it is a ratio of. A residual is what rounding leaves, and
compared with nothing.
"""

import os
import pickle
import platform
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from springtune.linalg.factors import CHOLESKY
from springtune.mechanics.newton import REFINED
from springtune.mechanics.series import CURVE_TOLERANCE

REPOSITORY = Path(__file__).parents[2]
PROGRAM = Path(__file__).with_name("computed.py")

ROUNDING = 1e-9
"""Of what is computed without a system of equations, or with a well-conditioned one."""

TOLERANCES = {
    "mesh": ROUNDING,
    "reference": REFINED,
    "sensitivity": CURVE_TOLERANCE,
    "moduli": REFINED,
    "solve": REFINED,
    "laying": REFINED,
    "stability": REFINED,
}
"""Largest difference over the largest value of a result, or over 1 for ratios, by stage."""

RATIOS = re.compile("error|ratio|elongation|penetration")
"""Of names of numbers that are compared as they are: parts of what has size 1."""

COUNTS = re.compile("status|stable|pivots|evaluations|load_share")
"""Of names of what must be the same."""

LEFT = re.compile("seconds|residual|estimate|iterations|solver|contrast_error|spring_forces")
"""Of names of what rounding leaves: bounds on errors, not results. Forces are kept in single precision."""


DECLARED = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]

NEEDED = [*DECLARED["dependencies"], *DECLARED["optional-dependencies"]["cholesky"]]
NEEDED = [one for one in NEEDED if not one.startswith("snakemake")]
"""Packages that physics may need. Snakemake is none, and what it needs may have no wheel for the newest Python."""

SNAKEMAKE = [one for one in DECLARED["dependencies"] if one.startswith("snakemake")]
"""Snakemake and the interface of its loggers."""

TESTERS = DECLARED["optional-dependencies"]["test"]
TESTERS = [one for one in TESTERS if re.match("hypothesis|meshlane|mujoco|pytest", one)]

PYTHONS = [one.rpartition(" ")[2] for one in DECLARED["classifiers"] if re.search(r":: 3\.\d+$", one)]
"""Versions of Python that are supported."""


PROCESSORS = {
    "Haswell": {"avx2", "fma"},
    "SkylakeX": {"avx512f", "avx512dq", "avx512bw", "avx512vl"},
    "Prescott": {"pni"},
    "Nehalem": {"sse4_2"},
    "generic": {"pni"},
}
"""Kernels of OpenBLAS, and what they ask of a processor; of the generic one numba compiles for no processor either."""

NOISE = ("contrast_error", "contrast_estimate", "buckling_load")
"""Variables that are not compared between processors: what rounding leaves, and an eigenvalue of the difference of two
equilibria, which agrees to 1e-8 only."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    sys.path.insert(0, str(REPOSITORY / "tests/workflow"))
    from test_company import STUDY

    path = tmp_path_factory.mktemp("versions") / "many.yaml"
    path.write_text(STUDY)
    return path


def computed(study, python, name, **environment):
    """What the stages of the study store, computed by a Python."""
    output = study.with_name(f"{name}.pickle")
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY / "src"), "OPENBLAS_NUM_THREADS": "1"} | environment
    subprocess.run([str(python), str(PROGRAM), str(study), str(output)], check=True, env=environment)
    return pickle.loads(output.read_bytes())


@pytest.fixture(scope="module")
def usual(study):
    return computed(study, sys.executable, "usual")


def compared(found, wanted):
    """Largest difference of each kind of value over its tolerance, and what is not the same."""
    worst, others = {}, []
    versions = found["versions"], wanted["versions"]
    assert found.keys() == wanted.keys()
    for place in found.keys() - {"versions"}:
        stage, _, name = place
        one, other = found[place], wanted[place]
        if LEFT.search(name):
            continue
        if isinstance(other, str | list):
            # Texts tell numbers of few digits, the last of which may be another one.
            if re.sub(r"\d[\d.e+-]*", "#", str(one)) != re.sub(r"\d[\d.e+-]*", "#", str(other)):
                others.append((place, one, other))
            continue
        one, other = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
        counted = bool(COUNTS.search(name)) and not np.array_equal(one, other, equal_nan=True)
        if counted or not np.array_equal(np.isfinite(one), np.isfinite(other)):
            others.append((place, one, other))
            continue
        size = 1.0 if RATIOS.search(name) else np.abs(other[np.isfinite(other)]).max(initial=0.0) or 1.0
        apart = np.abs(one - other)[np.isfinite(other)].max(initial=0.0) / size
        worst[stage, name] = max(worst.get((stage, name), 0.0), float(apart))
    beyond = {place: apart for place, apart in worst.items() if apart > TOLERANCES[place[0]]}
    print(*versions, *(f"{apart:.1e} {' '.join(place)}" for place, apart in sorted(worst.items()) if apart), sep="\n")
    return beyond, others


@pytest.mark.slow
@pytest.mark.skipif(not CHOLESKY, reason="CHOLMOD is not installed: SuperLU is what factorizes here")
def test_superlu_and_cholmod_agree(study, usual):
    found = computed(study, sys.executable, "superlu", SPRINGTUNE_SOLVER="superlu")
    assert compared(found, usual) == ({}, [])


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
    lacking = PROCESSORS[name] - set(Path("/proc/cpuinfo").read_text().split())
    if lacking:
        pytest.skip(f"this processor has no {', '.join(sorted(lacking))}, so kernel {name} is left out")
    if name != "generic":
        return {"OPENBLAS_CORETYPE": name}
    return {"OPENBLAS_CORETYPE": "Prescott", "NUMBA_CPU_NAME": "generic", "NUMBA_CACHE_DIR": str(folder / "numba")}


def assert_same_datasets(config, folder, environments, tolerance, ignored=()):
    """Compute a study in each environment at once, and compare the datasets with the first.

    Statuses and messages are equal, and numbers within the tolerance.
    """
    outputs = [folder / f"{number}.nc" for number in range(len(environments))]
    usual = os.environ | {"PYTHONPATH": str(REPOSITORY / "src"), "OPENBLAS_NUM_THREADS": "1"}
    calls = [[sys.executable, str(PROGRAM), str(config), str(output)] for output in outputs]
    running = [subprocess.Popen(call, env=usual | one) for call, one in zip(calls, environments)]
    assert [one.wait() for one in running] == [0] * len(running)
    compare = [sys.executable, "-m", "springtune", "diff", "--relative", str(tolerance), "--all"]
    compare += [word for name in ignored for word in ("--ignore", name)]
    for output in outputs[1:]:
        found = subprocess.run([*compare, str(outputs[0]), str(output)], capture_output=True, text=True, env=usual)
        assert found.returncode == 0, found.stdout + found.stderr


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


def physics(python, tests="tests/physics", **environment):
    """Run the physics tests by a Python, and assert that they hold."""
    call = [str(python), "-m", "pytest", "-q", "-n", "2", "-m", "not slow", "-p", "no:cacheprovider", tests]
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
    found = computed(study, oldest, "oldest")
    assert found["versions"]["numpy"] != usual["versions"]["numpy"]
    assert compared(found, usual) == ({}, [])


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
    found = computed(study, newest, "newest")
    print(f"Python {version}:", found["versions"])
    assert compared(found, usual) == ({}, [])
    physics(newest)


@pytest.mark.slow
@pytest.mark.parametrize("version", ["3.3.7", "3.14.0", "3.17.0"])
def test_files_for_mujoco_3_hold_in_it(version, tmp_path):
    """The first that has a flex's elasticity, the last with wrong forces on its rollers, and the last of version 3."""
    python = environment(tmp_path / "venv", sys.executable, [*NEEDED, f"mujoco=={version}"])
    for tests in ("tests/physics/test_simulators.py", "tests/engines/test_mujoco_engine.py"):
        physics(python, tests)


@pytest.mark.slow
@pytest.mark.parametrize(
    "packages",
    [
        pytest.param([one.replace(">=", "==") for one in SNAKEMAKE], id="oldest"),
        pytest.param(["snakemake==9.16.3", "snakemake-interface-logger-plugins==1.2.4"], id="between"),
        pytest.param(SNAKEMAKE, id="newest"),
    ],
)
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
