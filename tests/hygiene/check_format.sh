#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# C++ sources are formatted as .clang-format says, shell scripts pass shellcheck. "check_format.sh --fix" formats.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

tree() {
  find . \( -name .git -o -name build -o -name node_modules -o -name out \) -prune -o -type f "$@" -print
}

mapfile -t sources < <(tree \( -name '*.h' -o -name '*.cpp' \) | sort)
mapfile -t scripts < <({ tree -name '*.sh' && echo ./.ci/run; } | sort)

if [[ ${1:-} == --fix ]]; then
  clang-format -i "${sources[@]}"
else
  clang-format --dry-run --Werror "${sources[@]}"
fi
shellcheck "${scripts[@]}"
echo "${#sources[@]} C++ files and ${#scripts[@]} scripts checked"
