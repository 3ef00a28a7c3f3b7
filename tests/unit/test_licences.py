"""The page of licences is that of the lock files, and only the extra that says so is under the GPL."""

import importlib.util
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "tools/licences.py"


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_what_the_lock_files_ask_for(licences):
    licences.main(check=True)


def test_a_page_of_before_is_told(licences, tmp_path, monkeypatch):
    page = tmp_path / "licences.md"
    page.write_text(licences.PAGE.read_text().replace(", xarray", ""))
    monkeypatch.setattr(licences, "PAGE", page)
    with pytest.raises(SystemExit, match="`make licences` writes it"):
        licences.main(check=True)
    licences.main(check=False)
    licences.main(check=True)


def test_every_package_stands_once(licences):
    listed = [name for names in licences.parts().values() for name in names]
    assert len(listed) == len(set(listed))
    assert set(listed) == licences.locked("run") | licences.locked("cholesky") | licences.locked("test")


def test_the_gpl_comes_with_one_extra_only(licences):
    parts = licences.parts()
    assert parts["cholesky"] == {"cvxopt"}
    assert licences.licence_of("cvxopt").startswith("GPL")
    names = parts["run"] | parts["export"] | parts["paper"]
    assert not {name for name in names if licences.licence_of(name).startswith(("GPL", "AGPL"))}


def test_what_is_not_known_is_asked_for(licences):
    with pytest.raises(
        licences.UnknownLicenceError, match="no-such-package is not installed here; add its licence to OWN"
    ):
        licences.licence_of("no-such-package")


def test_a_package_that_says_nothing_is_asked_for(licences, tmp_path, monkeypatch):
    folder = tmp_path / "silent-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: silent\nVersion: 1.0\n")
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    with pytest.raises(
        licences.UnknownLicenceError, match="silent does not tell its licence; read it, and add it to OWN"
    ):
        licences.licence_of("silent")
