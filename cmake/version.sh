#!/bin/sh
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Prints the version of these sources, for programs, packages and images alike:
#
#   1.2.0                at the git tag v1.2.0, and in an archive without git, whose file VERSION says it
#   1.2.0+12.g1a2b3c4    12 commits after it
#
# A repository without such a tag counts its commits from the first one on, after the version of the file. Semantic
# versions, Debian's and Python's all allow this form.

set -eu
root=$(cd "$(dirname "$0")/.." && pwd -P)

# An archive that lies in a repository of somebody else's has no history of its own.
history() {
  [ "$(git -C "$root" rev-parse --show-toplevel 2>/dev/null)" = "$root" ]
}

version=$(cat "$root/VERSION")
if history; then
  if described=$(git -C "$root" describe --tags --long --match 'v[0-9]*.[0-9]*.[0-9]*' --exclude '*-*' 2>/dev/null); then
    commit=${described##*-g} described=${described%-g*}
    version=${described%-*} commits=${described##*-}
    version=${version#v}
  else
    commits=$(git -C "$root" rev-list --count HEAD)
    commit=$(git -C "$root" rev-parse --short HEAD)
  fi
  [ "$commits" = 0 ] || version=$version+$commits.g$commit
fi
# Anything else would be no version of one of these three.
printf '%s\n' "$version" | grep -Ex '[0-9]+\.[0-9]+\.[0-9]+(\+[0-9]+\.g[0-9a-f]+)?' || {
  echo "version.sh: '$version' isn't a version such as 1.2.0: name the tag v1.2.0, or correct the file VERSION" >&2
  exit 1
}
