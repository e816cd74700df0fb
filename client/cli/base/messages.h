// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Documents and files of the command line (proto/ccslice/cli/v1) beside the contract's messages: in ccslice::cli, v1
// has the names of both packages, which differ.

#pragma once

#include "ccslice/cli/v1/documents.pb.h"
#include "ccslice/cli/v1/output.pb.h"

namespace ccslice::cli::v1 {

using namespace ::ccslice::v1;

}  // namespace ccslice::cli::v1
