#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs the tests: installs what they need, builds, runs. Arguments go to ctest: tests/run.sh -R Contour
# Without any it runs all but the long ones (label nightly), which tests/nightly.sh runs, and the cases run in batches,
# which is faster. The files of a folder are compiled as one, which takes a third of the time from scratch;
# CCSLICE_UNITY=OFF compiles each by itself, for who changes them one by one. CCSLICE_WERROR=ON makes errors of the
# compiler's warnings.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

batches=OFF
if (($# == 0)); then
  batches=ON
  set -- --label-exclude nightly
fi

deploy/install.sh build test
cmake --preset release -D CCSLICE_TEST_BATCHES="$batches" \
  -D CCSLICE_WERROR="${CCSLICE_WERROR:-OFF}" -D CMAKE_UNITY_BUILD="${CCSLICE_UNITY:-ON}"
cmake --build --preset release --parallel "$(nproc)"
# Many tests wait for servers most of their time.
ctest --preset release --parallel "$(($(nproc) + 1))" "$@"
