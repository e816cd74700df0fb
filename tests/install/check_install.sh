#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs a build into a folder and uses what is there: the programs, which find each other; the manual; the
# completions; the client library, by a program of somebody else's.
#
#   tests/install/check_install.sh build/release

set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build=$(realpath "${1:?which build?}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/usr

fail() {
  echo "check_install.sh: $1" >&2
  exit 1
}

cmake --install "$build" --prefix "$prefix" >"$work/install.log"
export PATH="$prefix/bin:$PATH"
unset CCSLICE_SERVER CCSLICED

# A command finds the ccsliced beside it.
cd "$work"
ccslice models box -o box.ccmesh >/dev/null
ccslice info --local >info.txt 2>info.err
grep -q "started $prefix/bin/ccsliced" info.err || fail "another server was started: $(cat info.err)"
ccslice slice box.ccmesh --local --pitch 0.5 --json -o layers >slice.json

# The manual has a page for each command, which man reads without complaint.
for command in $(ccslice --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]\+\) .*/ccslice-\1/p') \
               ccslice-tray-pack ccslice-tray-export ccslice-tray-import ccslice ccsliced; do
  page=$prefix/share/man/man1/$command.1
  [[ -f $page ]] || fail "$command has no page"
  complaints=$(LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=100 man --warnings -E UTF-8 -l -Tutf8 -Z "$page" 2>&1 >/dev/null)
  [[ -z $complaints ]] || fail "man says of $command.1: $complaints"
done
LC_ALL=C.UTF-8 MANWIDTH=100 man -l "$prefix/share/man/man1/ccslice-slice.1" >slice.txt
grep -q -- "--halftone" slice.txt || fail "the page of ccslice slice lacks --halftone"

# Bash completes commands, options, their values and files.
completions_of() {
  local -a COMP_WORDS=("$@")
  local COMP_CWORD=$(($# - 1))
  COMPREPLY=()
  _ccslice
  echo "${COMPREPLY[*]}"
}
# shellcheck source=/dev/null
source "$prefix/share/bash-completion/completions/ccslice"
expect() {
  local wanted=$1
  shift
  local got
  got=$(completions_of "$@")
  [[ " $got " == *" $wanted "* ]] || fail "completing '$*' gives '$got', not '$wanted'"
}
expect slice ccslice sl
expect help ccslice he
expect --halftone ccslice slice --half
expect error-diffusion ccslice slice --halftone err
expect grabcad ccslice slice --format ""
expect box.ccmesh ccslice slice bo
expect plan ccslice help pl
expect import ccslice tray im
expect export ccslice tray ""
expect --copies ccslice tray pack --cop
expect grabcad ccslice tray pack --format ""
expect box.ccmesh ccslice tray export bo
[[ $(completions_of ccslice models --half) == "" ]] || fail "models has no --halftone"
zsh -n "$prefix/share/zsh/site-functions/_ccslice" || fail "zsh can't read its completion"
described=$(cd "$work" && zsh -f -c "
  fpath=('$prefix/share/zsh/site-functions' \$fpath)
  autoload -Uz compinit && compinit -D -u
  whence -w _ccslice; print \$_comps[ccslice]")
[[ $described == *"_ccslice: function"*_ccslice ]] || fail "zsh doesn't know the completion: $described"

# The client library, by find_package.
cmake -S "$here/consumer" -B "$work/consumer" -D CMAKE_PREFIX_PATH="$prefix" >"$work/consumer.log" 2>&1 ||
  fail "no find_package(ccslice): $(tail -20 "$work/consumer.log")"
cmake --build "$work/consumer" >>"$work/consumer.log" 2>&1 || fail "no build: $(tail -20 "$work/consumer.log")"
mkfifo input
ccsliced --private --log-level error <input >address &
exec 3>input
for _ in $(seq 100); do
  [[ -s address ]] && break
  sleep 0.1
done
voxels=$(consumer/consumer "$(cat address)" box.ccmesh 0.5)
exec 3>&-
wait
[[ $(cat slice.json) == *"\"voxel_count\":$voxels,"* ]] || fail "the library counts $voxels voxels: $(cat slice.json)"
echo "check_install.sh: programs, manual, completions and library work"
