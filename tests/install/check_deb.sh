#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes the Debian package of a build and uses it as a new user would, on a bare Debian 12: apt installs it, README's
# first slice and the tutorial run as they are written, and a mesh becomes a folder for GrabCAD. Needs root. Prints what
# each step took; exit code 1 if one fails or the last takes a minute.
#
#   tests/install/check_deb.sh build/release [MESH]    # MESH, DEFAULT: a sample

set -euo pipefail
build=$(realpath "${1:?which build?}")
mesh=${2:+$(realpath "$2")}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=deploy/bare_debian.sh
source deploy/bare_debian.sh
deploy/install.sh package containers

readonly most_seconds=60
work=$(mktemp -d)
root=$work/debian

clean() {
  umount "$root/proc" 2>/dev/null || true
  rm -rf --one-file-system "$work"
}
trap clean EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# step <name> <command...>: prints the seconds.
step() {
  local name=$1 begin=$SECONDS
  shift
  "$@" >"$work/step.log" 2>&1 || {
    tail -60 "$work/step.log" >&2
    echo "check_deb.sh: failed: $name" >&2
    exit 1
  }
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
  local options=(--size z=30 --grade depth=distance:1..0:6 --for grabcad --profile j750-hm)
  inside ccslice slice "/mnt/$1" "${options[@]}" --material Agilus30Clr --material VeroClear --material VeroCY-V \
    --map blend:depth:0=Agilus30Clr,0.5=VeroClear,1=VeroCY-V -o /mnt/grabcad --quiet
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
  inside ccslice models bracket -o /mnt/bracket.ccmesh >/dev/null
  mesh=bracket.ccmesh
else
  cp "$mesh" "$root/mnt"
fi
begin=$SECONDS
step "$(basename "$mesh") to a folder for GrabCAD" grabcad_folder "$(basename "$mesh")"
took=$((SECONDS - begin))
printf '%-50s %4d\n' "  its layers" "$(find "$root/mnt/grabcad" -name 'slice_*.png' | wc -l)"
for page in "README.md#A first slice" docs/tutorial.md; do
  step "Commands of $page" inside env CCSLICE_BUILD=/none /src/tests/docs/run_page.sh "$page"
done
step "apt-get remove" inside apt-get remove --yes ccslice
[[ ! -e $root/usr/bin/ccslice ]] || { echo "check_deb.sh: the program is still there" >&2 && exit 1; }
if ((took >= most_seconds)); then
  echo "check_deb.sh: the folder took $took s, allowed are $most_seconds" >&2
  exit 1
fi
