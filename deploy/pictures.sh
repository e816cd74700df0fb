#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Writes the README's pictures of the samples, cut open, to docs/pictures (or to the folder that is given). Needs
# build/release: cmake --preset release && cmake --build --preset release --target ccsliced ccslice

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
# shellcheck source=deploy/local_server.sh
source deploy/local_server.sh

readonly out=${1:-docs/pictures}
scratch=$(mktemp -d)
readonly scratch

clean_up() {
  stop_server
  rm -rf "$scratch"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# picture MODEL CHANNEL OPTIONS...
picture() {
  local model=$1 channel=$2
  shift 2
  build/release/client/ccslice models "$model" --output "$scratch/$model.ccmesh" --quiet
  build/release/client/ccslice picture "$scratch/$model.ccmesh" --channel "$channel" --width 560 "$@" \
    --output "$out/$model.png" --force --quiet
}

mkdir -p "$out"
start_server "$scratch/server.log"

picture bracket stiffness --voxels 480 --view=-75,50 --cut z=0.4 --cut x=0.5
picture coyote stiffness --voxels 280 --rotate y=-90 --rotate z=-90 --view=-60,20 --cut y=0.5
picture engine hardness --voxels 240 --view=-60,35 --cut y=0.5
picture grid stiffness --voxels 240 --view=-60,25 --cut z=0.87 --cut x=0.5
picture ring hardness --voxels 280 --view=-60,35 --cut x=0.5 --cut y=0.5
