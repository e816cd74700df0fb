#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Measures on this machine what deploy/README.md is about: how fast a processor slices, what layers, jobs and streams take,
# what a mesh store costs; and reckons from that what a replica does and what a farm needs. Takes some minutes, on a
# machine that does nothing else. Installs and builds what is missing, as deploy/demo.sh does.
#
#   deploy/sizing.sh [--printers N] [--parts-per-tray P] [--seconds-per-layer S] [--samples ring,coyote,engine,...]
#
# The farm is taken to have N printers (1000 unless given), whose trays hold P (10) of the dearest sample here, and which
# take a layer every S seconds (20).

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=deploy/local_server.sh
source deploy/local_server.sh

readonly profile=j750-hm # 600 x 300 dpi, 27 um.
readonly layers=128      # From the middle of a part.
readonly stalled=8       # Streams that nobody reads.
readonly fixed_mb=256    # Of a process, beside its budgets (docs/operating.md).
printers=1000
parts_per_tray=10
seconds_per_layer=20
samples=ring,coyote,engine,bracket,grid

fail() {
  echo "sizing.sh: $*" >&2
  exit 2
}

while (($# > 0)); do
  (($# > 1)) || fail "$1 needs a value"
  case $1 in
    --printers) printers=$2 ;;
    --seconds-per-layer) seconds_per_layer=$2 ;;
    --parts-per-tray) parts_per_tray=$2 ;;
    --samples) samples=$2 ;;
    *) fail "knows --printers, --parts-per-tray, --seconds-per-layer and --samples, not $1" ;;
  esac
  shift 2
done
[[ $printers =~ ^[1-9][0-9]*$ ]] || fail "--printers $printers: a number from 1 on"
[[ $parts_per_tray =~ ^[1-9][0-9]*$ ]] || fail "--parts-per-tray $parts_per_tray: a number from 1 on"
[[ $seconds_per_layer =~ ^[0-9]+(\.[0-9]+)?$ && $seconds_per_layer =~ [1-9] ]] ||
  fail "--seconds-per-layer $seconds_per_layer: a number above 0"

deploy/install.sh build
cmake --preset release -DCCSLICE_BUILD_TESTS=OFF >/dev/null
cmake --build build/release --parallel "$(nproc)" --target ccsliced ccslice >/dev/null

work=$(mktemp --directory)
clean() {
  stop_server
  rm -rf "$work"
}
trap clean EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

ccslice() {
  build/release/client/ccslice "$@"
}

# calc EXPRESSION [FORMAT]
calc() {
  awk "BEGIN { printf \"${2:-%.2f}\", ($1) }"
}

# field NAME <JSON: the first number of that name.
field() {
  grep --only-matching "\"$1\":[0-9.e+-]*" | head --lines 1 | cut --delimiter : --fields 2
}

# serve [OPTION...]: a server of ours, with figures at $figures.
serve() {
  stop_server
  start_server "$work/server.log" --metrics-listen 127.0.0.1:0 "$@"
  until figures=$(sed -n 's/.*serves figures on //p' "$work/server.log") && [[ -n $figures ]]; do sleep 0.05; done
}

# figure NAME: as the server says it now.
figure() {
  local host=${figures%:*} port=${figures##*:}
  exec 3<>"/dev/tcp/$host/$port"
  printf 'GET /metrics HTTP/1.0\r\n\r\n' >&3
  awk -v name="$1" '$1 == name { printf "%.0f", $2 }' <&3
  exec 3>&-
}

resident() {
  awk '/^VmRSS:/ { print $2 * 1024 }' "/proc/$server_pid/status"
}

most_resident() {
  awk '/^VmHWM:/ { print $2 * 1024 }' "/proc/$server_pid/status"
}

# slice_middle PART ENCODING CONTENT...: the middle layers of a part. Sets seconds, voxels and bytes.
slice_middle() {
  local mesh=$work/$1.ccmesh encoding=$2 count first
  count=$(ccslice plan "$mesh" --printer "$profile" --json | field layer_count)
  first=$(((count - layers) / 2))
  rm -rf "$work/layers"
  ccslice slice "$mesh" --printer "$profile" --encoding "$encoding" "${@:3}" --layers "$first..$((first + layers - 1))" \
    --no-contact-sheet --output "$work/layers" --json >"$work/slice.json"
  seconds=$(field seconds <"$work/slice.json")
  voxels=$(field voxel_count <"$work/slice.json")
  bytes=$(field written_bytes <"$work/slice.json")
}

channel_of() {
  ccslice info "$work/$1.ccmesh" --json | grep --only-matching '"channels":\[{"name":"[^"]*"' | cut --delimiter '"' --fields 6
}

# --- Parts ------------------------------------------------------------------------------------------------------------

# Sets dearest, which takes most_seconds for the layers as halftones, its layer_bytes, and most_memory of any part.
measure_parts() {
  local part channel values halftone prepared memory
  most_seconds=0 most_memory=0
  printf '\n## What a processor does (%d layers of 600 x 300 dpi and 27 um, a server of one thread)\n\n' "$layers"
  printf '| part | Mvoxels a layer | values: Mvoxels/s | kB a layer | halftone: Mvoxels/s | kB a layer | mesh, MB | job, MB |\n'
  printf '| --- | --- | --- | --- | --- | --- | --- | --- |\n'
  for part in ${samples//,/ }; do
    ccslice models "$part" --output "$work/$part.ccmesh" --quiet >/dev/null
    channel=$(channel_of "$part")
    serve --threads 1
    ccslice upload "$work/$part.ccmesh" --quiet >/dev/null
    prepared=$(figure ccslice_cache_used_bytes)
    memory=$(resident)
    slice_middle "$part" zstd --channel "$channel"
    values="$(calc "$voxels / $seconds / 1e6") | $(calc "$bytes / $layers / 1e3" %.0f)"
    slice_middle "$part" png --material VeroCY-V --material Agilus30Clr --map "blend:$channel:0=VeroCY-V,1=Agilus30Clr"
    halftone="$(calc "$voxels / $seconds / 1e6") | $(calc "$bytes / $layers / 1e3" %.0f)"
    memory=$(calc "$(most_resident) - $memory" %.0f)
    printf '| %s | %s | %s | %s | %s | %s |\n' "$part" "$(calc "$voxels / $layers / 1e6")" "$values" "$halftone" \
      "$(calc "$prepared / 1e6")" "$(calc "$memory / 1e6" %.0f)"
    # The part that takes a processor longest for a layer.
    if [[ $(calc "$seconds > $most_seconds" %d) == 1 ]]; then
      dearest=$part most_seconds=$seconds layer_bytes=$(calc "$bytes / $layers" %.0f)
    fi
    most_memory=$(calc "$memory > $most_memory ? $memory : $most_memory" %.0f)
  done
}

# Sets efficiency: what each of as many threads as processors does, of what one does alone.
measure_threads() {
  local threads first=0 gain
  printf '\n## What more threads do (%s)\n\n' "$dearest"
  printf '| threads | Mvoxels/s | of one |\n| --- | --- | --- |\n'
  for ((threads = 1; threads <= $(nproc); threads *= 2)); do
    serve --threads "$threads"
    ccslice upload "$work/$dearest.ccmesh" --quiet >/dev/null
    slice_middle "$dearest" zstd --channel "$(channel_of "$dearest")"
    ((first)) || first=$(calc "$voxels / $seconds" %.0f)
    gain=$(calc "$voxels / $seconds / $first")
    printf '| %s | %s | %s |\n' "$threads" "$(calc "$voxels / $seconds / 1e6")" "$gain"
  done
  efficiency=$(calc "$gain / ($threads / 2)") # The loop ends at twice the last number.
}

# A client that has stopped reading keeps nothing but the layer that is being sent. Sets stream_memory.
measure_streams() {
  local i pids=() before
  serve --threads 1
  ccslice upload "$work/$dearest.ccmesh" --quiet >/dev/null
  slice_middle "$dearest" raw --channel "$(channel_of "$dearest")"
  sleep 1 # What the slicing held goes back.
  before=$(resident)
  for ((i = 0; i < stalled; ++i)); do
    build/release/client/ccslice slice "$work/$dearest.ccmesh" --printer "$profile" --channel "$(channel_of "$dearest")" \
      --encoding raw --no-contact-sheet --output "$work/stalled-$i" --quiet >/dev/null 2>&1 &
    pids+=($!)
  done
  for ((i = 0; i < stalled; ++i)); do
    until compgen -G "$work/stalled-$i/layer*" >/dev/null; do sleep 0.05; done
    kill -STOP "${pids[i]}"
  done
  for ((i = 0; i < 150; ++i)); do # The server notices after a second or more.
    if (($(figure ccslice_calls_shed_total) >= stalled)); then break; fi
    sleep 0.1
  done
  sleep 1
  stream_memory=$(calc "($(resident) - $before) / $stalled" %.0f)
  kill -KILL "${pids[@]}"
  wait "${pids[@]}" 2>/dev/null || true
  printf '\n## Streams that nobody reads\n\n%s MB each, of %s, once the server has noticed, beside what jobs at work take.\n' \
    "$(calc "$stream_memory / 1e6")" "$stalled"
}

# seconds_of COMMAND...
seconds_of() {
  local begin end
  begin=$(date +%s.%N)
  "$@" >/dev/null
  end=$(date +%s.%N)
  calc "$end - $begin" %.3f
}

measure_store() {
  local plain stored cached other id store=(--mesh-store "dir:$work/meshes") mesh=$work/$dearest.ccmesh
  mkdir "$work/meshes"
  serve --threads 1
  plain=$(seconds_of ccslice upload "$mesh" --quiet)
  serve --threads 1 "${store[@]}"
  stored=$(seconds_of ccslice upload "$mesh" --quiet)
  cached=$(seconds_of ccslice upload "$mesh" --quiet)
  id=$(ccslice upload "$mesh" --json | grep --only-matching 'sha256:[0-9a-f]*' | head --lines 1)
  serve --threads 1 "${store[@]}" # Knows it from the folder alone.
  other=$(seconds_of ccslice info "$id")
  printf '\n## A store of meshes (%s, a folder)\n\n' "$dearest"
  printf '| | |\n| --- | --- |\n'
  printf '| bytes of its file | %s kB |\n' "$(calc "$(du --bytes --summarize "$work/meshes" | cut --fields 1) / 1e3" %.0f)"
  printf '| upload, without and with it | %s s, %s s |\n' "$plain" "$stored"
  printf '| upload of what is there | %s s |\n' "$cached"
  printf '| the first call at another server | %s s |\n' "$other"
}

# --- Small servers ----------------------------------------------------------------------------------------------------

# Sets least_mb: the smallest server, in steps of 256 MB, that takes halftones of each part.
measure_least() {
  local part channel
  for ((least_mb = 512; ; least_mb += 256)); do
    serve --threads 2 --memory "${least_mb}000000"
    for part in ${samples//,/ }; do
      channel=$(channel_of "$part")
      slice_middle "$part" png --material VeroCY-V --material Agilus30Clr \
        --map "blend:$channel:0=VeroCY-V,1=Agilus30Clr" 2>/dev/null || continue 2
    done
    break
  done
  printf '\n## The smallest server that takes each part: --memory %s MB, of which it held %s MB\n' \
    "$least_mb" "$(calc "$(most_resident) / 1e6" %.0f)"
}

# --- What follows -----------------------------------------------------------------------------------------------------

reckon() {
  local cpus layer_seconds rate memory processors
  layer_seconds=$(calc "$most_seconds / $layers" %.4f)
  printf '\n## What a replica does (reckoned: several threads do %s each of what one does; halftones of %s)\n\n' \
    "$efficiency" "$dearest"
  printf '| processors | layers/s | trays of %s, a layer each %s s | MB: %s, and a job for each processor, at least what takes each part |\n' \
    "$parts_per_tray" "$seconds_per_layer" "$fixed_mb"
  printf '| --- | --- | --- | --- |\n'
  for cpus in 2 4 8; do
    rate=$(calc "$cpus * $efficiency / $layer_seconds")
    memory=$(calc "$fixed_mb + $cpus * $most_memory / 1e6" %.0f)
    ((memory >= least_mb)) || memory=$least_mb
    printf '| %s | %s | %s | %s |\n' "$cpus" "$rate" "$(calc "$rate * $seconds_per_layer / $parts_per_tray" %d)" "$memory"
  done
  rate=$(calc "$printers * $parts_per_tray / $seconds_per_layer")
  processors=$(calc "$rate * $layer_seconds / $efficiency")
  printf '\n## A farm of %s printers, trays of %s, a layer each %s s\n\n' "$printers" "$parts_per_tray" "$seconds_per_layer"
  printf '| | |\n| --- | --- |\n'
  printf '| layers a second | %s |\n' "$rate"
  printf '| processors at work | %s |\n' "$processors"
  printf '| replicas of 8, three quarters busy, and one to spare | %s |\n' "$(calc "int($processors / 6 + 0.9999) + 1" %d)"
  printf '| network, layers alone | %s MB/s |\n' "$(calc "$rate * $layer_bytes / 1e6")"
}

lscpu | sed --quiet 's/^Model name: */processor: /p'
echo "processors: $(nproc)"
build/release/server/ccsliced --version
measure_parts
measure_threads
measure_streams
measure_store
measure_least
reckon
