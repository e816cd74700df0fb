#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds the Dockerfile's four images and tries them, on Debian 12 and without a Docker engine: debootstrap makes the
# base from this machine's own apt sources, buildah builds, podman runs, and docker-compose starts the farm of
# compose.yaml through podman's own API. Redis, HAProxy and Prometheus there are Debian's, under the names of the images
# that the file has. Needs root. Images and containers have a storage of their own in build/check-image.
#
#   deploy/check-image.sh           everything, some fifteen minutes, most of them compiling; leaves nothing behind
#   deploy/check-image.sh --keep    keeps the storage: the next run with --keep builds only what has changed
#   deploy/check-image.sh --clean   only removes what --keep or an interrupted run left
#
# Ends with a table of what was measured; exit code 1 if a line of it fails.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=deploy/bare_debian.sh
source deploy/bare_debian.sh

readonly work=$PWD/build/check-image
readonly base=debian:12-slim # The Dockerfile's own FROM name.
readonly user=65532
readonly most_slim_mb=130
readonly most_start_ms=1000
readonly memory=1GiB
readonly starts=5 # The best of them counts: whatever else the machine does only adds.
# For the drain: a few seconds on the two CPUs that the server gets.
readonly long_job=(--pitch "0.2,0.2,0.03" --channel hardness --layers 240..335 --encoding zstd)
keep=no
failures=0
rows=()
background=() # What is to end with the script.

step() {
  printf '== %s\n' "$*"
}

fail() {
  echo "check-image.sh: $*" >&2
  exit 1
}

now_ms() {
  date +%s%3N
}

# Runs a command whose output only matters when it fails.
quietly() {
  "$@" >"$work/step.log" 2>&1 || {
    tail --lines 60 "$work/step.log" >&2
    fail "failed: $*"
  }
}

# row <what> <found> <wanted> <command...>: a line of the table; passes if the command does.
row() {
  local what=$1 found=$2 wanted=$3 verdict=ok
  "${@:4}" >"$work/row.log" 2>&1 || {
    verdict=FAILED
    failures=$((failures + 1))
    cat "$work/row.log" >&2
  }
  rows+=("$what|$found|$wanted|$verdict")
  printf '   %s: %s (%s) %s\n' "$what" "$found" "$wanted" "$verdict"
}

# runs <what> <command...>: a line of the table about a command that must succeed.
runs() {
  local code=0
  "${@:2}" >"$work/command.log" 2>&1 || code=$?
  ((code == 0)) || cat "$work/command.log" >&2
  row "$1" "exit code $code" "0" test "$code" = 0
}

refuses() {
  ! "$@"
}

# --- Storage ----------------------------------------------------------------------------------------------------------

# Descriptor 9 is this run's lock; a container's monitor would hold on to it.
containers() {
  podman --tmpdir "$work/podman" "$@" 9>&-
}

open_storage() {
  mkdir -p "$work/data"
  cat >"$work/storage.conf" <<CONF
[storage]
driver = "overlay"
graphroot = "$work/storage"
runroot = "$work/run"
CONF
  # Descriptors and processes as root has them here; hosts may have less than an engine asks for.
  cat >"$work/containers.conf" <<CONF
[containers]
default_ulimits = ["nofile=16384:16384", "nproc=4096:4096"]
[engine]
cgroup_manager = "cgroupfs"
compat_api_enforce_docker_hub = false
events_logger = "file"
helper_binaries_dir = ["/usr/lib/podman"]
runtime = "runc"
[network]
network_backend = "netavark"
CONF
  export CONTAINERS_STORAGE_CONF=$work/storage.conf CONTAINERS_CONF=$work/containers.conf
}

# Ends containers and mounts, also those of an interrupted run.
release() {
  [[ -e $work/storage.conf ]] || return 0
  containers rm --all --force --time 0 >/dev/null 2>&1 || true
  buildah rm --all >/dev/null 2>&1 || true
  local mount
  while read -r mount; do
    umount "$mount" || fail "$mount is in use; end what uses it, then: deploy/check-image.sh --clean"
  done < <(awk -v work="$work/" 'index($2, work) == 1 { print $2 }' /proc/mounts | sort --reverse)
  rm -rf --one-file-system "$work"/{base,data,changed,others,podman,podman.sock,run}
}

end_background() {
  ((${#background[@]} > 0)) || return 0
  kill "${background[@]}" 2>/dev/null || true
  wait "${background[@]}" 2>/dev/null || true
  background=()
}

clean() {
  end_background
  release
  [[ $keep == yes ]] || rm -rf --one-file-system "$work"
}

# --- Base -------------------------------------------------------------------------------------------------------------

# Leaves out what Docker's own slim image does, so that sizes compare.
slim_down() {
  local root=$1
  find "$root/usr/share/doc" ! -type d ! -name copyright -delete
  find "$root/usr/share/doc" -type d -empty -delete
  rm -rf "$root"/usr/share/{groff,info,linda,lintian,locale,man}/* "$root"/var/{cache/apt,lib/apt/lists}/*
}

make_base() {
  if containers image exists "$base"; then return; fi
  step "Base: Debian 12 by debootstrap"
  rm -rf --one-file-system "$work/base"
  quietly bare_debian "$work/base"
  slim_down "$work/base"
  local container
  container=$(buildah from scratch)
  quietly buildah add --quiet "$container" "$work/base"
  quietly buildah config --cmd bash --env PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin "$container"
  quietly buildah commit --quiet --rm --format docker "$container" "$base"
  rm -rf --one-file-system "$work/base"
}

# --- Images -----------------------------------------------------------------------------------------------------------

# build <context> <target> [option...]: prints the image's id. Without the docker format the health check is dropped.
build() {
  local context=$1 target=$2
  buildah build --quiet --isolation chroot --pull-never --layers --format docker --target "$target" "${@:3}" \
    "$context" 2>"$work/build.log" || {
    tail --lines 60 "$work/build.log" >&2
    fail "building $target failed"
  }
}

build_images() {
  local version revision target seconds
  version=$(cmake/version.sh)
  revision=$(git rev-parse HEAD 2>/dev/null || echo unknown)
  for target in server server-slim client farm; do
    step "Image: $target"
    seconds=$SECONDS
    build . "$target" --tag "ccslice/$target" --build-arg "VERSION=$version" --build-arg "REVISION=$revision" >/dev/null
    echo "   built in $((SECONDS - seconds)) s"
  done
}

of_image() {
  containers image inspect --format "$2" "ccslice/$1"
}

check_sizes() {
  local target mb most
  for target in server server-slim client farm; do
    mb=$(($(of_image "$target" '{{.Size}}') / 1000000))
    most=$([[ $target == server-slim ]] && echo "$most_slim_mb" || echo 1500)
    row "$target: size" "$mb MB" "<= $most MB" test "$mb" -le "$most"
  done
}

check_configuration() {
  local target found
  for target in server server-slim; do
    found=$(of_image "$target" '{{.User}} {{.Config.StopSignal}} {{.HealthCheck.Test}}')
    row "$target: user, stop signal, health check" "$found" "as in the Dockerfile" \
      test "$found" = "$user:$user SIGTERM [CMD /usr/local/bin/ccsliced --health-check]"
  done
  for target in client farm; do
    found=$(of_image "$target" '{{.User}}')
    row "$target: user" "$found" "as in the Dockerfile" test "$found" = "$user:$user"
  done
}

# A changed source file must reach the compiler and leave the layers of packages alone.
check_package_layers() {
  step "Layers after a change of a source file"
  local stage before after
  mkdir -p "$work/changed"
  tar --create --exclude=./build --exclude=./.git --exclude=./out . | tar --extract --directory "$work/changed"
  echo "// Changed." >>"$work/changed/server/main.cpp"
  for stage in build-packages server-packages server-slim-packages client-packages farm-packages; do
    before=$(build . "$stage")
    after=$(build "$work/changed" "$stage")
    row "source changed: $stage" "${after:0:12}" "the same layer" test "$before" = "$after"
  done
  before=$(build . sources)
  after=$(build "$work/changed" sources)
  row "source changed: sources" "${after:0:12}" "another layer" test "$before" != "$after"
}

# --- Containers -------------------------------------------------------------------------------------------------------

# As a cloud runs them: no capability, no way to gain one, no writable root. No timers for the health check: they are
# systemd's.
readonly confined=(
  --read-only
  --read-only-tmpfs=false
  --cap-drop all
  --security-opt no-new-privileges
  --ulimit nofile=4096:4096
  --ulimit nproc=4096:4096
)

# ccslice <argument...>: the client image, in the server's network, with $work/data at /data.
ccslice() {
  containers run --rm "${confined[@]}" --network container:server --env CCSLICE_SERVER=127.0.0.1:50051 \
    --volume "$work/data:/data" ccslice/client "$@"
}

# run_server <name> <address of its health> <image> <podman's option...>: sets pid, and serving_ms: from podman's start to
# health being SERVING.
run_server() {
  local name=$1 health=$2 image=$3 begin
  begin=$(now_ms)
  quietly containers run --detach --name "$name" "${confined[@]}" --health-interval disable \
    --memory "${memory%iB}" --cpus 2 "${@:4}" "ccslice/$image"
  pid=$(containers inspect --format '{{.State.Pid}}' "$name")
  until nsenter --target "$pid" --mount --net /usr/local/bin/ccsliced --health-check "$health" >/dev/null 2>&1; do
    if [[ ! -e /proc/$pid ]] || (($(now_ms) - begin > 30000)); then
      containers logs "$name" >&2
      fail "$image doesn't serve"
    fi
  done
  serving_ms=$(($(now_ms) - begin))
}

# start_server <image>: as run_server, alone.
start_server() {
  containers rm --all --force --time 0 >/dev/null
  run_server server 127.0.0.1:50051 "$1" --network none
}

check_confinement() {
  local image=$1 status seen
  status=$(awk '/^(Uid|Gid|CapEff|CapBnd|NoNewPrivs):/ { printf "%s%s %s", sep, $1, $3 ? $3 : $2; sep = ", " }' \
    "/proc/$pid/status")
  row "$image: process" "$status" "no root, no capability" \
    test "$status" = "Uid: $user, Gid: $user, CapEff: 0000000000000000, CapBnd: 0000000000000000, NoNewPrivs: 1"
  row "$image: root file system" "$(awk '$5 == "/" { print substr($6, 1, 2) }' "/proc/$pid/mountinfo")" "ro" \
    refuses containers exec server touch /file
  seen=$(containers exec server /usr/local/bin/ccsliced --help | sed -n 's/^ *--memory SIZE *(default: \(.*\))$/\1/p')
  row "$image: memory limit seen" "$seen" "$memory" test "$seen" = "$memory"
  runs "$image: health check inside" containers healthcheck run server
}

# encodings <image>: what the server says that it writes.
encodings() {
  ccslice info | sed -n 's/^ *encodings *//p'
}

check_slicing() {
  local image=$1 job=(/data/ring.ccmesh --pitch 0.5 --channel hardness --layers 10..13)
  runs "$image: client uploads the ring" ccslice upload /data/ring.ccmesh
  runs "$image: client slices as zstd" ccslice slice "${job[@]}" --encoding zstd --output "/data/$image"
  row "$image: encodings" "$(encodings)" "with png" grep -qw png <(encodings)
  runs "$image: client slices as png" ccslice slice "${job[@]}" --encoding png --output "/data/$image-png"
  if [[ $image == server ]]; then
    runs "$image: client slices as tiff" ccslice slice "${job[@]}" --encoding tiff --output "/data/$image-tiff"
  else
    ccslice slice "${job[@]}" --encoding tiff --output /data/refused >"$work/refusal.log" 2>&1 || true
    row "$image: tiff asked for" "$(grep -o "TIFF and EXR aren't built in" "$work/refusal.log" || echo "not refused so")" \
      "refused, with why" grep -q "TIFF and EXR aren't built in" "$work/refusal.log"
  fi
}

# SIGTERM while a client is being served: the call goes on to its end, then the server's exit code is 0.
check_drain() {
  local image=$1 client client_code=0 running=ended code signal
  signal=$(of_image "$image" '{{.Config.StopSignal}}')
  ccslice slice /data/ring.ccmesh "${long_job[@]}" --output "/data/$image-drained" >"$work/client.log" 2>&1 &
  client=$!
  until compgen -G "$work/data/$image-drained/*.zst" >/dev/null; do
    kill -0 "$client" 2>/dev/null || {
      cat "$work/client.log" >&2
      fail "the client ended before its first layer"
    }
    sleep 0.05
  done
  containers kill --signal "$signal" server >/dev/null
  kill -0 "$client" 2>/dev/null && running=running
  code=$(containers wait server)
  wait "$client" || client_code=$?
  ((client_code == 0)) || cat "$work/client.log" >&2
  row "$image: $signal during a call" "call $running, exit code $code, client's $client_code" "finished, 0 and 0" \
    test "$running $code $client_code" = "running 0 0"
}

# Starts it several times, and leaves the last one running.
check_start() {
  local image=$1 most=10000 best=99999 i
  [[ $image == server-slim ]] && most=$most_start_ms
  for ((i = 0; i < starts; ++i)); do
    start_server "$image"
    best=$((serving_ms < best ? serving_ms : best))
  done
  row "$image: podman run to SERVING, best of $starts" "$best ms" "<= $most ms" test "$best" -le "$most"
}

check_server() {
  step "Container: $1"
  check_start "$1"
  check_confinement "$1"
  check_slicing "$1"
  check_drain "$1"
}

# --- Two servers ------------------------------------------------------------------------------------------------------

# An authority, a certificate for 127.0.0.1, and a token.
make_identity() {
  local folder=$1 key=(-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes)
  mkdir -p "$folder"
  (
    cd "$folder"
    openssl req -x509 "${key[@]}" -keyout ca.key -out ca.pem -subj /CN=authority -days 2
    openssl req "${key[@]}" -keyout server.key -out server.csr -subj /CN=server
    openssl x509 -req -in server.csr -CA ca.pem -CAkey ca.key -CAcreateserial -out server.pem -days 2 \
      -extfile <(echo "subjectAltName=IP:127.0.0.1")
    openssl rand -hex 16 >token
  ) 2>"$work/openssl.log" || fail "openssl failed: $(tail --lines 3 "$work/openssl.log")"
  containers run --rm --interactive "${confined[@]}" --network none ccslice/server-slim --hash-token farm write \
    <"$folder/token" >"$folder/tokens"
  chown -R "$user:$user" "$folder"
  chmod 600 "$folder"/{token,server.key}
}

# start_of_two <name> <number> <podman's option...>: its ports are the usual ones and ten times its number.
start_of_two() {
  local name=$1 shift=$(($2 * 10))
  run_server "$name" "127.0.0.1:$((50053 + shift))" server-slim "${@:3}" --volume "$work/data/meshes:/meshes" \
    --volume "$work/data/identity:/identity:ro" --env "CCSLICE_LISTEN=0.0.0.0:$((50051 + shift))" \
    --env "CCSLICE_HEALTH_LISTEN=0.0.0.0:$((50053 + shift))" --env "CCSLICE_METRICS_LISTEN=0.0.0.0:$((9464 + shift))" \
    --env CCSLICE_MESH_STORE=dir:/meshes --env CCSLICE_TLS_CERT=/identity/server.pem \
    --env CCSLICE_TLS_KEY=/identity/server.key --env CCSLICE_TOKEN_FILE=/identity/tokens
}

# ccslice_of_two <servers> <argument...>: as ccslice, with the token.
ccslice_of_two() {
  containers run --rm "${confined[@]}" --network container:server --env "CCSLICE_SERVER=$1" \
    --env CCSLICE_CA=/data/identity/ca.pem --env CCSLICE_TOKEN_FILE=/data/identity/token \
    --volume "$work/data:/data" ccslice/client "${@:2}"
}

# From the container's network, but not from within it.
page_of() {
  nsenter --target "$pid" --net curl --silent --fail --max-time 5 "http://127.0.0.1:$1"
}

check_two() {
  step "Containers: two servers, one folder of meshes, TLS and tokens"
  local one=https://127.0.0.1:50051 other=https://127.0.0.1:50061 id code=0 i
  local job=(--pitch 0.1 --channel hardness --layers 10..149 --encoding zstd)
  containers rm --all --force --time 0 >/dev/null
  make_identity "$work/data/identity"
  install --directory --owner "$user" --group "$user" "$work/data/meshes"
  start_of_two server 0 --network none
  start_of_two server-2 1 --network container:server
  id=$(ccslice_of_two "$one" upload /data/ring.ccmesh --json | grep -o 'sha256:[0-9a-f]*' | head --lines 1)
  runs "two: the second slices what the first was given" \
    ccslice_of_two "$other" slice "$id" "${job[@]}" --output /data/two-other
  runs "two: both slice one job" ccslice_of_two "$one,$other" slice "$id" "${job[@]}" --split 2 --output /data/two-split
  row "two: layers" "$(find "$work/data/two-split" -name '*.zst' | wc -l) files" "those of one, byte for byte" \
    diff --recursive "$work/data/two-other" "$work/data/two-split"
  containers run --rm "${confined[@]}" --network container:server --volume "$work/data:/data:ro" \
    --env CCSLICE_CA=/data/identity/ca.pem ccslice/client info --server "$one" >"$work/refusal.log" 2>&1 || code=$?
  row "two: without a token" "exit code $code" "4, and the remedy" grep -q -- --token-file "$work/refusal.log"
  for i in 0 1; do
    runs "two: health port of server $i, from another container" containers run --rm "${confined[@]}" \
      --network container:server ccslice/server-slim --health-check "127.0.0.1:$((50053 + i * 10))"
    row "two: server $i is ready" "$(page_of "$((9464 + i * 10))/readyz" | head --bytes 20)" "from outside" \
      page_of "$((9464 + i * 10))/readyz"
    page_of "$((9464 + i * 10))/metrics" >"$work/metrics" || true
    row "two: figures of server $i" "$(grep -c '^ccslice' "$work/metrics") lines" "slicing calls among them" \
      grep -q '^ccslice.*SliceRange' "$work/metrics"
  done
  containers rm --force --time 0 server-2 >/dev/null # It lives in the other one's network.
}

# --- The farm ---------------------------------------------------------------------------------------------------------

# of_debian <user:group> <folder or ""> <package...>: a Dockerfile.
of_debian() {
  printf 'FROM %s\nRUN apt-get update && apt-get install --yes --no-install-recommends %s' "$base" "${*:3}"
  [[ -z $2 ]] || printf ' && install --directory --owner %s --group %s %s' "${1%:*}" "${1#*:}" "$2"
  printf '\n'
}

# What compose.yaml takes from elsewhere: users and folders as there.
make_others() {
  local name user_of_it folder packages image
  mkdir -p "$work/others"
  while read -r name user_of_it folder packages; do
    image=$(sed --quiet 's/^ *image: //p' deploy/compose.yaml | grep --max-count 1 --extended-regexp "(^|/)$name:")
    [[ $image == */* ]] || image=library/$image # As the hub has it.
    # shellcheck disable=SC2086 # Packages are words.
    of_debian "$user_of_it" "${folder#-}" $packages >"$work/others/Dockerfile"
    quietly buildah build --quiet --isolation chroot --pull-never --layers --format docker --tag "docker.io/$image" \
      "$work/others" </dev/null
  done <<'OTHERS'
redis 999:1000 /data redis-server
haproxy 0:0 - haproxy netcat-openbsd
prometheus 65534:65534 /prometheus prometheus wget
OTHERS
}

compose() {
  # Limits of processes that this machine allows; where one limit is set, podman sets all.
  printf 'services:\n' >"$work/override.yaml"
  printf '  %s: {ulimits: {nproc: 4096}}\n' ccsliced-1 ccsliced-2 haproxy >>"$work/override.yaml"
  CCSLICE_QUEUE_PASSWORD=aSecretWord1 DOCKER_HOST=unix://$work/podman.sock docker-compose --project-name check-image --file deploy/compose.yaml \
    --file "$work/override.yaml" --profile farm "$@" 9>&-
}

of_worker() {
  compose exec -T worker-1 "$@"
}

status_of_job() {
  of_worker python3 -m farm status ring
}

# Podman asks for health by timers of systemd's. Here somebody else does.
ask_for_health() {
  local name
  while sleep 2; do
    for name in $(containers ps --quiet); do
      timeout 30 podman --tmpdir "$work/podman" healthcheck run "$name" >/dev/null 2>&1 9>&- || true
    done
  done
}

check_farm() {
  step "Compose: the profile farm"
  local tries job=(--pitch 0.2 --channel hardness)
  containers rm --all --force --time 0 >/dev/null
  make_others
  # Not through containers(): $! would be a shell's, whose end leaves podman running.
  podman --tmpdir "$work/podman" system service --time 0 "unix://$work/podman.sock" >"$work/api.log" 2>&1 9>&- &
  background+=($!)
  until [[ -S $work/podman.sock ]]; do sleep 0.1; done
  ask_for_health &
  background+=($!)
  runs "farm: docker-compose starts it" compose up --detach --no-build
  for ((tries = 0; tries < 60; ++tries)); do
    [[ $(containers ps --format '{{.Status}}' | grep -c '(healthy)') != 8 ]] || break
    sleep 2
  done
  row "farm: healthy containers" "$(containers ps --format '{{.Status}}' | grep -c '(healthy)')" "8" test "$tries" -lt 60
  of_worker sh -c 'cat >/tmp/ring.ccmesh' <"$work/data/ring.ccmesh"
  runs "farm: a job goes in" of_worker python3 -m farm submit ring /tmp/ring.ccmesh -- "${job[@]}"
  for ((tries = 0; tries < 60; ++tries)); do
    if status_of_job | grep -q ': done,'; then break; fi
    sleep 1
  done
  row "farm: its status" "$(status_of_job)" "done" test "$tries" -lt 60
  mkdir -p "$work/data/farm"
  of_worker tar -C /jobs/ring -cf - layers | tar -C "$work/data/farm" -xf -
  containers run --rm "${confined[@]}" --network check-image_default --env CCSLICE_SERVER=haproxy:50052 \
    --volume "$work/data:/data" ccslice/client slice /data/ring.ccmesh "${job[@]}" --output /data/farm-single --quiet \
    >/dev/null
  row "farm: its layers" "$(find "$work/data/farm/layers" -name 'layer_*' | wc -l) files" "those of a single run" \
    diff --recursive "$work/data/farm/layers" "$work/data/farm-single"
  runs "farm: docker-compose ends it" compose stop --timeout 40
  row "farm: servers end with" "$(containers ps --all --filter name=ccsliced --format '{{.Status}}' | cut -c 1-10 |
    sort --unique | tr '\n' ' ')" "Exited (0)" refuses grep -qv 'Exited (0)' <(
    containers ps --all --filter name=ccsliced --format '{{.Status}}'
  )
  compose down --volumes >/dev/null 2>&1
  end_background
}

check_containers() {
  step "Container: client"
  chown "$user:$user" "$work/data"
  runs "client: writes a sample" containers run --rm "${confined[@]}" --network none --volume "$work/data:/data" \
    ccslice/client models ring --output /data/ring.ccmesh
  # It needs a broker to work, but none to know its tasks.
  row "farm: the worker's task" "farm.work" "the same" grep -q "^farm.work$" <(
    containers run --rm "${confined[@]}" --network none --entrypoint python3 ccslice/farm \
      -c 'import farm; print(*(name for name in farm.app.tasks if name.startswith("farm.")))'
  )
  check_server server
  check_server server-slim
  row "both servers: the same layers" "$(find "$work/data/server" -name '*.zst' | wc -l) files" "byte for byte" \
    diff --recursive --exclude manifest.json "$work/data/server" "$work/data/server-slim"
  check_two
  check_farm
}

summary() {
  printf '\n'
  printf '%s\n' "CHECK|FOUND|WANTED|" "${rows[@]}" | column --table --separator '|'
  printf '\n%d checks, %d failed\n' "${#rows[@]}" "$failures"
}

case ${1:-} in
  "") ;;
  --keep) keep=yes ;;
  --clean) ;;
  *) fail "takes nothing, --keep or --clean, not '$1'" ;;
esac
[[ $(id -u) == 0 ]] || fail "needs root, for debootstrap and for containers"
exec 9<deploy/check-image.sh
flock --nonblock 9 || fail "another run is at work in $work"
if [[ ${1:-} == --clean ]]; then
  clean
  exit
fi

deploy/install.sh containers
trap clean EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
release
open_storage
make_base
build_images
check_sizes
check_configuration
check_package_layers
check_containers
summary
((failures == 0))
