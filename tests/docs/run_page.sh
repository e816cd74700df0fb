#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs the commands of a page of docs/ as they are written, one after the other, in a folder of its own, with a server
# beside them. Stops at the first one that fails.
#
#   tests/docs/run_page.sh docs/from-cad.md

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

page="${1:?which page?}"
root=$PWD
folder=$(mktemp -d)
ln -s "$root/build" "$root/deploy" "$root/docs" "$folder"

"$root/build/release/server/ccsliced" --listen 127.0.0.1:0 >"$folder/server.log" 2>&1 &
server=$!
trap 'kill "$server" 2>/dev/null; rm -rf "$folder"' EXIT
port=""
for _ in $(seq 100); do
  port=$(sed -n 's/.*127\.0\.0\.1:\([0-9]\+\).*/\1/p' "$folder/server.log" | head -1)
  [[ -n $port ]] && break
  sleep 0.1
done
[[ -n $port ]] || { cat "$folder/server.log" >&2 && exit 1; }

# Commands stand behind four blanks.
sed -n 's/^    //p' "$root/$page" >"$folder/commands.sh"
[[ -s $folder/commands.sh ]] || { echo "run_page.sh: $page has no commands" >&2 && exit 1; }
cd "$folder"
CCSLICE_SERVER="127.0.0.1:$port" PATH="$root/build/release/client:$PATH" bash -euxo pipefail commands.sh
echo "run_page.sh: every command of $page ran"
