#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# The whole way once, on a fresh machine too: installs what building takes, builds, starts a server on a free port, has
# eight layers of the graded ring of [Luu19, Table 2] sliced at the paper's pitch, and shows them. Output: out/demo.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=deploy/local_server.sh
source deploy/local_server.sh

readonly out=out/demo
readonly layers=284..291
readonly job=("$out/ring.ccmesh" --pitch "0.0423,0.0846,0.03" --channel hardness)

step() {
  printf '\n== %s\n' "$*"
}

fail() {
  echo "demo.sh: $*" >&2
  exit 1
}

# Runs a command whose output only matters when it fails, but for how far ninja is: "[12/345] ...". A terminal shows that
# in one line, and a log gets a line for every tenth.
quietly() {
  local log=$out/build.log shown=-1 line
  "$@" 2>&1 | tee "$log" | while IFS= read -r line; do
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    if [[ -t 1 ]]; then
      printf '\r%d of %d steps\e[K' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}"
    elif ((10 * BASH_REMATCH[1] / BASH_REMATCH[2] > shown)); then
      shown=$((10 * BASH_REMATCH[1] / BASH_REMATCH[2]))
      echo "${BASH_REMATCH[1]} of ${BASH_REMATCH[2]} steps"
    fi
  done || {
    cat "$log" >&2
    fail "failed: $*"
  }
  if [[ -t 1 ]]; then printf '\r\e[K'; fi
}

trap stop_server EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

ccslice() {
  echo "\$ ccslice $*"
  build/release/client/ccslice "$@"
}

rm -rf "$out"
mkdir -p "$out"

step "Packages"
deploy/install.sh build

step "Build (some minutes the first time)"
# A new build compiles the files of a folder as one, which is faster. So does tests/run.sh, which then goes on with it.
unity=()
[[ -f build/release/CMakeCache.txt ]] || unity=(-DCMAKE_UNITY_BUILD=ON)
quietly cmake --preset release -DCCSLICE_BUILD_TESTS=OFF "${unity[@]}"
quietly cmake --build build/release --parallel "$(nproc)" --target ccsliced ccslice
echo "build/release/server/ccsliced, build/release/client/ccslice"

step "Server"
start_server "$out/server.log"
echo "ccsliced serves on $CCSLICE_SERVER, its log is $out/server.log"

step "The ring: a control mesh graded from its inner to its outer radius"
ccslice models ring --output "$out/ring.ccmesh"
ccslice upload "$out/ring.ccmesh"

step "What slicing it takes"
ccslice plan "${job[@]}"

step "Layers $layers"
ccslice slice "${job[@]}" --occupancy --layers "$layers" --output "$out/layers"

step "A cut through it"
ccslice picture "$out/ring.ccmesh" --channel hardness --terminal --pixels 100

step "Done"
picture=$(find "$out/layers" -name 'layer_*.png' | sort | head -n 1)
[[ -n $picture ]] || fail "no picture was written"
echo "pictures: $(find "$out/layers" -name 'layer_*.png' | wc -l) in $out/layers, the first one is $picture"
echo "all of them on one sheet: $out/layers/contact_sheet.png"
