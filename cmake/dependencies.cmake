# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Everything is a Debian 12 package (deploy/install.sh).

find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)

# core
find_package(Eigen3 REQUIRED CONFIG)
find_package(TBB REQUIRED CONFIG)
find_package(ZLIB REQUIRED)
find_package(pugixml REQUIRED CONFIG)
pkg_check_modules(libdeflate REQUIRED IMPORTED_TARGET libdeflate)
pkg_check_modules(liblz4 REQUIRED IMPORTED_TARGET liblz4)
pkg_check_modules(liblzma REQUIRED IMPORTED_TARGET liblzma)
pkg_check_modules(zstd REQUIRED IMPORTED_TARGET libzstd)

# OpenImageIO's own CMake package asks for packages that Debian doesn't install with it.
if(CCSLICE_WITH_OPENIMAGEIO)
  find_package(Imath REQUIRED CONFIG)
  pkg_check_modules(OpenImageIO REQUIRED IMPORTED_TARGET OpenImageIO)
endif()

# proto, server, client. Debian packages no CONFIG file for protobuf.
if(CCSLICE_BUILD_SERVER OR CCSLICE_BUILD_CLIENT)
  find_package(Protobuf REQUIRED MODULE)
  find_package(gRPC REQUIRED CONFIG)
  if(CCSLICE_BUILD_SERVER)
    find_package(prometheus-cpp REQUIRED CONFIG)
  endif()
endif()

# server/service, which is built without gRPC, too.
find_package(spdlog REQUIRED CONFIG)
pkg_check_modules(hiredis REQUIRED hiredis)
pkg_check_modules(httplib REQUIRED IMPORTED_TARGET cpp-httplib)

if(CCSLICE_BUILD_TESTS)
  find_package(GTest REQUIRED CONFIG)
endif()

if(CCSLICE_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED CONFIG)
endif()
