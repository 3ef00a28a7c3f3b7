#!/bin/sh
# Install the programs of requirements/engines.txt apart from .venv: tools/engines.sh FOLDER
#
# The folder is for PYTHONPATH. A program without a wheel for this machine, or that the index lacks, is left out by name.
set -eu
cd "$(dirname "$0")/.."
folder=$1
say() { echo "engines: $*" >&2; }
install() { python -m uv pip install --quiet --only-binary :all: --target "$folder" "$@"; }

rm -rf "$folder"
mkdir -p "$folder"
install --require-hashes --no-deps --requirement requirements/engines.txt && exit
say "not all at once, trying one by one"
grep -v '^#' requirements/engines.in | while read -r line; do
    install --constraint requirements/engines.txt "$line" || say "no ${line%%[>[]*} on this machine: its tests are skipped"
done
