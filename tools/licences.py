"""Write the licences of all dependencies into docs/licences.csv: python tools/licences.py [--check].

Names are those of the lock files, for all systems and versions of Python; licences are what each package says of
itself, and stand in OWN where it says nothing, too little, or is not installed here.
"""

import csv
import io
import re
import sys
import tomllib
from importlib.metadata import PackageNotFoundError, metadata
from pathlib import Path

from packaging.requirements import Requirement

REPOSITORY = Path(__file__).parents[1]
PAGE, TABLE = REPOSITORY / "docs/licences.md", REPOSITORY / "docs/licences.csv"

OWN = {
    "appnope": "BSD-2-Clause",
    "cffi": "MIT-0",
    "colorama": "BSD-3-Clause",
    "comm": "BSD-3-Clause",
    "conda-inject": "MIT",
    "contourpy": "BSD-3-Clause",
    "cvxopt": "GPL-3.0-or-later",
    "cycler": "BSD-3-Clause",
    "docutils": "public domain, BSD-2-Clause",  # what is under the GPL, for Emacs, is in none of its wheels
    "flexcache": "BSD-3-Clause",
    "gitdb": "BSD-3-Clause",
    "h5netcdf": "BSD-3-Clause",
    "jinja2": "BSD-3-Clause",
    "kiwisolver": "BSD-3-Clause",
    "matplotlib": "Matplotlib's, like PSF-2.0",
    "mpmath": "BSD-3-Clause",
    "nbformat": "BSD-3-Clause",
    "nest-asyncio2": "BSD-2-Clause",
    "netgen-occt": "LGPL-2.1-only WITH OCCT-exception-1.0",
    "newton": "Apache-2.0",
    "numba": "BSD-2-Clause",
    "packaging": "Apache-2.0 OR BSD-2-Clause",
    "pexpect": "ISC",
    "pint": "BSD-3-Clause",
    "prompt-toolkit": "BSD-3-Clause",
    "ptyprocess": "ISC",
    "pycparser": "BSD-3-Clause",
    "pygeoif": "LGPL-2.1-or-later",
    "pypdfium2": "BSD-3-Clause or Apache-2.0",
    "pyreadline3": "BSD-3-Clause",
    "pyudunits2": "BSD-3-Clause",
    "scikit-fem": "BSD-3-Clause",
    "scipy": "BSD-3-Clause",
    "snakemake-interface-common": "MIT",
    "snakemake-interface-logger-plugins": "MIT",
    "snakemake-interface-report-plugins": "MIT",
    "snakemake-interface-scheduler-plugins": "MIT",
    "snakemake-interface-storage-plugins": "MIT",
    "sympy": "BSD-3-Clause",
    "traitlets": "BSD-3-Clause",
    "warp-lang": "Apache-2.0",
}
"""Of packages whose metadata has no licence, a text in place of a name, or the name of a family of licences."""

NAMES = {
    "apache 2.0": "Apache-2.0",
    "apache license, version 2.0": "Apache-2.0",
    "apache software license": "Apache-2.0",
    "bsd": "BSD",
    "bsd license": "BSD",
    "mit license": "MIT",
    "mozilla public license 2.0 (mpl 2.0)": "MPL-2.0",
    "python software foundation license": "PSF-2.0",
}
"""SPDX's names of what packages write."""

PARTS = ("run", "cholesky", "export", "paper", "engines", "test")
"""What needs a package: springtune itself, one of its extras, or tests, pages and builds."""


class UnknownLicenceError(Exception):
    """The licence of a package cannot be read."""


def licence_of(name):
    """SPDX expression, or name, of a package's licence."""
    if name in OWN:
        return OWN[name]
    try:
        said = metadata(name)
    except PackageNotFoundError:
        raise UnknownLicenceError(
            f"{name} is not installed here; add its licence to OWN in tools/licences.py"
        ) from None
    if said["License-Expression"]:
        return said["License-Expression"]
    families = [one.rpartition(" :: ")[2] for one in said.get_all("Classifier") or () if one.startswith("License ::")]
    for one in (said["License"] or "", *families):
        if one.lower() in NAMES or re.fullmatch(r"[A-Z]\S+(?: (?:OR|AND|WITH) \S+)*", one):
            return NAMES.get(one.lower(), one)
    raise UnknownLicenceError(f"{name} does not tell its licence; read it, and add it to OWN in tools/licences.py")


def normal(name):
    """Name of a package as lock files have it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def locked(file):
    """Names in a lock file."""
    return set(re.findall(r"^([\w.-]+)==", (REPOSITORY / f"requirements/{file}.txt").read_text(), re.MULTILINE))


def needed(names, known):
    """Names, and what they need on any system, as far as it is known."""
    found, ahead = set(), {(name, frozenset()) for name in names}
    seen = set()
    while ahead:
        name, extras = ahead.pop()
        seen.add((name, extras))
        if name in known:
            found.add(name)
        try:
            said = metadata(name).get_all("Requires-Dist") or ()
        except PackageNotFoundError:
            continue
        for one in map(Requirement, said):
            wanted = re.search(r"extra == ['\"]([\w-]+)", str(one.marker or ""))
            if not wanted or wanted[1] in extras:
                ahead |= {(normal(one.name), frozenset(one.extras))} - seen
    return found


def parts():
    """Names of packages by part of PARTS; each stands where it is first needed."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    every = locked("run") | locked("engines") | locked("test")
    found, left = {}, set(every)
    for part in PARTS:
        if part == "test":
            mine = every
        elif part == "engines":  # not installed where this runs, so that its lock file says what it needs
            mine = locked(part)
        else:
            listed = project["dependencies"] if part == "run" else extras[part]
            mine = needed({normal(Requirement(one).name) for one in listed}, every)
        found[part] = mine & left
        left -= mine
    return found


def table():
    """Return the text of the table: package, licence, and what needs the package."""
    rows = [(name, licence_of(name), part) for part, names in parts().items() for name in sorted(names)]
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([("package", "licence", "needed by"), *rows])
    return text.getvalue()


def main(check):
    """Write the table, or say whether it is what would be written."""
    try:
        wanted = table()
    except UnknownLicenceError as error:
        sys.exit(f"licences: {error}")
    if check and TABLE.read_text() != wanted:
        sys.exit("licences: docs/licences.csv is not what the lock files ask for; `make lock` writes it")
    if not check:
        TABLE.write_text(wanted)


if __name__ == "__main__":
    main("--check" in sys.argv[1:])
