#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Writes the pictures of the samples, cut open, to docs/pictures (or to the folder that is given): in a scale
# of colours, and halftoned into three materials, as [Luu19, Fig. 8] has them. Needs
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

# The ends and the middle of the scale.
readonly materials=(--material soft=#440154 --material middle=#22928c --material hard=#fde725)

# picture MODEL CHANNEL VOXELS COARSE_VOXELS OPTIONS...
picture() {
  local model=$1 channel=$2 voxels=$3 coarse_voxels=$4
  shift 4
  build/release/client/ccslice models "$model" --output "$scratch/$model.ccmesh" --quiet
  build/release/client/ccslice picture "$scratch/$model.ccmesh" --channel "$channel" --width 560 "$@" \
    --voxels "$voxels" --output "$out/$model.png" --force --quiet
  build/release/client/ccslice picture "$scratch/$model.ccmesh" --width 480 "$@" \
    "${materials[@]}" --map "blend:$channel:0=soft,0.5=middle,1=hard" \
    --voxels "$coarse_voxels" --output "$out/$model-halftoned.png" --force --quiet
}

mkdir -p "$out"
start_server "$scratch/server.log"

picture bracket stiffness 480 240 --view=-75,50 --cut z=0.4 --cut x=0.5
picture coyote stiffness 280 160 --rotate y=-90 --rotate z=-90 --view=-60,20 --cut y=0.5
picture engine hardness 240 120 --view=-60,35 --cut y=0.5
picture grid stiffness 240 160 --view=-60,25 --cut z=0.87 --cut x=0.5
picture ring hardness 280 140 --view=-60,35 --cut x=0.5 --cut y=0.5
