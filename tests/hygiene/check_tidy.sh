#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# The checks of clang-tidy that everything passes: functions have at most 60 lines. Reading all headers again for each
# source takes it some minutes, so tests/nightly.sh runs this. The options are those of .clang-tidy.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

checks='-*,readability-function-size'

# clang can't read the compiler's precompiled headers. Of what is generated only the contract's headers are needed.
cmake -S . -B build/tidy -G Ninja -D CMAKE_BUILD_TYPE=Release -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON \
  -D CCSLICE_BUILD_TESTS=OFF >build/tidy.log
cmake --build build/tidy --target ccslice_proto >>build/tidy.log

mapfile -t sources < <(find core server client -name '*.cpp' | sort)
printf '%s\0' "${sources[@]}" |
  xargs -0 -n 4 -P "$(nproc)" clang-tidy --quiet -p build/tidy --checks="$checks" --warnings-as-errors='*' 2>/dev/null
echo "${#sources[@]} sources checked"
