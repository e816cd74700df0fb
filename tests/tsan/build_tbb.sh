#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Builds oneTBB with ThreadSanitizer from its Debian source package into build/tsan-tbb/install, where the tsan preset
# looks for it. With the packaged library TSan reports races that aren't there, and what suppresses those hides real ones.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

work=$PWD/build/tsan-tbb
if [[ -e $work/install/lib/cmake/TBB/TBBConfig.cmake ]]; then
  echo "build_tbb.sh: complete"
  exit 0
fi
rm -rf "$work"
mkdir -p "$work/lists/partial" "$work/sources"

# The machine's own package sources, as source packages, in a private list: nothing in /etc changes.
cat /etc/apt/sources.list.d/*.sources 2>/dev/null | sed 's/^Types:.*/Types: deb-src/' >"$work/debian.sources" || true
sed -n 's/^deb /deb-src /p' /etc/apt/sources.list 2>/dev/null >"$work/debian.list" || true
mkdir "$work/parts"
if [[ -s $work/debian.list ]]; then cp "$work/debian.list" "$work/parts/"; fi
if [[ -s $work/debian.sources ]]; then cp "$work/debian.sources" "$work/parts/"; fi
apt_options=(
  -qq
  -o Dir::Etc::sourcelist=/dev/null
  -o Dir::Etc::sourceparts="$work/parts"
  -o Dir::State::lists="$work/lists"
  -o APT::Sandbox::User=root
)
apt-get "${apt_options[@]}" update
(cd "$work/sources" && apt-get "${apt_options[@]}" --download-only source onetbb)
mkdir "$work/onetbb"
tar --extract --file "$work"/sources/onetbb_*.orig.tar.* --directory "$work/onetbb" --strip-components 1

cmake -S "$work/onetbb" -B "$work/build" -G Ninja \
  -DCMAKE_BUILD_TYPE=RelWithDebInfo \
  -DCMAKE_INSTALL_PREFIX="$work/install" \
  -DCMAKE_INSTALL_LIBDIR=lib \
  -DTBB_SANITIZE=thread \
  -DTBB_STRICT=OFF \
  -DTBB_TEST=OFF
cmake --build "$work/build" --parallel "$(nproc)" --target install
