#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs the Debian 12 packages of the given groups, where they are missing.
#
#   deploy/install.sh build          what compiling ccsliced and ccslice takes
#   deploy/install.sh test           test frameworks, oracles, linters
#   deploy/install.sh bench          benchmarks
#   deploy/install.sh peers          other programs that benchmarks run beside ours
#   deploy/install.sh cad            the mesh generator of docs/from-cad.md
#   deploy/install.sh package        making the Debian packages (deploy/debian), and trying them
#   deploy/install.sh containers     building and running images without a Docker engine
#   deploy/install.sh fuzz           clang for the fuzz preset
#   deploy/install.sh browser        the browser that opens the page of ccslice view
#   deploy/install.sh hosts          programs that plug-ins run in
#   deploy/install.sh server         the libraries that ccsliced links: for machines that only run it
#   deploy/install.sh server-slim    the same without OpenImageIO (CCSLICE_WITH_OPENIMAGEIO=OFF)
#   deploy/install.sh client         the libraries that ccslice links
#   deploy/install.sh farm           what a worker of deploy/farm takes besides

set -euo pipefail

readonly build=(
  cmake
  g++
  libcli11-dev
  libcpp-httplib-dev
  libdeflate-dev
  libeigen3-dev
  libgrpc++-dev
  libhiredis-dev
  libimath-dev
  liblz4-dev
  liblzma-dev
  libminizip-dev
  libopenimageio-dev
  libpng-dev
  libprotobuf-dev
  libpugixml-dev
  libspdlog-dev
  libssl-dev
  libtbb-dev
  libzstd-dev
  ninja-build
  pkgconf
  prometheus-cpp-dev
  protobuf-compiler
  protobuf-compiler-grpc
  zlib1g-dev
)

readonly test=(
  ca-certificates
  clang-format
  clang-tidy
  curl
  docker-compose
  git
  haproxy
  imagemagick
  libgmock-dev
  libgtest-dev
  libosd-dev
  libpng-tools
  man-db
  nginx
  openssl
  prometheus
  python3
  python3-celery
  python3-grpcio
  python3-jsonschema
  python3-numpy
  python3-pil
  python3-pip
  python3-protobuf
  python3-redis
  python3-setuptools
  python3-wheel
  python3-yaml
  python3-zstandard
  rabbitmq-server
  redis-server
  shellcheck
  slurm-wlm
  zsh
)

readonly bench=(
  gnuplot-nox
  haproxy
  libbenchmark-dev
  python3
)

readonly peers=(
  prusa-slicer
  python3
  python3-vtk9
)

readonly cad=(
  gmsh
)

readonly packaging=(
  debhelper
  debootstrap
  dpkg-dev
  lintian
  systemd-container # What boots a Debian with services.
)

readonly containers=(
  aardvark-dns
  bsdextrautils
  buildah
  curl
  debootstrap
  docker-compose
  iptables # What netavark sets a network's rules with.
  netavark
  openssl
  podman
  runc
)

readonly browser=(
  chromium
  python3
)

readonly hosts=(
  blender
  freecad
  python3-numpy
  python3-pil
)

readonly fuzz=(
  clang-14
  libclang-rt-14-dev
)

# What the programs link themselves; tests/hygiene/check_packages.py compares. The packages' own dependencies come along.
readonly server_slim=(
  libabsl20220623
  libc6
  libcpp-httplib0.11
  libdeflate0
  libfmt9
  libgcc-s1
  libgrpc++1.51
  libgrpc29
  libhiredis0.14
  libprometheus-cpp-core1.0
  libprotobuf32
  libspdlog1.10
  libssl3
  libstdc++6
  libtbb12
  libzstd1
)

readonly server=(
  "${server_slim[@]}"
  libopenimageio2.4
)

readonly client=(
  libabsl20220623
  libc6
  libcpp-httplib0.11
  libdeflate0
  libgcc-s1
  libgrpc++1.51
  libgrpc29
  liblz4-1
  liblzma5
  libminizip1
  libpng16-16
  libprotobuf32
  libpugixml1v5
  libssl3
  libstdc++6
  libtbb12
  libzstd1
  zlib1g
)

readonly farm=(
  python3
  python3-celery
  python3-redis
)

readonly groups="build test bench peers cad package containers fuzz browser hosts server server-slim client farm"

fail() {
  echo "install.sh: $*" >&2
  exit 1
}

# os_release <KEY>: that value of /etc/os-release, or nothing.
os_release() {
  sed -n "s/^$1=\"\{0,1\}\([^\"]*\)\"\{0,1\}$/\1/p" /etc/os-release 2>/dev/null || true
}

require_debian_12() {
  local id version
  id=$(os_release ID)
  version=$(os_release VERSION_ID)
  [[ $id == debian && $version == 12 ]] ||
    fail "needs Debian 12, found ${id:-an unknown system} ${version}. Install the packages listed in this script by hand."
}

packages_of() {
  case $1 in
    build) printf '%s\n' "${build[@]}" ;;
    test)
      printf '%s\n' "${test[@]}"
      # Any npm does: other sources of Node.js bring their own and conflict with Debian's.
      command -v npm >/dev/null || echo npm
      ;;
    bench) printf '%s\n' "${bench[@]}" ;;
    peers) printf '%s\n' "${peers[@]}" ;;
    cad) printf '%s\n' "${cad[@]}" ;;
    package) printf '%s\n' "${packaging[@]}" ;;
    browser)
      printf '%s\n' "${browser[@]}"
      command -v npm >/dev/null || echo npm
      ;;
    hosts) printf '%s\n' "${hosts[@]}" ;;
    containers) printf '%s\n' "${containers[@]}" ;;
    fuzz) printf '%s\n' "${fuzz[@]}" ;;
    server) printf '%s\n' "${server[@]}" ;;
    server-slim) printf '%s\n' "${server_slim[@]}" ;;
    client) printf '%s\n' "${client[@]}" ;;
    farm) printf '%s\n' "${farm[@]}" ;;
    *) fail "unknown group '$1'. Groups: $groups" ;;
  esac
}

is_installed() {
  [[ $(dpkg-query --show --showformat='${db:Status-Status}' "$1" 2>/dev/null) == installed ]]
}

as_root() {
  if [[ $(id -u) == 0 ]]; then
    "$@"
  elif command -v sudo >/dev/null; then
    sudo "$@"
  else
    fail "needs root or sudo to install: ${missing[*]}"
  fi
}

# Packages of servers would start them; whoever wants one starts it. Debian's tools ask this file, if there is one.
readonly no_services=/usr/sbin/policy-rc.d
start_no_services() {
  [[ -e $no_services ]] && return
  as_root sh -c "printf '#!/bin/sh\nexit 101\n' >$no_services && chmod 755 $no_services"
  trap 'as_root rm -f "$no_services"' EXIT
}

# Quiet unless something goes wrong.
apt_get() {
  local log
  log=$(mktemp)
  if ! as_root env DEBIAN_FRONTEND=noninteractive apt-get -qq -o Dpkg::Use-Pty=0 -o Acquire::Retries=3 \
    -o DPkg::Lock::Timeout=300 "$@" </dev/null >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    fail "apt-get $1 failed"
  fi
  rm -f "$log"
}

install_group() {
  local group=$1 list package
  list=$(packages_of "$group")
  missing=()
  for package in $list; do
    is_installed "$package" || missing+=("$package")
  done
  if ((${#missing[@]} == 0)); then
    echo "install.sh: $group: complete"
    return
  fi
  if [[ $updated == no ]]; then
    apt_get update
    updated=yes
  fi
  start_no_services
  echo "install.sh: $group: installing ${missing[*]}"
  apt_get install --yes --no-install-recommends "${missing[@]}"
}

(($# > 0)) || fail "name one or more groups: $groups"
for group in "$@"; do
  packages_of "$group" >/dev/null
done
require_debian_12
updated=no
for group in "$@"; do
  install_group "$group"
done
