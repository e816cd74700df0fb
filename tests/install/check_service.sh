#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Installs, starts, reloads, upgrades, stops, removes and purges the Debian packages of a build in a booted Debian 12
# (systemd-nspawn, without a network), with jobs running meanwhile: their pictures are those of a job that nobody
# disturbed. Then the farm's worker does a job. Needs root. Prints what each step took, and systemd's view of the
# service's security; exit code 1 if a step fails.
#
#   tests/install/check_service.sh build/release

set -euo pipefail
build=$(realpath "${1:?which build?}")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# shellcheck source=deploy/bare_debian.sh
source deploy/bare_debian.sh
# shellcheck source=tests/install/in_debian.sh
source tests/install/in_debian.sh
deploy/install.sh package

readonly unit=ccsliced.service most_exposure=15 # Of 100
readonly before=0.0.1 # A version that any is an upgrade of.
# Longer than an upgrade takes: some twenty seconds of one processor.
readonly job=(--pitch "0.04,0.04,0.025" --channel hardness) short_job=(--pitch 0.2 --channel hardness)
console=""
leader=""

before_cleaning() {
  [[ -z $console ]] || { kill "$console" && wait "$console"; } 2>/dev/null
}

boot() {
  # Its own network: the ports of this machine's servers are not its own.
  systemd-nspawn --quiet --directory "$root" --boot --register=no --keep-unit --private-network --console=pipe \
    --machine=ccslice-trial </dev/null >"$work/console.log" 2>&1 &
  console=$!
}

# Runs a command in the booted system, where it is root.
inside() {
  nsenter --target "$leader" --all env -i HOME=/srv LANG=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin \
    DEBIAN_FRONTEND=noninteractive "$@"
}

within() {
  local seconds=$1 end
  shift
  end=$((SECONDS + seconds))
  until "$@"; do
    ((SECONDS < end)) || fail "not within $seconds s: $*"
    sleep 0.2
  done
}

refuses() {
  if "$@"; then fail "it passes: $*"; fi
}

property() {
  inside systemctl show --property "$1" --value "$unit"
}

log() {
  inside journalctl --unit "$unit" --output cat --no-pager
}

is_running() {
  [[ $(property SubState) == running ]]
}

is_up() {
  leader=$(pgrep --parent "$console" || true)
  [[ -n $leader ]] && inside systemctl is-system-running --quiet 2>/dev/null
}

# --- Steps ------------------------------------------------------------------------------------------------------------

make_packages() {
  mkdir "$root/mnt/before" "$root/mnt/after"
  deploy/debian/make_packages.sh --version "$before" "$build" "$root/mnt/before"
  deploy/debian/make_packages.sh "$build" "$root/mnt/after"
}

# What they depend on comes while there is a network.
fetch() {
  in_chroot apt-get update
  in_chroot apt-get install --yes --no-install-recommends systemd systemd-sysv dbus redis-server man-db
  in_chroot sh -c "apt-get install --yes --no-install-recommends --download-only /mnt/after/*.deb"
}

# apt <verb and packages...>, where packages may be patterns of the booted system.
apt() {
  inside sh -c "apt-get --yes --no-install-recommends $*"
}

check_started() {
  [[ $(inside systemctl is-active "$unit") == active && $(inside systemctl is-enabled "$unit") == enabled ]]
  [[ $(property Type) == notify && $(property StatusText) == "serves on 127.0.0.1:50051" ]]
  [[ $(property MemoryMax) =~ ^[0-9]+$ ]]
  local uid
  uid=$(inside stat --format %u "/proc/$(property MainPID)")
  ((uid >= 61184 && uid <= 65519)) # DynamicUser's.
  inside ccslice info --server localhost:50051
  inside man --where ccsliced ccslice ccslice-slice
}

check_unit() {
  local complaints
  complaints=$(inside systemd-analyze verify "$unit" 2>&1) || true
  [[ -z $complaints ]] || fail "systemd-analyze verify: $complaints"
  inside systemd-analyze security --offline=yes --threshold="$most_exposure" \
    "/lib/systemd/system/$unit" >"$work/security"
}

# Not restarted for ever: a misspelled variable stays one.
check_wrong_options() {
  cp "$root/etc/default/ccsliced" "$work/default"
  echo "CCSLICE_MEMROY=1GiB" >>"$root/etc/default/ccsliced"
  refuses inside systemctl restart "$unit"
  [[ $(property Result) == exit-code && $(property ExecMainStatus) == 2 && $(property NRestarts) == 0 ]]
  log | grep "CCSLICE_MEMROY; did you mean CCSLICE_MEMORY?"
  # So that a job outlasts what an upgrade grants it, on any machine.
  { cat "$work/default" && echo CCSLICE_SHUTDOWN_GRACE=1s && echo CCSLICE_THREADS=1; } >"$root/etc/default/ccsliced"
  inside systemctl reset-failed "$unit"
  inside systemctl restart "$unit"
}

check_reload() {
  local pid
  pid=$(property MainPID)
  inside systemctl reload "$unit"
  within 10 is_running
  [[ $(property MainPID) == "$pid" && $(property NRestarts) == 0 ]]
}

# slice <folder> <option...>
slice() {
  inside ccslice slice /srv/part.ccmesh --server localhost:50051 "${@:2}" -o "/srv/$1"
}

undisturbed_jobs() {
  inside ccslice models engine -o /srv/part.ccmesh
  slice undisturbed "${job[@]}"
  has_files undisturbed 500
  slice undisturbed-short "${short_job[@]}"
}

# has_files <job> <number>: at least so many.
has_files() {
  (($(find "$root/srv/$1" -type f 2>/dev/null | wc -l) >= $2))
}

# Begins a job of that name, and waits for its first layers.
begin_job() {
  slice "$1" "${job[@]}" >"$work/$1.log" 2>&1 &
  running=$!
  within 60 has_files "$1" 10
}

# The job goes on meanwhile; its pictures are the right ones.
end_job() {
  wait "$running" || { cat "$work/$1.log" && fail "the job failed"; }
  diff --recursive "$root/srv/undisturbed" "$root/srv/$1"
}

upgrade() {
  local pid
  pid=$(property MainPID)
  begin_job upgraded
  apt install "/mnt/after/ccsliced_*.deb" "/mnt/after/ccslice_*.deb"
  kill -0 "$running" || fail "the job was over before the upgrade"
  [[ $(property MainPID) != "$pid" && $(inside systemctl is-active "$unit") == active ]]
  grep -x CCSLICE_SHUTDOWN_GRACE=1s "$root/etc/default/ccsliced"
  end_job upgraded
}

# However little patience the unit has, the server says that it takes longer.
stop_patiently() {
  mkdir -p "$root/etc/systemd/system/$unit.d"
  printf '[Service]\nTimeoutStopSec=1s\nEnvironment=CCSLICE_DRAIN_DELAY=3s\n' >"$root/etc/systemd/system/$unit.d/hasty.conf"
  inside systemctl daemon-reload
  inside systemctl restart "$unit"
  local begin=$SECONDS
  inside systemctl stop "$unit"
  ((SECONDS - begin >= 2))
  [[ $(property Result) == success && $(property ExecMainStatus) == 0 ]]
  rm -r "$root/etc/systemd/system/$unit.d"
  inside systemctl daemon-reload
  inside systemctl start "$unit"
}

remove() {
  [[ -n $(ls "$root/var/lib/private/ccsliced") ]] || fail "no mesh was kept"
  apt remove ccsliced
  refuses inside systemctl is-active "$unit"
  [[ ! -e $root/usr/bin/ccsliced && -e $root/etc/default/ccsliced && -e $root/var/lib/private/ccsliced ]]
}

purge() {
  apt purge ccsliced
  local left
  left=$(find "$root"/{etc,lib,usr,var/lib} -name "*ccsliced*" ! -path "*/man/*" ! -path "*/info/*" || true)
  [[ -z $left ]] || fail "left behind: $left"
  [[ -z $(inside systemctl list-units --failed --plain --no-legend) ]]
}

# A worker slices on the server of this machine; whoever is in the group may submit.
farm() {
  apt install "/mnt/after/*.deb"
  refuses inside systemctl is-active ccslice-farm.service
  inside systemctl start redis-server
  [[ -z $(inside systemd-analyze verify ccslice-farm.service 2>&1) ]]
  echo "CCSLICE_SERVER=localhost:50051" >>"$root/etc/default/ccslice-farm"
  inside systemctl enable --now ccslice-farm.service
  inside useradd --groups ccslice-farm worker
  as_worker submit part /srv/part.ccmesh --shares 2 -- "${short_job[@]}"
  within 120 test -s "$root/var/lib/ccslice-farm/part/layers/manifest.json"
  as_worker status part
  diff --recursive "$root/srv/undisturbed-short" "$root/var/lib/ccslice-farm/part/layers"
  apt purge ccslice-farm
  [[ -e $root/var/lib/ccslice-farm/part/layers ]] || fail "the jobs are gone"
}

as_worker() {
  inside env CCSLICE_FARM_FOLDER=/var/lib/ccslice-farm CCSLICE_SERVER=localhost:50051 \
    runuser --user worker -- sh -c 'umask 002 && exec ccslice-farm "$@"' ccslice-farm "$@"
}

step "A bare Debian 12" bare_debian "$root"
step "The packages, as two versions" make_packages
step "What they depend on" fetch
echo "127.0.0.1 localhost" >"$root/etc/hosts"
boot
within 180 is_up
step "Installed" apt install "/mnt/before/ccsliced_*.deb" "/mnt/before/ccslice_*.deb"
step "Started, as a user of its own" check_started
step "Its unit" check_unit
tail -n 1 "$work/security"
step "Misspelled variables are refused" check_wrong_options
step "Reloaded" check_reload
step "Jobs that nobody disturbs" undisturbed_jobs
step "Upgraded, with a job" upgrade
step "Stopped, patiently" stop_patiently
step "Removed" remove
step "Purged" purge
step "A worker of the farm" farm
echo "check_service.sh: the packages' services start, reload, survive upgrades and go"
