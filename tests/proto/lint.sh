#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Lints the contract with buf, which it installs under this folder when it is missing, and compares it with the latest
# release before this commit: from 1.0 on the contract only grows.

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

buf=node_modules/@bufbuild/buf-linux-x64/bin/buf
if [[ ! -x $buf || package-lock.json -nt $buf ]]; then
  npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
  touch $buf
fi
$buf lint ../../proto
release=$(git describe --tags --abbrev=0 --match 'v[1-9]*' 2>/dev/null) || release=
if [[ -n $release ]]; then
  $buf breaking ../../proto --against "$(git rev-parse --path-format=absolute --git-common-dir)#tag=$release,subdir=proto"
fi
echo "proto: no findings${release:+; nothing that $release has is broken}"
