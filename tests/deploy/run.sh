#!/usr/bin/env bash
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Runs what deploy/ ships with the real programs, all of them from Debian and on loopback: installs and builds what is
# missing. Arguments go to run.py: tests/deploy/run.sh --parts rolling --long

set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

deploy/install.sh build test
cmake --preset release
cmake --build --preset release --parallel "$(nproc)" --target ccsliced ccslice
exec tests/deploy/run.py build/release/server/ccsliced build/release/client/ccslice "$@"
