#!/bin/sh
# Build the image of the Containerfile and use it as docs/how-to/use-a-container.md says: tests/container/run.sh
#
# Needs podman (Debian's will do) and a registry for the base image. Where none can be reached, BASE=debootstrap makes the
# base from Debian's mirror, as root: what is in it is what the registry's image is made of. Where no container can be
# started, inside of another for one, ISOLATION=chroot builds and runs by buildah in a chroot: by the image's user and
# environment, but with its file system as writable as that user finds it. Each step says what it shows.
set -eu
cd "$(dirname "$0")/../.."
image=springtune-test
debian=${DEBIAN:-bookworm}
scratch=$(mktemp -d)
container=
trap 'rm -rf "$scratch"; [ -z "$container" ] || buildah rm "$container" >/dev/null' EXIT
say() { echo "container: $*"; }
fail() { say "FAILED: $*" >&2; exit 1; }

command -v podman >/dev/null || fail "there is no podman; install it: apt-get install podman"
pull=missing
if [ "${BASE:-registry}" = debootstrap ]; then
    command -v debootstrap >/dev/null || fail "there is no debootstrap; install it: apt-get install debootstrap"
    if ! podman image exists "docker.io/library/debian:$debian-slim"; then
        debootstrap --variant=minbase --include=ca-certificates "$debian" "$scratch/root" http://deb.debian.org/debian \
            >/dev/null
        # Certificates of this machine: a mirror or a proxy of its own may need them.
        cp /etc/ssl/certs/ca-certificates.crt "$scratch/root/etc/ssl/certs/"
        tar -C "$scratch/root" -c . | podman import --quiet \
            --change "ENV SSL_CERT_FILE=/etc/ssl/certs/ca-certificates.crt" \
            --change "ENV PIP_CERT=/etc/ssl/certs/ca-certificates.crt" - "docker.io/library/debian:$debian-slim" >/dev/null
    fi
    pull=never
    say "base: debian:$debian by debootstrap, not the registry's"
fi
podman build --pull=$pull ${ISOLATION:+--isolation "$ISOLATION"} --build-arg "DEBIAN=$debian" --tag $image . \
    >"$scratch/log" 2>&1 || {
    tail -n 30 "$scratch/log"
    fail "it does not build; set BASE=debootstrap where there is no registry, ISOLATION=chroot where no container starts"
}
say "it builds: $(podman image inspect --format '{{.Size}}' $image | awk '{printf "%.2f GB", $1 / 1e9}')"

# As documented: a folder of one's own, a user whom the image does not know, nothing of the image writable.
mkdir "$scratch/work"
chown 12345:12345 "$scratch/work" 2>/dev/null || true
user=$(stat -c %u:%g "$scratch/work")
if [ "${ISOLATION:-}" = chroot ]; then
    container=$(buildah from --pull-never $image)
    called() { buildah run --isolation chroot "$container" -- "$@"; }
    used() { buildah run --isolation chroot --user "$user" --volume "$scratch/work:/work" "$container" -- "$@"; }
    say "commands run in a chroot, by the image's user and environment; its file system is not read-only"
else
    run="podman run --rm --read-only --tmpfs /tmp --entrypoint"
    as=--userns=keep-id
    [ "$(id -u)" != 0 ] || as=--user=$user
    # shellcheck disable=SC2086  # several options
    called() { program=$1; shift; $run "$program" $image "$@"; }
    # shellcheck disable=SC2086  # several options
    used() { program=$1; shift; $run "$program" "$as" --volume "$scratch/work:/work" $image "$@"; }
    podman run --rm $image | grep -q '^Usage: springtune' || fail "without a command it does not tell its commands"
fi
entry=$(podman image inspect --format '{{index .Config.Entrypoint 0}}' $image)

test "$(called id -u)" = 1000 || fail "its own user is not 1000"
called "$entry" --help | grep -q '^Usage: springtune' || fail "it does not tell its commands"
say "its own user is an ordinary one, and it tells its commands"

for program in pip uv gcc; do
    ! called sh -c "command -v $program" >/dev/null 2>&1 || fail "it holds $program"
done
test "$(called python -c '
import sys, pathlib, importlib.util as found
folders = [*pathlib.Path(sys.prefix).glob("lib/python*/site-packages/[a-z]*"), pathlib.Path("/opt/springtune/src")]
modules = [one for folder in folders for one in folder.rglob("*.py") if "bad" not in one.name and "test" not in str(one)]
lacking = [one for one in modules if not pathlib.Path(found.cache_from_source(str(one))).exists()]
print(len(lacking) > len(modules) / 100)')" = False || fail "bytecode is missing"
say "what installs is left outside, bytecode is inside"

! used sh -c 'echo >/opt/springtune/written' 2>/dev/null || fail "an ordinary user can write into the image"

used python -c '
import springtune as st
beam, steel = st.Beam("200 mm", "40 mm", thickness="1 mm"), st.Material("210 GPa", 0.3)
scene = st.Scene(beam, st.make_mesh(beam, "structured", "2 mm"), steel, "traction", "400 kN", definition="lattice")
result = scene.solve()
print(f"{1e3 * result.displacement:.4f} mm, {100 * result.error:+.2f} %, {result.status}")' >"$scratch/scene"
grep -qxF "$(cat "$scratch/scene")" README.md || fail "the scene of the README gives $(cat "$scratch/scene")"
say "the scene of the README gives the README's numbers"

used "$entry" new mine >/dev/null
used "$entry" run mine.yaml --cores 2 >"$scratch/log" 2>&1 || { cat "$scratch/log"; fail "its study does not run"; }
test -s "$scratch/work/results/mine/dataset.nc" || fail "there is no dataset"
strange=$(find "$scratch/work" ! -uid "$(stat -c %u "$scratch/work")")
test -z "$strange" || fail "files of another user: $strange"
say "a study of one's own runs; its results are in the folder, and the user's own"

if [ "${QUICK:-yes}" = yes ]; then
    used "$entry" run /opt/springtune/config/quick.yaml --cores 2 >"$scratch/log" 2>&1 ||
        { cat "$scratch/log"; fail "the quick study does not run"; }
    test -s "$scratch/work/results/quick/dataset.nc" || fail "there is no dataset"
    say "the quick study runs: every kind of study, figures and tables"
fi
say "done"
