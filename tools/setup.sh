#!/bin/sh
# Make or complete .venv: tools/setup.sh run|test
#
# Needs python3 (3.11 or newer) only. Debian ships python3 without ensurepip; pip then comes out of Debian's own package
# of it, unpacked into .venv, so nobody has to be root.
set -eu
cd "$(dirname "$0")/.."
what=$1
venv=.venv
python=$venv/bin/python
say() { echo "setup: $*" >&2; }

python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    say "python3 is $(python3 -c 'import platform; print(platform.python_version())'), but 3.11 or newer is needed;" \
        "put one first on PATH"
    exit 1
}
rm -f "$venv/.$what"
if ! "$python" -c '' 2>/dev/null; then
    say "making $venv"
    rm -rf "$venv"
    python3 -m venv --without-pip "$venv"
fi

# pip: the one in .venv, else bundled with Python, else Debian's.
debian_pip() {
    apt=$venv/apt
    mkdir -p "$apt/lists/partial" "$apt/cache/archives/partial"
    set -- -qq -o "Dir::State::lists=$PWD/$apt/lists" -o "Dir::Cache=$PWD/$apt/cache" -o Debug::NoLocking=1
    apt-get "$@" update && (cd "$apt" && apt-get "$@" download python3-pip-whl) || return 1
    dpkg-deb -x "$apt"/python3-pip-whl_*.deb "$apt/unpacked"
    wheel=$(echo "$apt"/unpacked/usr/share/python-wheels/pip-*.whl)
    "$python" "$wheel/pip" install --quiet --no-index --find-links "$apt/unpacked/usr/share/python-wheels" pip
    rm -rf "$apt"
}
if ! "$python" -m pip --version >/dev/null 2>&1; then
    "$python" -m ensurepip >/dev/null 2>&1 || debian_pip || {
        say "this Python has no pip and Debian's could not be fetched; install it with: apt-get install python3-venv"
        exit 1
    }
fi

[ -e "$venv/bin/pip" ] || ln -s pip3 "$venv/bin/pip" # ensurepip makes no command of this name

# uv installs in a third of the time, but does not read pip's configuration; where it gets nowhere, pip does the work.
say "installing the packages of requirements/$what.txt"
install() {
    if "$python" -m pip install --quiet --require-hashes -r requirements/installer.txt; then
        "$python" -m uv pip install --quiet --compile-bytecode --python "$python" "$@" && return
        say "uv failed, trying pip"
    fi
    "$python" -m pip install --quiet "$@"
}
install --require-hashes -r "requirements/$what.txt" || {
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 14))' && ! command -v cc >/dev/null &&
        say "for Python 3.14 a package that Snakemake needs, immutables, had to be compiled when this was written;" \
            "install a compiler (apt-get install gcc python3-dev), or put an older python3 first on PATH"
    exit 1
}
if [ "$what" = run ]; then
    sed -n '/^cvxopt==/,/[^\\]$/p' requirements/test.txt >"$venv/cholesky.txt"
    install --only-binary :all: --require-hashes -r "$venv/cholesky.txt" ||
        say "no CHOLMOD for this machine: SuperLU factorizes in its place, in three to five times the time"
fi
"$python" -m pip install --quiet --no-deps --no-build-isolation --no-index --editable .
"$python" -m compileall -q src || true # read-only sources only start a little later
touch "$venv/.$what"
