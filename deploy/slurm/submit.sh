#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Has Slurm slice a job: an array of shares, and a join that waits for all of them (README.md).
#
#   submit.sh FOLDER MESH [--shares N] [--sbatch "OPTIONS OF sbatch"] -- OPTIONS OF ccslice slice
#
# The folder gets shares/I, logs, and layers, the result. All nodes have to see it, the mesh and ccslice; CCSLICE_SERVER
# and the other variables of ccslice go with the job. Prints the number of the last job: the one to wait for, or to make
# others depend on. After a failure the same command goes on with the shares that are there.

set -euo pipefail

fail() {
  echo "submit.sh: $*" >&2
  exit 2
}

[[ $# -ge 2 && $1 != -* && $2 != -* ]] || fail "FOLDER MESH [--shares N] [--sbatch OPTIONS] -- OPTIONS OF ccslice slice"
folder=$1 mesh=$2
shift 2
shares=4 of_sbatch=()
while [[ $# -gt 0 && $1 != -- ]]; do
  case $1 in
    --shares) shares=${2-} ;;
    --sbatch) read -ra of_sbatch <<<"${2-}" ;;
    *) fail "$1: options of ccslice slice stand behind --" ;;
  esac
  shift 2 || fail "$1 needs a value"
done
[[ ${1-} == -- ]] || fail "the options of ccslice slice stand behind --"
shift
[[ $shares =~ ^[1-9][0-9]{0,3}$ ]] || fail "--shares $shares: 1 to 9999"
[[ -f $mesh ]] || fail "$mesh is no mesh file"
[[ ! -e $folder/layers/manifest.json ]] || fail "$folder/layers is done; take another folder"
mesh=$(realpath -- "$mesh")
mkdir -p -- "$folder/shares" "$folder/logs"
folder=$(realpath -- "$folder")

# Exit codes 5 and 7 (no server, no room) may pass, so the share is tried again: --resume goes on with the layers that
# are there. Where a node is lost, Slurm has another one do it (--requeue).
# shellcheck disable=SC2016 # The job expands it.
readonly persist='
for attempt in $(seq 20); do
  "$@" && exit
  case $? in
    5 | 7) sleep 5 ;;
    *) exit 1 ;;
  esac
done
exit 1'

# batch <NAME> <COMMAND> <OPTION OF sbatch>...: queues it, and prints its number.
batch() {
  local name=$1 command=$2
  shift 2
  sbatch --parsable --job-name "ccslice-$name-$(basename -- "$folder")" --chdir "$folder" --requeue --open-mode append \
    "$@" ${of_sbatch[@]+"${of_sbatch[@]}"} --wrap "$command" | cut -d ';' -f 1
}

slice="set -- $(printf '%q ' ccslice slice "$mesh" "$@" --resume --quiet)"
if [[ $shares == 1 ]]; then
  batch slice "$slice -o layers$persist" --output logs/slice.log
  exit
fi
array=$(batch slice "$slice --share \"\$SLURM_ARRAY_TASK_ID/$shares\" -o \"shares/\$SLURM_ARRAY_TASK_ID\"$persist" \
  --array "1-$shares" --output "logs/share-%a.log")
join=$(printf 'shares/%d ' $(seq "$shares"))
batch join "ccslice join $join -o layers --quiet" --dependency "afterok:$array" --kill-on-invalid-dep yes \
  --output logs/join.log
