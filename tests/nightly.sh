#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# What takes too long for every change: random jobs by the thousands, every voxel of the real meshes, interpolation under
# sanitizers, the way from CAD, and clang-tidy.
#
#   tests/nightly.sh [FIRST [LAST]]    # seeds, DEFAULT: 1 10000
#
# Reports go to build/nightly. Exit code 1 if anything failed; the rest is run all the same.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

first="${1:-1}"
last="${2:-10000}"
part=500 # Seeds a process: a crash ends one of them.
reports=build/nightly
failed=0

cmake --preset release -D CCSLICE_BUILD_BENCHMARKS=ON
cmake --build --preset release --parallel "$(nproc)" --target ccslice ccsliced hostile_jobs error_analysis
rm -rf "$reports"
mkdir -p "$reports"

for ((begin = first; begin <= last; begin += part)); do
  end=$((begin + part - 1 < last ? begin + part - 1 : last))
  name="$reports/hostile_jobs_${begin}_${end}"
  echo "== Random jobs $begin..$end"
  build/release/tests/bench/hostile_jobs --seeds "$begin..$end" --json "$name.json" | tee "$name.txt" || failed=1
done

echo "== Real meshes"
build/release/tests/bench/error_analysis | tee "$reports/error_analysis.txt" || failed=1

echo "== Interpolation under AddressSanitizer and UndefinedBehaviorSanitizer"
cmake --preset asan
cmake --build --preset asan --parallel "$(nproc)" --target interpolation_test
ctest --preset asan --parallel "$(nproc)" --tests-regex interpolation_test || failed=1

echo "== The commands of docs/from-cad.md"
deploy/install.sh cad
tests/docs/run_page.sh docs/from-cad.md >"$reports/from_cad.txt" 2>&1 || failed=1
tail -1 "$reports/from_cad.txt"

echo "== clang-tidy"
tests/hygiene/check_tidy.sh || failed=1

if ((failed)); then
  echo "FAILED; the seeds:"
  grep -ho "^FAILED seed [0-9]*" "$reports"/hostile_jobs_*.txt || true
fi
exit "$failed"
