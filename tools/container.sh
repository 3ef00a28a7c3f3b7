#!/bin/sh
# What the container image runs: springtune, with a home folder that can be written.
#
# numba, matplotlib and Snakemake keep caches there. A user whom the image does not know has none, or one of others.
if [ ! -w "${HOME:-/}" ] || [ "${HOME:-/}" = / ]; then
    HOME=${TMPDIR:-/tmp}/springtune-$(id -u)
    mkdir -p -m 700 "$HOME" || exit 1
    export HOME
fi
# A user without a name: Snakemake asks for one.
if ! id -un >/dev/null 2>&1; then
    export LOGNAME="${LOGNAME:-user-$(id -u)}"
fi
exec springtune "$@"
