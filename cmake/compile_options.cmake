# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# ccslice_compile_options: what every target of ours is compiled with. Users of the installed client library get none of
# it. Link it PUBLIC: Eigen's memory layout depends on the instruction set, so all translation units must agree on it.
#
# Replicas have to agree to the bit. So one instruction set, no -ffast-math, and no silent contraction of a * b + c (it
# depends on how a compiler happens to inline): kernels that want a fused multiply-add say so.

add_library(ccslice_compile_options INTERFACE)

target_compile_features(ccslice_compile_options INTERFACE cxx_std_20)

target_compile_options(
  ccslice_compile_options
  INTERFACE
    $<BUILD_INTERFACE:-march=${CCSLICE_MARCH}>
    $<BUILD_INTERFACE:-ffp-contract=off>
    # As gRPC asks for: precompiled headers are of use to those compiled alike.
    $<BUILD_INTERFACE:-pthread>
    $<BUILD_INTERFACE:-Wall>
    $<BUILD_INTERFACE:-Wextra>
    # g++ 12 finds overlaps and overflows in "text" + std::string that aren't there.
    $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>>
    $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>>
)

# -Warray-bounds finds them there too, and is of use elsewhere.
if(CCSLICE_WERROR)
  target_compile_options(
    ccslice_compile_options
    INTERFACE
      $<BUILD_INTERFACE:-Werror>
      $<BUILD_INTERFACE:$<$<CXX_COMPILER_ID:GNU>:-Wno-error=array-bounds>>
  )
endif()

target_include_directories(ccslice_compile_options INTERFACE "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>")

# Tables of functions are read-only once a program has begun: all are looked up at its start.
target_link_options(ccslice_compile_options INTERFACE $<BUILD_INTERFACE:LINKER:-z,relro,-z,now>)

if(CCSLICE_SANITIZE)
  target_compile_options(
    ccslice_compile_options
    INTERFACE
      -fsanitize=${CCSLICE_SANITIZE}
      -fno-sanitize-recover=all
      -fno-omit-frame-pointer
  )
  if(CCSLICE_SANITIZE MATCHES "address")
    # A quarter of the compiler's time, for what AddressSanitizer finds too.
    target_compile_options(ccslice_compile_options INTERFACE -fno-sanitize=alignment,null,object-size,vptr)
  endif()
  target_link_options(ccslice_compile_options INTERFACE -fsanitize=${CCSLICE_SANITIZE})
endif()

# libFuzzer steers by the branches taken in all of our code.
if(CCSLICE_BUILD_FUZZERS)
  target_compile_options(ccslice_compile_options INTERFACE -fsanitize=fuzzer-no-link)
endif()

set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# ccache takes no precompiled headers unless it is told so.
find_program(CCSLICE_CCACHE ccache)
if(CCSLICE_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros
                                  "${CCSLICE_CCACHE}")
endif()
add_compile_options("$<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>")

# Most of the time of a small file goes into reading these. Files include what they use all the same: builds with
# CMAKE_DISABLE_PRECOMPILE_HEADERS=ON (the container images are) show what is missing.
set(CCSLICE_COMMON_HEADERS
    <algorithm>
    <array>
    <cmath>
    <cstdint>
    <functional>
    <limits>
    <map>
    <memory>
    <optional>
    <span>
    <string>
    <string_view>
    <tuple>
    <utility>
    <vector>
)
