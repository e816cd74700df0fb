#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# The checks of clang-tidy that everything passes: functions have at most 60 lines. They take some minutes, so
# tests/nightly.sh runs this. The options are those of .clang-tidy.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

checks='-*,readability-function-size'

# clang can't read the compiler's precompiled headers. Dozens of sources share a unit, so that headers are read once.
# What is generated isn't checked, and of it only the headers of messages are there.
cmake -S . -B build/tidy -G Ninja -D CMAKE_BUILD_TYPE=Release -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
  -D CMAKE_UNITY_BUILD=ON -D CCSLICE_BUILD_TESTS=OFF >build/tidy.log
cmake --build build/tidy --target ccslice_proto ccslice_cli_proto >>build/tidy.log

mapfile -t units < <(python3 -c '
import json
for unit in json.load(open("build/tidy/compile_commands.json")):
    if "/proto/" not in unit["file"] and "build_tidy" not in unit["file"]:
        print(unit["file"])')
printf '%s\0' "${units[@]}" |
  xargs -0 -n 1 -P "$(nproc)" clang-tidy --quiet -p build/tidy --checks="$checks" \
    --header-filter="^$PWD/(core|server|client)/" --warnings-as-errors='*' 2>/dev/null
echo "${#units[@]} units checked"
