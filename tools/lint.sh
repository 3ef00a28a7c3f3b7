#!/bin/sh
# All hooks of .pre-commit-config.yaml on all files: tools/lint.sh
#
# pre-commit asks git which files there are. What is not a clone, an unpacked archive or a copy, is a repository outside
# of it for as long as this takes.
set -eu
cd "$(dirname "$0")/.."
if ! command -v git >/dev/null; then
    echo "lint: pre-commit asks git for the files, and there is no git; install it: apt-get install git" >&2
    exit 1
fi
if [ "$(git rev-parse --show-toplevel 2>/dev/null)" != "$(pwd -P)" ]; then
    GIT_DIR=$(mktemp -d)
    GIT_WORK_TREE=$(pwd -P)
    export GIT_DIR GIT_WORK_TREE
    trap 'rm -rf "$GIT_DIR"' EXIT
    git init --quiet
    git add --all
fi
.venv/bin/pre-commit run --all-files --show-diff-on-failure
