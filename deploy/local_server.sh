# shellcheck shell=bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# For scripts to source: a server of build/release on a free port, for as long as the script runs.

server_pid=

stop_server() {
  if [[ -n $server_pid ]]; then
    kill "$server_pid" 2>/dev/null || true
    wait "$server_pid" 2>/dev/null || true
    server_pid=
  fi
}

# start_server LOGFILE [OPTION...]: sets CCSLICE_SERVER, which the command line reads. Exits if the server doesn't start.
start_server() {
  local log=$1 tries
  : >"$log" # An earlier server's may be there.
  build/release/server/ccsliced --listen 127.0.0.1:0 "${@:2}" >"$log" 2>&1 &
  server_pid=$!
  for ((tries = 0; tries < 200; ++tries)); do
    CCSLICE_SERVER=$(sed -n 's/.* serves on \([^ ]*\): .*/\1/p' "$log")
    [[ -z $CCSLICE_SERVER ]] || break
    kill -0 "$server_pid" 2>/dev/null || break
    sleep 0.1
  done
  if [[ -z $CCSLICE_SERVER ]]; then
    cat "$log" >&2
    echo "$0: the server didn't start" >&2
    exit 1
  fi
  export CCSLICE_SERVER
}
