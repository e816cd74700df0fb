#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# What takes too long for every change, step by step:
#
#   tests     the long tests, which tests/run.sh leaves out
#   jobs      random jobs by the thousands
#   meshes    every voxel of the real meshes
#   fuzz      libFuzzer: ten minutes on the way of an uploaded mesh, two on each other target
#   asan      the tests of the stages of the core, most of which .ci/run leaves out, and all of server and client,
#             ccsliced included, under AddressSanitizer and UndefinedBehaviorSanitizer
#   tsan      core and server/service under ThreadSanitizer
#   load      what the server stands (tests/bench/load_bench.py), and a part of a tray (tray_bench.py)
#   browser   the page of ccslice view in a browser, and how soon it shows something
#   plugins   Blender's and FreeCAD's, in the real ones
#   deploy    proxies, rolling restarts and the farm with the real programs, the long way
#   images    the container images (deploy/check-image.sh), for which it takes root
#   packages  the Debian packages (tests/install/check_deb.sh) and their services (check_service.sh), with root too
#   cad       the way from CAD, as written; five meshes of tetrahedra by Gmsh against the oracles
#   tidy      clang-tidy
#
#   tests/nightly.sh [--steps fuzz,load] [FIRST [LAST]]    # DEFAULT: all steps; seeds of random jobs 1 to 10000
#
# What each step prints goes to build/nightly, as do inputs that a fuzzer found. Ends with a table. Exit code 1 if
# anything failed; the rest is run all the same.

# shellcheck disable=SC2317 # run() calls the functions.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

readonly all_steps=tests,jobs,meshes,fuzz,asan,tsan,load,browser,plugins,deploy,images,packages,cad,tidy
steps=$all_steps
if [[ ${1:-} == --steps ]]; then
  steps=${2:?which of $all_steps?}
  shift 2
  for step in ${steps//,/ }; do
    [[ ",$all_steps," == *",$step,"* ]] || { echo "nightly.sh: no step $step; there are $all_steps" >&2 && exit 2; }
  done
fi
readonly first="${1:-1}" last="${2:-10000}"
readonly last_proved=$((first + (last - first) / 5)) # A fifth of the seeds are tried with proof, too.
readonly part=500                                    # Seeds a process: a crash ends one of them.
readonly reports=build/nightly corpora=build/nightly-corpora
readonly mesh_target=slice_mesh mesh_seconds=600 other_seconds=120 load_seconds=120 clients_seconds=300
readonly most_seconds=14400 # Of a step.
readonly oracles=({real_mesh,solid,slice,interpolation}_oracle_test)
failed=0
rows=()

# run <name> <command...>: a line of the table, and a report. Fails if the command does, or if it takes too long: then
# it is ended, with all that it started.
run() {
  local name=$1 outcome=ok begin=$SECONDS report step watch
  report="$reports/${name//[^A-Za-z0-9.]/_}.txt"
  shift
  echo "== $name"
  set -m # Each gets a process group of its own.
  "$@" >"$report" 2>&1 &
  step=$!
  (sleep "$most_seconds" && echo "ended after $most_seconds s" >>"$report" && kill -- "-$step") &
  watch=$!
  set +m
  wait "$step" || outcome=FAILED
  kill -- "-$watch" 2>/dev/null || true
  tail -n 2 "$report"
  if [[ $outcome == FAILED ]]; then failed=1; fi
  rows+=("$name|$((SECONDS - begin))|$outcome")
  [[ $outcome == ok ]]
}

wants() {
  [[ ",$steps," == *",$1,"* ]]
}

# Not as users build, but with sanitizers, where it takes a third of the time.
unity_of() {
  if [[ $1 == asan || $1 == fuzz ]]; then echo ON; else echo OFF; fi
}

# build <preset> <target>...
build() {
  local options=(-D CMAKE_UNITY_BUILD="$(unity_of "$1")")
  if [[ $1 == release ]]; then options+=(-D CCSLICE_BUILD_BENCHMARKS=ON -D CCSLICE_TEST_BATCHES=ON); fi
  cmake --preset "$1" "${options[@]}" && cmake --build --preset "$1" --parallel "$(nproc)" --target "${@:2}"
}

long_tests() {
  build release nightly_tests && ctest --preset release --label-regex nightly --parallel "$(nproc)"
}

# random_jobs <last> <report> <option>...
random_jobs() {
  local begin end status=0
  for ((begin = first; begin <= $1; begin += part)); do
    end=$((begin + part - 1 < $1 ? begin + part - 1 : $1))
    build/release/tests/bench/hostile_jobs --seeds "$begin..$end" "${@:3}" --json "$reports/$2_${begin}_$end.json" ||
      status=1
  done
  return "$status"
}

# fuzz <target> <seconds>: goes on with what earlier nights found.
fuzz() {
  mkdir -p "$corpora/$1"
  local seeds=("tests/fuzz/corpus/$1")
  if [[ -f core/mesh_files/$1.h || $1 =~ ^read_(mesh|ccmesh|json)$ ]]; then seeds+=(tests/data/meshes); fi
  build/fuzz/tests/fuzz/fuzz_"$1" -max_total_time="$2" -timeout=60 -rss_limit_mb=2048 -max_len=16384 \
    -artifact_prefix="$reports/$1-" -print_final_stats=1 "$corpora/$1" "${seeds[@]}"
}

# The fuzz preset's build has both sanitizers, and they end what they find something in.
tests_of() {
  ASAN_OPTIONS=detect_stack_use_after_return=1 UBSAN_OPTIONS=print_stacktrace=1 \
    LSAN_OPTIONS=suppressions="$PWD/tests/leaks_of_libraries.txt" \
    ctest --test-dir "build/fuzz/tests/$1" --output-on-failure --no-tests=error
}

core_tests() {
  build asan core_tests && ctest --preset asan --parallel "$(nproc)"
}

thread_sanitizer() {
  tests/tsan/build_tbb.sh && build tsan all && ctest --preset tsan --parallel "$(nproc)"
}

from_cad() {
  deploy/install.sh cad && tests/docs/run_page.sh docs/from-cad.md
}

# 700 to 4,000 tetrahedra: limits, inversion, occupancy and materials of each. The paper's own method, with which
# materials are compared besides, would take half an hour for the larger plates.
tetrahedra() {
  local paths="" name size made
  for made in tests/data/cad/{ball:3.2,cylinder:2.2} docs/cad/plate:{4,3,2.2}; do
    size=${made#*:} name=$(basename "${made%:*}")-$size
    gmsh "${made%:*}.geo" -3 -clmax "$size" -o "$reports/$name.msh" || return 1
    paths+="$PWD/$reports/$name.msh:"
  done
  for name in "${oracles[@]}"; do
    CCSLICE_TETRAHEDRA="$paths" "build/release/tests/oracle/$name" \
      --gtest_filter='Fixtures/*:-Fixtures/RealMaterials*plate_2*:Fixtures/RealMaterials*plate_3*' || return 1
  done
}

# With screenshots beside the reports. On a machine that is not too busy the first picture is there within a second.
browser() {
  deploy/install.sh browser &&
    tests/browser/run.py build/release/server/ccsliced build/release/client/ccslice "$reports/browser" &&
    tests/browser/first_picture.py build/release/server/ccsliced build/release/client/ccslice --most-ms 3000
}

plugins() {
  deploy/install.sh hosts && tests/plugins/run.py build/release/server/ccsliced build/release/client/ccslice
}

deployed() {
  tests/deploy/run.sh --long
}

images() {
  deploy/install.sh containers && deploy/check-image.sh
}

rm -rf "$reports"
mkdir -p "$reports"
run "what it takes" deploy/install.sh build test bench fuzz || true

if wants tests || wants jobs || wants meshes || wants load || wants browser || wants plugins || wants deploy ||
  wants cad; then
  if run "build for users" build release ccslice ccsliced hostile_jobs error_analysis "${oracles[@]}"; then
    run "packages of the programs" tests/hygiene/check_packages.py \
      server=build/release/server/ccsliced client=build/release/client/ccslice || true
    ! wants tests || run "long tests" long_tests || true
    ! wants jobs || run "random jobs $first to $last" random_jobs "$last" jobs || true
    ! wants jobs || run "proved jobs $first to $last_proved" random_jobs "$last_proved" proved_jobs --prove || true
    ! wants meshes || run "voxels of real meshes" build/release/tests/bench/error_analysis || true
    if wants load; then
      run "load: clients" tests/bench/load_bench.py --parts clients --seconds "$clients_seconds" \
        --json "$reports/load_clients.json" || true
      run "load: the rest" tests/bench/load_bench.py --without clients --seconds "$load_seconds" \
        --json "$reports/load.json" || true
      run "load: a tray" tests/bench/tray_bench.py --every 57 --json "$reports/tray.json" || true
    fi
    ! wants browser || run "the page in a browser" browser || true
    ! wants plugins || run "plug-ins in their hosts" plugins || true
    ! wants deploy || run "what deploy/ ships" deployed || true
    if wants cad; then
      run "docs/from-cad.md" from_cad || true
      run "tetrahedra of Gmsh" tetrahedra || true
    fi
  fi
fi

if wants fuzz || wants asan; then
  # Without the core's own tests: Clang 14 can't compile all of them.
  if run "build for fuzzing" build fuzz {server,client,tests/{fuzz,server,client,integration}}/all; then
    for target in $(wants fuzz && ls tests/fuzz/corpus); do
      seconds=$other_seconds
      if [[ $target == "$mesh_target" ]]; then seconds=$mesh_seconds; fi
      run "fuzz $target" fuzz "$target" "$seconds" || true
    done
    for folder in $(wants asan && echo server client integration); do
      run "ASan, UBSan: tests/$folder" tests_of "$folder" || true
    done
  fi
  ! wants asan || run "ASan, UBSan: core" core_tests || true
fi

! wants tsan || run "TSan: core, server/service" thread_sanitizer || true
! wants images || run "container images" images || true
if wants packages && run "build for packages" build release ccslice_installed; then
  run "Debian packages" tests/install/check_deb.sh build/release || true
  run "their services" tests/install/check_service.sh build/release || true
fi
! wants tidy || run "clang-tidy" tests/hygiene/check_tidy.sh || true

grep -hos "^FAILED seed [0-9]*" "$reports"/random_jobs_*.txt || true
printf '\n%-36s %8s  %s\n' step seconds outcome
for row in "${rows[@]}"; do
  IFS='|' read -r name seconds outcome <<<"$row"
  printf '%-36s %8d  %s\n' "$name" "$seconds" "$outcome"
done
exit "$failed"
