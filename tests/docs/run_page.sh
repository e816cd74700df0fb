#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs the commands of pages, or of sections of them, as they are written, one after the other, in an empty folder.
# Stops at the first one that fails. Nobody starts a server for them; lines that start one in the foreground are left
# out.
#
#   tests/docs/run_page.sh docs/from-cad.md
#   tests/docs/run_page.sh "README.md#A first slice" docs/slicing.md
#
# CCSLICE_BUILD names another build than build/release.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

: "${1:?which page?}"
root=$PWD
build=$(realpath "${CCSLICE_BUILD:-build/release}")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/build"
ln -s "$build" "$folder/build/release"
ln -s "$root/deploy" "$root/docs" "$folder"

# Commands stand behind four blanks, in sections that ## begins.
for page in "$@"; do
  section=
  [[ $page != *#* ]] || section=${page#*#}
  awk -v section="$section" '
    /^## / { inside = ($0 == "## " section) }
    (section == "" || inside) && /^    / && !/ccsliced --listen/ { print substr($0, 5) }
  ' "$root/${page%%#*}" >"$folder/some.sh"
  [[ -s $folder/some.sh ]] || { echo "run_page.sh: $page has no commands" >&2 && exit 1; }
  cat "$folder/some.sh" >>"$folder/commands.sh"
done
cd "$folder"
env -u CCSLICE_SERVER PATH="$build/client:$PATH" bash -euxo pipefail commands.sh
echo "run_page.sh: every command ran of $*"
