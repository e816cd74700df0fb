#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes the Debian package of a build and uses it as a new user would, on a bare Debian 12: apt installs it, README's
# first slice and the tutorial run as they are written, and a mesh, made 30 mm tall, becomes a folder of three materials
# for GrabCAD. Needs root. Prints what each step took; exit code 1 if one fails or the folder takes a minute.
#
#   tests/install/check_deb.sh build/release [MESH]    # MESH, DEFAULT: the sample box

set -euo pipefail
build=$(realpath "${1:?which build?}")
mesh=${2:+$(realpath "$2")}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=deploy/bare_debian.sh
source deploy/bare_debian.sh
[[ $(id -u) == 0 ]] || { echo "check_deb.sh: needs root" >&2 && exit 1; }
deploy/install.sh package containers

readonly most_seconds=60
readonly materials=(Agilus30Clr VeroClear VeroCY-V)
work=$(mktemp -d)
root=$work/debian

fail() {
  echo "check_deb.sh: $1" >&2
  exit 1
}

# Ends mounts too, debootstrap's own among them if it was interrupted.
clean() {
  local mount
  while read -r mount; do
    umount "$mount" || umount --lazy "$mount" || true
  done < <(awk -v work="$work/" 'index($2, work) == 1 { print $2 }' /proc/mounts | sort --reverse)
  rm -rf --one-file-system "$work"
}
trap clean EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# step <name> <command...>: prints the seconds. In a condition, bash would go on after commands of a function that fail.
step() {
  local name=$1 begin=$SECONDS code
  shift
  (($# > 0)) || fail "nothing to do: $name"
  set +e
  (set -e && "$@") >"$work/step.log" 2>&1
  code=$?
  set -e
  ((code == 0)) || { tail -60 "$work/step.log" >&2 && fail "failed: $name"; }
  printf '%-50s %4d s\n' "$name" $((SECONDS - begin))
}

inside() {
  chroot "$root" env -i HOME=/tmp PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"
}

make_package() {
  (cd "$work" && cpack -G DEB --config "$build/CPackConfig.cmake" -B "$work/package")
  cp "$work"/package/*.deb "$root/mnt/ccslice.deb"
}

grabcad_folder() {
  inside ccslice slice "/mnt/$1" --size z=30 --grade depth=distance:1..0:6 --format grabcad --printer j750-hm \
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
step "The package" make_package
step "apt-get update" inside apt-get update
step "apt-get install ./ccslice.deb" inside apt-get install --yes --no-install-recommends /mnt/ccslice.deb
mkdir "$root/src"
cp -r README.md docs deploy "$root/src"
mkdir "$root/src/tests"
cp -r tests/docs "$root/src/tests"
if [[ -z $mesh ]]; then
  inside ccslice models box -o /mnt/box.ccmesh >/dev/null
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
  step "Commands of $page" inside env CCSLICE_BUILD=/none /src/tests/docs/run_page.sh "$page"
done
step "apt-get remove" inside apt-get remove --yes ccslice
[[ ! -e $root/usr/bin/ccslice ]] || fail "the program is still there"
((took < most_seconds)) || fail "the folder took $took s, allowed are fewer than $most_seconds"
