#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes the Debian packages of a build and uses them as a new user would, on a bare Debian 12: lintian finds no error,
# apt installs them, README's first slice and the tutorial run as they are written, a mesh, made 30 mm tall, becomes a
# folder of three materials for GrabCAD, and a program is built with the client library. Needs root. Prints what each
# step took; exit code 1 if one fails or the folder takes a minute. check_service.sh tries the services.
#
#   tests/install/check_deb.sh build/release [MESH]    # MESH, DEFAULT: the sample box

set -euo pipefail
build=$(realpath "${1:?which build?}")
mesh=${2:+$(realpath "$2")}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=deploy/bare_debian.sh
source deploy/bare_debian.sh
# shellcheck source=tests/install/in_debian.sh
source tests/install/in_debian.sh
deploy/install.sh package

readonly most_seconds=60
readonly materials=(Agilus30Clr VeroClear VeroCY-V)

make_packages() {
  deploy/debian/make_packages.sh "$build" "$work/packages"
  cp "$work"/packages/*.deb "$root/mnt"
}

grabcad_folder() {
  in_chroot ccslice slice "/mnt/$1" --size z=30 --grade depth=distance:1..0:6 --format grabcad --printer j750-hm \
    "${materials[@]/#/--material=}" \
    --map "blend:depth:0=${materials[0]},0.5=${materials[1]},1=${materials[2]}" -o /mnt/grabcad --quiet
}

# A picture for each layer, from 0, and voxels of each material.
check_folder() {
  local folder=$root/mnt/grabcad layers counts i
  layers=$(sed -n 's/.*"grid":{[^}]*"layers":\([0-9]\+\).*/\1/p' "$folder/manifest.json")
  ((layers > 0))
  for ((i = 0; i < layers; ++i)); do
    [[ -s $folder/slice_$i.png ]] || fail "there is no slice_$i.png of $layers"
  done
  counts=$(grep -Eo '"rgba":"#[0-9a-f]{8}","voxel_count":[0-9]+' "$folder/manifest.json")
  [[ $(grep -c ':[1-9][0-9]*$' <<<"$counts") == "${#materials[@]}" ]] || fail "not every material is there: $counts"
}

step "A bare Debian 12" bare_debian "$root"
mount -t proc proc "$root/proc"
step "The packages" make_packages
step "lintian" lintian --fail-on error --allow-root "$work"/packages/*.deb
sed 's/^/  /' "$work/step.log"
step "apt-get update" in_chroot apt-get update
step "apt-get install ccslice ccsliced" in_chroot sh -c \
  "apt-get install --yes --no-install-recommends /mnt/ccslice_*.deb /mnt/ccsliced_*.deb"
mkdir "$root/src"
cp -r README.md docs deploy "$root/src"
mkdir "$root/src/tests"
cp -r tests/docs "$root/src/tests"
if [[ -z $mesh ]]; then
  in_chroot ccslice models box -o /mnt/box.ccmesh >/dev/null
  mesh=box.ccmesh
else
  cp "$mesh" "$root/mnt"
fi
begin=$SECONDS
step "$(basename "$mesh") to a folder for GrabCAD" grabcad_folder "$(basename "$mesh")"
took=$((SECONDS - begin))
step "Its layers and materials" check_folder
printf '%-50s %4d\n' "  layers" "$(find "$root/mnt/grabcad" -name 'slice_*.png' | wc -l)"
for page in "README.md#A first slice" docs/tutorial.md; do
  step "Commands of $page" in_chroot env CCSLICE_BUILD=/none /src/tests/docs/run_page.sh "$page"
done
cp -r tests/install/consumer "$root/src/consumer"
step "apt-get install libccslice-dev" in_chroot sh -c \
  "apt-get install --yes --no-install-recommends /mnt/libccslice-dev_*.deb cmake g++ make"
step "A program with the client library" in_chroot sh -c \
  "cmake -S /src/consumer -B /tmp/consumer && cmake --build /tmp/consumer"
step "apt-get remove" in_chroot apt-get remove --yes ccslice ccsliced libccslice-dev
[[ ! -e $root/usr/bin/ccslice && ! -e $root/usr/bin/ccsliced ]] || fail "the programs are still there"
((took < most_seconds)) || fail "the folder took $took s, allowed are fewer than $most_seconds"
