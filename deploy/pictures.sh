#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Writes the pictures of the samples, cut open, to docs/pictures (or to the folder that is given): in a scale
# of colours, and halftoned into three materials, as [Luu19, Fig. 8] has them; and what a mesh may mean. Needs ImageMagick
# (deploy/install.sh test) and build/release: cmake --preset release && cmake --build --preset release --target ccsliced ccslice

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
  build/release/client/ccslice picture "$scratch/$model.ccmesh" --channel "$channel" --pixels 560 "$@" \
    --voxels "$voxels" --output "$out/$model.png" --force --quiet
  build/release/client/ccslice picture "$scratch/$model.ccmesh" --pixels 480 "$@" \
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

# What a mesh means: the same sixteen cells round a bore, as a control mesh, as a part, and as meshed, side by side.
python3 - >"$scratch/bore.vtk" <<'EOF'
import math
angles = [math.pi / 8 * i for i in range(16)]
inner = [(12 * math.cos(a), 12 * math.sin(a)) for a in angles]
outer = [(20 * x / max(abs(x), abs(y)), 20 * y / max(abs(x), abs(y))) for x, y in inner]
print("# vtk DataFile Version 3.0\na bore of sixteen cells\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 64 double")
for z in (0, 10):
    for x, y in inner + outer:
        print(x, y, z)
print("CELLS 16 144")
for i in range(16):
    ring = [i, 16 + i, 16 + (i + 1) % 16, (i + 1) % 16]
    print(8, *ring, *(32 + v for v in ring))
print("CELL_TYPES 16\n" + "12\n" * 16, end="")
EOF
meanings=()
for meaning in "" --part --as-meshed; do
  meanings+=("$scratch/meaning${meaning}.png")
  # shellcheck disable=SC2086
  build/release/client/ccslice picture "$scratch/bore.vtk" $meaning --grade radius=radial:z --channel radius \
    --pixels 360 --view=-60,50 --voxels 200 --output "${meanings[-1]}" --force --quiet
done
convert "${meanings[@]}" +append "$out/meanings.png"
