#!/usr/bin/env bash
# Builds the Dockerfile, unchanged, and runs the image: `sudo tests/image.sh`. Works on a Debian machine
# without container engine, registry or daemon. Takes about five minutes on two cores, most of it for the
# release build.
#
# - podman builds and runs. All its state is in one temporary folder, which is removed when the script ends.
# - The two base images are stand-ins under the names that the Dockerfile uses. The last stage gets Debian
#   from the mirror that apt is configured with. The build stage gets the same plus a C compiler, with the
#   toolchain of this machine mounted.
# - No host name is written here. Whatever this machine needs to reach crates.io (proxy, CA bundle, cargo
#   settings) is passed to the build if it is present.
#
# What it checks:
#
# - The service becomes ready, the image's own health check passes, and a request is answered.
# - The process is not root and needs neither capabilities nor a writable file system.
# - SIGTERM ends the service at once with status 0, except that a request under way is still answered.
# - A cloud survives in the volume: another container with the same volume has it.
# - Without keys or explicit permission the service does not start.
set -euo pipefail

readonly image=localhost/gramian:test
readonly container=gramian
readonly needed_gib=4
readonly ready_seconds=30
readonly stop_seconds=5
readonly drain_seconds=30

say() { printf '[%4ds] %s\n' "$SECONDS" "$*"; }
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }

cd "$(dirname "${BASH_SOURCE[0]}")/.."
[[ $EUID -eq 0 ]] || fail "this needs root: it makes root file systems and containers"

work=$(mktemp -d "${TMPDIR:-/var/tmp}/gramian-image.XXXXXX")
# Build caches and unfinished layers go here too, so that nothing is left in /var/tmp.
export TMPDIR=$work/tmp
mkdir "$TMPDIR"

# vfs works on every file system, at the price of a full copy per layer. cgroupfs and no event log, because
# there may be no systemd. runc, because crun refuses machines whose cgroups are half v1, half v2. At any log
# level below `fatal`, podman would report at each step that it has no systemd for health check timers. An
# error that ends a command is printed anyway.
engine() {
  podman --log-level fatal --root "$work/storage" --runroot "$work/run" --tmpdir "$work/libpod" --storage-driver vfs \
    --cgroup-manager cgroupfs --events-backend none --runtime "$(command -v runc)" "$@"
}

# The container has its own network with only a loopback interface. So it cannot collide with a port of this
# machine, and opens none.
inside() { nsenter --net="/proc/$pid/ns/net" -- "$@"; }

clean_up() {
  local status=$?
  trap - EXIT
  set +e
  if [[ $status -ne 0 ]] && engine container exists "$container" 2>/dev/null; then
    printf 'The last lines of the container:\n' >&2
    engine logs --tail 40 "$container" >&2
  fi
  engine rm --force --all >/dev/null 2>&1
  rm -rf "$work"
  # Left empty by podman. rmdir refuses a folder that another container still uses.
  find /sys/fs/cgroup -depth -type d -path '*/libpod_parent*' -exec rmdir {} + 2>/dev/null
  exit "$status"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

free_gib=$(($(df --output=avail -k "$work" | tail -n 1) / 1024 / 1024))
((free_gib >= needed_gib)) || fail "$free_gib GiB are free in $(dirname "$work"), $needed_gib are needed; set TMPDIR"

say "packages"
export DEBIAN_FRONTEND=noninteractive
apt-get -qq update
apt-get -qq install --no-install-recommends podman runc mmdebstrap curl jq >"$work/apt.log" 2>&1 ||
  { cat "$work/apt.log" >&2; fail "apt-get could not install what this needs"; }

# apt is asked, rather than its files read, because it knows both of their formats.
# shellcheck disable=SC2016  # $(REPO_URI) is a field of apt's, not a command.
mirror=$(apt-get indextargets --format '$(REPO_URI)' \
  'Created-By: Packages' 'Codename: bookworm' 'Label: Debian' 'Component: main' | sort -u | head -n 1)
[[ -n $mirror ]] || fail "apt is configured with no mirror of Debian bookworm"
# Settings for fetching, such as proxies.
apt-config dump --format '%f "%v";%n' Acquire >"$work/apt.conf"

# debian TAG [mmdebstrap options]: imports a minimal Debian as TAG. The published slim image has no
# documentation, so this one has none either. Otherwise the size at the end would mean nothing. `--change`
# arguments for podman are in $changes.
changes=()
debian() {
  local tag=$1
  shift
  mmdebstrap --quiet --variant=minbase --aptopt="$work/apt.conf" --dpkgopt=force-unsafe-io \
    --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-exclude=/usr/share/man/*' \
    --dpkgopt='path-exclude=/usr/share/locale/*' "$@" bookworm - "$mirror" |
    engine import --quiet "${changes[@]}" - "$tag" >/dev/null
}

say "base image of the last stage"
debian docker.io/library/debian:bookworm-slim

rust_version=$(sed -n 's/^FROM rust:\([0-9.]*\)-bookworm AS build$/\1/p' Dockerfile)
[[ $(rustc --version) == "rustc $rust_version."* ]] ||
  fail "the Dockerfile builds with rust ${rust_version:-of an unknown version}, this machine has $(rustc --version)"

say "base image of the build stage: the same and a C compiler"
changes=(--change 'ENV CARGO_HOME=/usr/local/cargo' --change 'ENV PATH=/usr/local/rust/bin:/usr/sbin:/usr/bin:/sbin:/bin')
# Cargo's settings from the environment go into this image. As build arguments, each would need a line in the
# Dockerfile.
while IFS= read -r setting; do
  changes+=(--change "ENV ${setting%%=*}=\"${setting#*=}\"")
done < <(env | grep -E '^CARGO_(HTTP|NET|REGISTRIES|REGISTRY|SOURCE)_' | grep -v '^CARGO_HTTP_CAINFO=')
debian "docker.io/library/rust:$rust_version-bookworm" --include=gcc,libc6-dev,ca-certificates

# Mounted, not copied: otherwise each layer would hold the toolchain again.
mounts=(--volume "$(rustc --print sysroot):/usr/local/rust:ro")
ca_bundle=${CARGO_HTTP_CAINFO:-${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}}
[[ -f $ca_bundle ]] && mounts+=(--volume "$ca_bundle:/etc/ssl/certs/ca-certificates.crt:ro")
cargo_config=${CARGO_HOME:-$HOME/.cargo}/config.toml
[[ -f $cargo_config ]] && mounts+=(--volume "$cargo_config:/usr/local/cargo/config.toml:ro")

say "the image, with $(rustc --version)"
# Only the Docker format keeps a HEALTHCHECK. podman itself passes proxy variables on. Layers of single
# instructions would only speed up a second build, and there is none.
engine build --layers=false --isolation chroot --network host --pull=never --format docker "${mounts[@]}" --tag "$image" .

say "run"
# Without --ulimit, podman asks for more than this machine may be allowed to give. The health check has no
# timer, because that would need systemd. The check itself is run below.
limits=(--network none --health-interval disable --ulimit nofile=1000:1000 --ulimit nproc=1000:1000 --read-only
  --cap-drop all --security-opt no-new-privileges)
if engine run --rm "${limits[@]}" "$image" 2>"$work/refused.log"; then fail "it starts without keys or permission"; fi
grep -q GRAMIAN_ALLOW_ANONYMOUS "$work/refused.log" || fail "it does not say why it does not start: $(cat "$work/refused.log")"
say "without keys or permission it does not start"

# A new volume is filled from the image, so it belongs to the image's user.
start() {
  engine run --detach --name "$container" "${limits[@]}" --volume gramian-clouds:/var/lib/gramian \
    --env GRAMIAN_ALLOW_ANONYMOUS=1 --env GRAMIAN_STORE=/var/lib/gramian --env GRAMIAN_STORE_REQUIRED=1 "$image" >/dev/null
  pid=$(engine inspect --format '{{.State.Pid}}' "$container")
  local started=$SECONDS
  until [[ $(inside curl --silent --max-time 5 --output /dev/null --write-out '%{http_code}' http://127.0.0.1:8080/health/ready) == 200 ]]; do
    running || fail "the service ended before it was ready"
    ((SECONDS - started < ready_seconds)) || fail "/health/ready is not 200 after $ready_seconds s"
    sleep 0.2
  done
}
running() { [[ $(engine inspect --format '{{.State.Running}}' "$container") == true ]]; }
start
say "ready, with a volume for clouds"

engine healthcheck run "$container" || fail "the image's health check does not pass"
say "health check passes"

uid=$(awk '$1 == "Uid:" { print $2 }' "/proc/$pid/status")
[[ $uid -ne 0 ]] || fail "the service runs as root"
say "runs as user $uid"

jq --compact-output '{cloud: {points}, kernel: {family: "gauss", length_scale: 1.0}, alpha: 1e-10}' \
  examples/torus.json >"$work/request.json"
n_points=$(jq '.cloud.points | length' "$work/request.json")
status=$(inside curl --silent --show-error --max-time 60 --output "$work/answer.json" --write-out '%{http_code}' \
  --header 'content-type: application/json' --data-binary "@$work/request.json" http://127.0.0.1:8080/v1/curvatures)
[[ $status == 200 ]] || fail "POST /v1/curvatures answers $status: $(head -c 2000 "$work/answer.json")"
jq --exit-status --argjson n "$n_points" '.mean_curvatures | length == $n and all(type == "number")' \
  "$work/answer.json" >/dev/null ||
  fail "not $n_points mean curvatures: $(jq --compact-output .mean_curvatures "$work/answer.json" | head -c 2000)"
say "$n_points mean curvatures of the torus"

id=$(jq --raw-output .diagnostics.cloud_id "$work/answer.json")
stop() { # stop [SECONDS]: ends the service within that time, by default stop_seconds
  local started=$SECONDS seconds=${1:-$stop_seconds} exit_code
  engine stop --time $((2 * seconds)) "$container" >/dev/null
  exit_code=$(engine inspect --format '{{.State.ExitCode}}' "$container")
  [[ $exit_code -eq 0 ]] || fail "SIGTERM ends the service with status $exit_code"
  ((SECONDS - started <= seconds)) || fail "it took $((SECONDS - started)) s to end after SIGTERM"
}
stop
say "SIGTERM ends it with status 0"

engine rm "$container" >/dev/null
start
status=$(inside curl --silent --output "$work/cloud.json" --write-out '%{http_code}' "http://127.0.0.1:8080/v1/clouds/$id")
[[ $status == 200 ]] || fail "the cloud is not there any more: $status $(head -c 2000 "$work/cloud.json")"
say "another container on the volume has the cloud"

jq --null-input --compact-output '{cloud: {points: [range(6000) | [(. * 2.4 | cos), (. * 2.4 | sin), . / 3000]]},
  kernel: {family: "matern", length_scale: 0.3}, alpha: 1e-6}' >"$work/slow.json"
inside curl --silent --show-error --max-time 60 --output /dev/null --write-out '%{http_code}' \
  --header 'content-type: application/json' --data-binary "@$work/slow.json" \
  http://127.0.0.1:8080/v1/normals >"$work/slow.status" &
slow=$!
until inside curl --silent http://127.0.0.1:8080/metrics | grep -q '^gramian_compute_admitted 1$'; do
  kill -0 "$slow" 2>/dev/null || fail "the slow request was over too soon: $(cat "$work/slow.status")"
done
stop "$drain_seconds"
wait "$slow" || fail "the request that was under way when SIGTERM came was cut off"
[[ $(cat "$work/slow.status") == 200 ]] || fail "the request that was under way is answered $(cat "$work/slow.status")"
say "SIGTERM waits for the request that is under way"
mib() { awk -v bytes="$1" 'BEGIN { printf "%.1f MiB", bytes / 1048576 }'; }
total=$(engine image inspect --format '{{.Size}}' "$image")
base=$(engine image inspect --format '{{.Size}}' docker.io/library/debian:bookworm-slim)
say "the image passed: $(mib "$total"), of which $(mib $((total - base))) are not its base image"
