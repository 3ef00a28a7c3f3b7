"""A release without releasing: what would be uploaded is built, checked, and used where nothing else is.

Of what git knows, or of all files where there is no git. Packages are installed, so a network or a cache is needed.
"""

import os
import re
import shutil
import subprocess
import tarfile
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

import springtune

REPOSITORY = Path(__file__).parents[2]
NAME = f"springtune-{springtune.__version__}"

WITHIN = re.compile(
    r"springtune/.*\.py|springtune/(__init__\.pyi|py\.typed|studies/output/page\.html)"
    r"|springtune/cli/study_of_a_(beam|shape)\.yaml"
    r"|springtune/studies/output/browse/assets/\w+\.(css|html|js)"
    r"|snakemake_logger_plugin_springtune/\w+\.py"
    rf"|{NAME}\.dist-info/(METADATA|WHEEL|RECORD|entry_points\.txt|licenses/LICENSE)"
)
"""All that a wheel may have."""


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
    assert metadata["Version"] == springtune.__version__
    assert metadata["Description-Content-Type"] == "text/markdown"
    return metadata.get_payload()


@pytest.fixture(scope="session")
def checkers(tmp_path_factory):
    """A Python that has twine and what renders a README."""
    folder = tmp_path_factory.mktemp("checkers") / "venv"
    done("uv", "venv", "--quiet", folder)
    wanted = ("--require-hashes", "-r", REPOSITORY / "requirements/release.txt")
    done("uv", "pip", "install", "--quiet", "--python", folder, *wanted)
    return folder / "bin/python"


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
    """Calls a program of the empty environment in an empty folder, whose name is `here`."""
    here = tmp_path / "empty"
    here.mkdir()
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(here), "LANG": "C.UTF-8"}

    def call(program, *arguments):
        command = [str(empty / program), *map(str, arguments)]
        return subprocess.run(command, cwd=here, env=environment, capture_output=True, text=True)

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


def test_the_source_has_what_a_clone_has(release):
    with tarfile.open(release[0]) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    wanted = ("Snakefile", "Makefile", "LICENSE", "CITATION.cff", "config/paper.yaml", "requirements/run.txt")
    wanted += (
        "workflow/rules/common.smk",
        "profiles/default/config.yaml",
        "workflow/profiles/README.md",
        "tools/setup.sh",
        "tests/conftest.py",
    )
    assert names.issuperset(wanted), set(wanted) - names
    assert not {name for name in names if name.startswith(("results", "build", ".venv", ".snakemake/"))}


def test_the_same_files_make_the_same_bytes(release, tree, tmp_path):
    for one, again in zip(release, built(tree, tmp_path)):
        assert one.read_bytes() == again.read_bytes(), one.name


# -- what an index shows -----------------------------------------------------------------------------------------------


def test_twine_has_nothing_to_say(release, checkers):
    said = done(checkers, "-m", "twine", "check", "--strict", *release)
    assert said.count("PASSED") == 2 and "WARNING" not in said, said


def test_the_readme_renders(description, checkers):
    program = "import sys; from readme_renderer import markdown; print(markdown.render(sys.stdin.read()))"
    page = done(checkers, "-c", program, input=description)
    assert re.search("<h1[^>]*>springtune<", page)
    assert page.count("<pre") >= 4 and page.count("<table>") == description.count("\n|---") > 0
    # Elsewhere there are no neighbours, and no pictures beside it.
    assert not re.findall(r"(?:href|src)=\"(?!https?:|#)[^\"]*", page)
    assert not re.findall(r"\]\((?!https?:)", description)


# -- what is installed -------------------------------------------------------------------------------------------------


def test_it_is_the_wheel_that_is_used(call, empty):
    found = call("python", "-c", "import springtune, sys; print(springtune.__file__, 'numpy' in sys.modules)")
    assert found.stdout.split()[0].startswith(str(empty.parent)), found
    assert found.stdout.split()[1] == "False"
    assert call("springtune", "--version").stdout.split()[-1] == springtune.__version__


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


def test_the_scene_of_the_readme_is_solved(call, description):
    code, shown = re.search(r"```python\n(.*?)```\n.*?```text\n(.*?)```", description, re.DOTALL).groups()
    found = call("python", "-c", code)
    assert (found.stdout, found.stderr) == (shown, "")


@pytest.mark.parametrize("shape", [(), ("--shape",)], ids=["beam", "shape"])
def test_a_study_is_written_and_told(call, shape):
    written = call("springtune", "new", "mine", *shape)
    assert written.returncode == 0, written.stderr
    # Without a workflow nothing runs it: that is said at once, and where to go.
    assert f"unpack {NAME}.tar.gz" in written.stdout and "clone" in written.stdout
    told = call("springtune", "scenes", "mine.yaml")
    assert told.returncode == 0, told.stderr
    assert re.search(rf"scenes +{4 if shape else 2}\b", told.stdout)


def test_running_says_what_is_missing_and_where_it_is(call):
    call("springtune", "new", "mine")
    before = sorted(call.here.iterdir())
    found = call("springtune", "run", "mine.yaml", "--cores", 1)
    assert found.returncode == 1
    assert "workflow" in found.stderr and f"unpack {NAME}.tar.gz" in found.stderr
    assert f"springtune run {call.here / 'mine.yaml'}" in found.stderr
    assert sorted(call.here.iterdir()) == before


@pytest.mark.parametrize("named", [False, True], ids=["there", "here"])
def test_the_source_runs_a_study(call, empty, release, named):
    """With the environment of the wheel, in the folder of the source or with it named: what the message tells to do."""
    with tarfile.open(release[0]) as file:
        file.extractall(call.here)
    call("springtune", "new", "mine")
    source = call.here / NAME
    environment = {"PATH": f"{empty}:/usr/bin:/bin", "HOME": str(call.here), "LANG": "C.UTF-8"}
    environment |= {"SPRINGTUNE_WORKFLOW": str(source)} if named else {}
    folder = call.here if named else source
    done(empty / "springtune", "run", call.here / "mine.yaml", "--cores", "1", cwd=folder, env=environment)
    assert (folder / "results/mine/dataset.nc").is_file()
    assert (folder / "results/mine/index.html").is_file()
    assert not (source / "results").exists() or not named


@pytest.mark.parametrize(
    "arguments, told",
    [
        (("predict", "--beam", "200x40", "--size", "5 mm", "--material", "steel"), "delingette"),
        (("definitions",), "lattice"),
        (("schema",), '"title"'),
        (("--help",), "predict"),
    ],
    ids=lambda value: value[0] if isinstance(value, tuple) else None,
)
def test_commands_work_in_an_empty_folder(call, arguments, told):
    found = call("springtune", *arguments)
    assert found.returncode == 0, found.stderr
    assert told in found.stdout


def test_springs_of_a_mesh_are_written(call):
    body = ("--beam", "60x12", "--size", "4 mm", "--material", "steel", "--load", "traction", "--force", "10 kN")
    found = call("springtune", "springs", *body, "--out", "plate.vtu")
    assert found.returncode == 0, found.stderr
    assert (call.here / "plate.vtu").stat().st_size
