#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Lints the contract with buf, which it installs under this folder when it is missing.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

buf=node_modules/@bufbuild/buf-linux-x64/bin/buf
if [[ ! -x $buf || package-lock.json -nt $buf ]]; then
  npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
  touch $buf
fi
$buf lint ../../proto
echo "proto: no findings"
