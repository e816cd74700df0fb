#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Makes Debian packages of a build: ccsliced (the server, a service), ccslice (the command line), libccslice-dev (the
# client library) and ccslice-farm (a queue of jobs). Takes the programs as they are, with their own version. Debian's
# variables DEBFULLNAME and DEBEMAIL name the maintainer.
#
#   deploy/install.sh package
#   deploy/debian/make_packages.sh [--version V] [BUILD [FOLDER]]    # DEFAULT: build/release, and BUILD/packages

set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
version=""
if [[ ${1:-} == --version ]]; then
  version=${2:?which version?}
  shift 2
fi
build=$(realpath "${1:-$root/build/release}")
folder=${2:-$build/packages}

fail() {
  echo "make_packages.sh: $1" >&2
  exit 1
}

for program in client/ccslice server/ccsliced client/reference/man1/ccslice.1 server/ccsliced.1; do
  [[ -e $build/$program ]] || fail "$build has no $program: cmake --build $build"
done
command -v dh >/dev/null || fail "debhelper is missing: deploy/install.sh package"
built=$("$build/client/ccslice" --version)
read -r _ served _ < <("$build/server/ccsliced" --version)
[[ $built == "$served" ]] || fail "ccslice is $built and ccsliced is $served: cmake --build $build"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
source=$work/ccslice
mkdir -p "$source" "$folder"
cp -r "$root/deploy/debian" "$source/debian"
rm "$source/debian/make_packages.sh"
email=${DEBEMAIL:-ccslice@example.org}
maintainer="${DEBFULLNAME:-The ccslice authors} <$email>"
sed -i "s|^Maintainer: .*|Maintainer: $maintainer|" "$source/debian/control"
when=$(git -C "$root" log -1 --format=%cD 2>/dev/null || date --rfc-email)
cat >"$source/debian/changelog" <<CHANGELOG
ccslice (${version:-$built}-1) bookworm; urgency=medium

  * Made of the sources; changelog.gz says what is new.

 -- $maintainer  $(date --utc --rfc-email --date "$when")
CHANGELOG
if ! (cd "$source" && ROOT=$root BUILD=$build dpkg-buildpackage --build=binary --no-sign --no-check-builddeps \
  --jobs=auto) >"$work/log" 2>&1; then
  tail -60 "$work/log" >&2
  fail "dpkg-buildpackage failed"
fi
rm -f "$folder"/*.deb
mv "$work"/*.deb "$folder"
ls "$folder"/*.deb
