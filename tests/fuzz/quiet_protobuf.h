// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Protobuf has a line of its own for most of what a fuzzer makes up. Whoever includes this doesn't hear them.

#pragma once

#include <google/protobuf/stubs/logging.h>

namespace ccslice::fuzz {

inline google::protobuf::LogHandler* const kFormerLogHandler = google::protobuf::SetLogHandler(nullptr);

}  // namespace ccslice::fuzz
