# shellcheck shell=bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# What the trials of packages on a bare Debian share. To be sourced from the repository's root; needs root. Leaves the
# folders $work, which goes with the script, and $root, which is to be the Debian.

[[ $(id -u) == 0 ]] || { echo "$(basename "$0"): needs root" >&2 && exit 1; }
work=$(mktemp -d)
root=$work/debian

fail() {
  echo "$(basename "$0"): $1" >&2
  exit 1
}

# Ends mounts too, debootstrap's own among them if it was interrupted. before_cleaning may be defined.
clean() {
  local mount
  if declare -F before_cleaning >/dev/null; then before_cleaning || true; fi
  while read -r mount; do
    umount "$mount" || umount --lazy "$mount" || true
  done < <(awk -v work="$work/" 'index($2, work) == 1 { print $2 }' /proc/mounts | sort --reverse)
  rm -rf --one-file-system "$work"
}
trap clean EXIT
trap 'exit 130' INT
trap 'exit 143' TERM

# step <name> <command...>: prints the seconds. In a condition, bash would go on after commands of a function that fail.
step() {
  local name=$1 begin=$SECONDS code
  shift
  (($# > 0)) || fail "nothing to do: $name"
  set +e
  (set -e && "$@") >"$work/step.log" 2>&1
  code=$?
  set -e
  ((code == 0)) || { tail -60 "$work/step.log" >&2 && fail "failed: $name"; }
  printf '%-60s %4d s\n' "$name" $((SECONDS - begin))
}

in_chroot() {
  chroot "$root" env -i HOME=/tmp PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive "$@"
}
