#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# The version of sources with tags, without any, and without history (cmake/version.sh); what a build makes of it; and
# that the files that name a release agree.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
repository=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# Neither this repository's hooks and settings, nor those of whoever runs this.
export GIT_CONFIG_GLOBAL=/dev/null GIT_CONFIG_SYSTEM=/dev/null
unset GIT_DIR GIT_WORK_TREE
failures=0

# expect <version> <what>: of $sources, as a pattern.
expect() {
  local got
  got=$("$sources/cmake/version.sh" 2>&1) || true
  [[ $got =~ ^$1$ ]] || { echo "version_test.sh: $2: '$got', expected $1" >&2 && failures=1; }
}

commit() {
  git -C "$sources" -c user.name=me -c user.email=me@example.org commit --quiet --allow-empty --message "$1"
}

sources=$work/sources
mkdir -p "$sources/cmake"
cp cmake/version.sh cmake/version.cmake cmake/version.cpp.in "$sources/cmake"
echo 3.1.0 >"$sources/VERSION"

expect '3\.1\.0' "an archive"
git init --quiet "$work"
git -C "$work" -c user.name=me -c user.email=me@example.org commit --quiet --allow-empty --message "another's"
git -C "$work" tag v9.9.9
expect '3\.1\.0' "an archive in a repository of another one's"

git init --quiet "$sources"
commit first
commit second
expect '3\.1\.0\+2\.g[0-9a-f]{7,}' "commits without a tag"
git -C "$sources" tag v3.2.0
expect '3\.2\.0' "a tag"
git -C "$sources" -c user.name=me -c user.email=me@example.org tag --annotate --message more v3.3.0
expect '3\.3\.0' "a tag with a message"
commit third
git -C "$sources" tag nightly
git -C "$sources" tag v3.4.0-rc1
expect '3\.3\.0\+1\.g[0-9a-f]{7,}' "a commit after it, with tags of no release"

# A build looks it up, and writes the file only if it says something else.
made() {
  cmake -D "VERSION=$1" -D "OUTPUT=$work/version.cpp" -P "$sources/cmake/version.cmake"
}
made ""
grep -q "kVersion = \"$("$sources/cmake/version.sh")\";" "$work/version.cpp" || { echo "not in the file" >&2 && failures=1; }
touch --date=2001-01-01 "$work/version.cpp"
made ""
[[ $(date --reference="$work/version.cpp" +%Y) == 2001 ]] || { echo "written again" >&2 && failures=1; }
made 7.7.7
grep -q 'kVersion = "7.7.7";' "$work/version.cpp" || { echo "CCSLICE_VERSION isn't taken" >&2 && failures=1; }

rm -rf "$sources/.git"
echo "soon" >"$sources/VERSION"
expect "version.sh: 'soon' isn't a version such as 1.2.0.*" "no version"
! made "" 2>/dev/null || { echo "a build takes no version" >&2 && failures=1; }

# Who makes a release writes it in both files, and then the tag.
cd "$repository"
release=$(cat VERSION)
grep -q "^version: $release$" CITATION.cff || { echo "CITATION.cff has another version than VERSION" >&2 && failures=1; }
version=$(cmake/version.sh)
[[ $version == *+* || $version == "$release" ]] || { echo "the tag says $version, VERSION $release" >&2 && failures=1; }
((failures == 0)) && echo "version_test.sh: tags, commits, archives and files agree"
exit "$failures"
