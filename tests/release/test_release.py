"""A release without releasing: what would be uploaded is built, checked, and used where nothing else is.

Of what git knows, or of all files where there is no git. Packages are installed, so a network or a cache is needed.
"""

import ctypes
import os
import re
import shutil
import subprocess
import tarfile
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

import springtune as st

from tables import beside

REPOSITORY = Path(__file__).parents[2]
NAME = f"springtune-{st.__version__}"

WITHIN = re.compile(
    r"springtune/.*\.py|springtune/(__init__\.pyi|py\.typed|studies/output/page\.html)"
    r"|springtune/(cli/study_of_a_(beam|shape)|studies/kinds/\w+/views)\.yaml"
    r"|springtune/handover/templates/[\w.]+\.jinja"
    r"|springtune/studies/(kinds/\w+/\w+\.csv|output/style\.mplstyle)"
    r"|springtune/studies/output/assets/\w+\.(css|html|js)"
    r"|springtune/workflow/(Snakefile|README.md|config/.*|docs/.*|examples/.*|profiles/.*|workflow/.*)"
    r"|snakemake_logger_plugin_springtune/\w+\.py"
    rf"|{NAME}\.dist-info/(METADATA|WHEEL|RECORD|entry_points\.txt|licenses/LICENSE)"
)
"""All that a wheel may have."""

WORKFLOW = beside(__file__)["WORKFLOW"]
"""What a study needs besides the package."""


def done(*command, **options):
    """What a command prints; the test fails with it where the command does."""
    result = subprocess.run([*map(str, command)], capture_output=True, text=True, **options)
    assert result.returncode == 0, f"{' '.join(map(str, command))}\n{result.stdout}\n{result.stderr}"
    return result.stdout


@pytest.fixture(scope="session")
def tree(tmp_path_factory):
    """The files that git knows, as they are now."""
    folder = tmp_path_factory.mktemp("tree") / "springtune"
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=REPOSITORY, capture_output=True
    )
    if listed.returncode:
        ignored = shutil.ignore_patterns(".venv", "results", ".snakemake", "build", "__pycache__", ".*_cache")
        return shutil.copytree(REPOSITORY, folder, symlinks=True, ignore=ignored)
    for name in listed.stdout.decode().split("\0")[:-1]:
        if os.path.lexists(REPOSITORY / name):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(REPOSITORY / name, folder / name, follow_symlinks=False)
    return folder


def built(tree, folder):
    """Source distribution, and the wheel that is built from it, as `pip` builds one."""
    done("uv", "build", "--quiet", "--no-build-isolation", "--out-dir", folder, tree)
    return folder / f"{NAME}.tar.gz", folder / f"{NAME}-py3-none-any.whl"


@pytest.fixture(scope="session")
def release(tree, tmp_path_factory):
    return built(tree, tmp_path_factory.mktemp("dist"))


@pytest.fixture(scope="session")
def wheel(release):
    return release[1]


@pytest.fixture(scope="session")
def description(wheel):
    """What a package index shows as the project's page."""
    with zipfile.ZipFile(wheel) as file:
        metadata = Parser().parsestr(file.read(f"{NAME}.dist-info/METADATA").decode())
    assert metadata["Version"] == st.__version__
    assert metadata["Description-Content-Type"] == "text/markdown"
    return metadata.get_payload()


@pytest.fixture(scope="session")
def empty(wheel, tmp_path_factory):
    """A Python that has the wheel and what it declares, no more, in the versions of the lock file."""
    folder = tmp_path_factory.mktemp("empty")
    done("uv", "venv", "--quiet", folder / "venv")
    locked = ("--constraints", REPOSITORY / "requirements/run.txt")
    done("uv", "pip", "install", "--quiet", "--python", folder / "venv", wheel, *locked)
    return folder / "venv/bin"


@pytest.fixture
def call(empty, tmp_path):
    """Calls a program of the empty environment in an empty folder, whose name is `here`; no git is on its PATH."""
    here, programs = tmp_path / "empty", tmp_path / "programs"
    for folder in (here, programs):
        folder.mkdir()
    for name in ("bash", "sh", "env"):
        (programs / name).symlink_to(shutil.which(name))
    environment = {"PATH": str(programs), "HOME": str(here / "home"), "LANG": "C.UTF-8"}

    def call(program, *arguments, **options):
        command = [str(empty / program), *map(str, arguments)]
        return subprocess.run(command, cwd=here, env=environment, capture_output=True, text=True, **options)

    call.here = here
    return call


# -- what is built -----------------------------------------------------------------------------------------------------


def test_the_wheel_has_the_package_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as file:
        names = set(file.namelist())
    assert not {name for name in names if not WITHIN.fullmatch(name)}
    source = {
        str(path.relative_to(REPOSITORY / "src"))
        for path in (REPOSITORY / "src").rglob("*")
        if path.is_file() and path.parent.name != "__pycache__" and path.name != "conftest.py"
    }
    assert source <= names
    carried = {f"springtune/workflow/{name}" for name in WORKFLOW}
    assert carried <= names, carried - names


def test_what_is_built_of_a_clone_has_its_commit(tree, tmp_path):
    """Source distribution and wheel, and not of a clone around it."""
    around = shutil.copytree(tree, tmp_path / "around", symlinks=True)
    git = ["git", "-C", around, "-c", "user.name=a", "-c", "user.email=a@b.c"]
    for command in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "a"]):
        done(*git, *command)
    commit = done(*git, "rev-parse", "HEAD")
    source, wheel = built(around, tmp_path / "dist")
    with zipfile.ZipFile(wheel) as file:
        assert file.read("springtune/commit.txt").decode() == commit
    inside = around / "inside"
    with tarfile.open(source) as file:
        file.extractall(inside)
    assert (inside / NAME / "src/springtune/commit.txt").read_text() == commit
    (inside / NAME / "src/springtune/commit.txt").unlink()
    with zipfile.ZipFile(built(inside / NAME, tmp_path / "again")[1]) as file:
        assert "springtune/commit.txt" not in file.namelist()


# -- what is installed -------------------------------------------------------------------------------------------------


def test_no_package_is_missing_to_any_module(call):
    """Whatever the package imports is declared; what belongs to an extra is imported where it is used."""
    program = (
        "import importlib, pkgutil, springtune\n"
        "for one in pkgutil.walk_packages(springtune.__path__, 'springtune.'):\n"
        "    if not one.name.endswith('__main__'):\n"
        "        importlib.import_module(one.name)\n"
        "import snakemake_logger_plugin_springtune\n"
        "for name in springtune.__all__:\n"
        "    getattr(springtune, name)\n"
    )
    found = call("python", "-c", program)
    assert found.returncode == 0, found.stderr
    assert call("springtune", "--version").stdout.split()[-1] == st.__version__


def test_the_scene_of_the_readme_is_solved(call, description):
    code, shown = re.search(r"```python\n(.*?)```\n.*?```text\n(.*?)```", description, re.DOTALL).groups()
    found = call("python", "-c", code)
    assert (found.stdout, found.stderr) == (shown, "")


@pytest.fixture
def read_only(empty):
    """Options of a process that cannot write into the environment, as that of an administrator."""
    folders = [path for path in empty.parent.rglob("*") if path.is_dir() and not path.is_symlink()]
    for folder in folders:
        folder.chmod(0o555)
    library, drop_capability, override = ctypes.CDLL(None), 24, 1  # root writes anywhere without this
    yield {"preexec_fn": lambda: library.prctl(drop_capability, override, 0, 0, 0)}
    for folder in folders:
        folder.chmod(0o755)


@pytest.mark.parametrize("shape", [(), ("--shape",)], ids=["beam", "shape"])
def test_a_study_is_written_and_run_in_an_empty_folder(call, read_only, empty, shape):
    """With Python alone: no clone, no git, and an environment that is only read."""
    before = {path: path.stat().st_mtime_ns for path in empty.parent.rglob("*")}
    touch = "import pathlib, springtune; pathlib.Path(springtune.__file__).with_name('touched').touch()"
    assert "Permission denied" in call("python", "-c", touch, **read_only).stderr
    assert call("python", "-c", "import shutil; print(shutil.which('git'))", **read_only).stdout == "None\n"
    written = call("springtune", "new", "mine", *shape, **read_only)
    assert written.stdout.splitlines()[1:] == ["  springtune run mine.yaml"], written.stderr
    scenes = 4 if shape else 2
    assert re.search(rf"scenes +{scenes}\b", call("springtune", "scenes", "mine.yaml", **read_only).stdout)
    ran = call("springtune", "run", "mine.yaml", "--cores", 1, **read_only)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert re.search(r"^results +results/mine: index.html, dataset.nc", ran.stdout + ran.stderr, re.MULTILINE)
    told = call("springtune", "info", "results/mine", **read_only)
    assert f"{scenes}  {scenes} solved" in told.stdout and f"springtune {st.__version__}" in told.stdout
    assert "commit" not in told.stdout  # of a tree without git
    assert "unknown" not in (call.here / "results/mine/tables/index.html").read_text()
    assert (call.here / "results/mine/index.html").stat().st_size > 100_000
    again = call("springtune", "run", "mine.yaml", **read_only)
    assert again.returncode == 0 and "results/mine is complete" in again.stdout
    group = ("--group", "shapes") if shape else ()
    assert not call("springtune", "export", "results/mine", "--to", "mine.csv", *group, **read_only).returncode
    assert {path: path.stat().st_mtime_ns for path in empty.parent.rglob("*")} == before


def test_the_source_runs_a_study(call, empty, release):
    """In the folder of the source, with the environment of the wheel."""
    with tarfile.open(release[0]) as file:
        file.extractall(call.here)
    source = call.here / NAME
    environment = {"PATH": f"{empty}:/usr/bin:/bin", "HOME": str(call.here), "LANG": "C.UTF-8"}
    done(empty / "springtune", "new", "mine", cwd=source, env=environment)
    done(empty / "springtune", "run", "config/mine.yaml", "--cores", "1", cwd=source, env=environment)
    assert (source / "results/mine/dataset.nc").is_file()
    assert (source / "results/mine/index.html").is_file()
