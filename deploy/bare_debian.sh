# shellcheck shell=bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# A bare Debian 12 in a folder, by debootstrap from this machine's own apt sources. To be sourced; needs root and
# debootstrap.

# This machine's sources of Debian 12, as lines of a sources.list.
apt_sources() {
  # shellcheck disable=SC2016 # The placeholders are apt's.
  apt-get indextargets --format 'deb $(REPO_URI) $(RELEASE) $(COMPONENT)' "Created-By: Packages" |
    grep -E ' bookworm(-updates|-security)? ' | sort --unique
}

# bare_debian <folder>: makes it, and tells apt in there of this machine's sources. <folder> must not exist.
bare_debian() {
  local root=$1 sources mirror options=(--variant=minbase)
  sources=$(apt_sources) || true
  mirror=$(awk '$3 == "bookworm" && $4 == "main" { print $2; exit }' <<<"$sources")
  [[ -n $mirror ]] || { echo "apt on this machine has no source for bookworm main" >&2 && return 1; }
  [[ $sources == *https:* ]] && options+=(--include=ca-certificates)
  debootstrap "${options[@]}" bookworm "$root" "$mirror" || return 1
  printf '%s\n' "$sources" >"$root/etc/apt/sources.list" || return 1
  { apt-config dump | grep -E '^Acquire::(http|https|Check-)' || true; } >"$root/etc/apt/apt.conf.d/90machine"
}
