#!/bin/sh
# Build the image of the Containerfile and use it as docs/how-to/use-a-container.md says: tests/container/run.sh
#
# Needs podman (Debian's will do) and a registry for the base image. Where none can be reached, BASE=debootstrap makes the
# base from Debian's mirror, as root: what is in it is what the registry's image is made of. Each step says what it shows.
set -eu
cd "$(dirname "$0")/../.."
image=springtune-test
debian=${DEBIAN:-bookworm}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
say() { echo "container: $*"; }
fail() { say "FAILED: $*" >&2; exit 1; }

command -v podman >/dev/null || fail "there is no podman; install it: apt-get install podman"
pull=missing
if [ "${BASE:-registry}" = debootstrap ]; then
    command -v debootstrap >/dev/null || fail "there is no debootstrap; install it: apt-get install debootstrap"
    if ! podman image exists "docker.io/library/debian:$debian-slim"; then
        debootstrap --variant=minbase --include=ca-certificates "$debian" "$scratch/root" http://deb.debian.org/debian >/dev/null
        # Certificates of this machine: a mirror or a proxy of its own may need them.
        cp /etc/ssl/certs/ca-certificates.crt "$scratch/root/etc/ssl/certs/"
        tar -C "$scratch/root" -c . | podman import --quiet \
            --change "ENV SSL_CERT_FILE=/etc/ssl/certs/ca-certificates.crt" \
            --change "ENV PIP_CERT=/etc/ssl/certs/ca-certificates.crt" - "docker.io/library/debian:$debian-slim" >/dev/null
    fi
    pull=never
    say "base: debian:$debian by debootstrap, not the registry's"
fi
podman build --quiet --pull=$pull ${ISOLATION:+--isolation "$ISOLATION"} --build-arg "DEBIAN=$debian" --tag $image . >/dev/null
say "it builds: $(podman image inspect --format '{{.Size}}' $image | awk '{printf "%.2f GB", $1 / 1e9}')"

# As documented: a folder of one's own, a user whom the image does not know, nothing of the image writable.
mkdir "$scratch/work"
chown 12345:12345 "$scratch/work" 2>/dev/null || true
user="--user $(stat -c %u:%g "$scratch/work")"
# shellcheck disable=SC2086  # several options
called() { podman run --rm --read-only --tmpfs /tmp ${RUN:-} "$@"; }
used() { called $user --volume "$scratch/work:/work" "$@"; }

test "$(called --entrypoint id $image -u)" = 1000 || fail "its own user is not 1000"
called $image --help | grep -q '^Usage: springtune' || fail "without a command it does not tell its commands"
say "its own user is an ordinary one, and without a command it tells its commands"

called --entrypoint sh $image -c '! command -v gcc && ! command -v pip && ! command -v uv' || fail "it holds what installs"
missing=$(called --entrypoint sh $image -c '
    find /opt/venv/lib /opt/springtune/src -name "*.py" -path "*/springtune/*" | while read -r file; do
        ls "${file%/*}/__pycache__/$(basename "$file" .py)".*.pyc >/dev/null 2>&1 || echo "$file"; done')
test -z "$missing" || fail "bytecode is missing of: $missing"
say "what installs is left outside, bytecode is inside"

used --entrypoint python $image -c '
import springtune as st
beam, steel = st.Beam("200 mm", "40 mm", thickness="1 mm"), st.Material("210 GPa", 0.3)
scene = st.Scene(beam, st.make_mesh(beam, "structured", "2 mm"), steel, "traction", "400 kN", definition="lattice")
result = scene.solve()
print(f"{1e3 * result.displacement:.4f} mm, {100 * result.error:+.2f} %, {result.status}")' >"$scratch/scene"
grep -qxF "$(cat "$scratch/scene")" README.md || fail "the scene of the README gives $(cat "$scratch/scene")"
say "the scene of the README gives the README's numbers"

used $image new mine >/dev/null
used $image run mine.yaml --cores 2 >"$scratch/log" 2>&1 || { cat "$scratch/log"; fail "its study does not run"; }
test -s "$scratch/work/results/mine/dataset.nc" || fail "there is no dataset"
strange=$(find "$scratch/work" ! -uid "$(stat -c %u "$scratch/work")")
test -z "$strange" || fail "files of another user: $strange"
say "a study of one's own runs; its results are in the folder, and the user's own"

if [ "${QUICK:-yes}" = yes ]; then
    used $image run /opt/springtune/config/quick.yaml --cores 2 >"$scratch/log" 2>&1 ||
        { cat "$scratch/log"; fail "the quick study does not run"; }
    test -s "$scratch/work/results/quick/dataset.nc" || fail "there is no dataset"
    say "the quick study runs: every kind of study, figures and tables"
fi
say "done"
