// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What programs say of themselves. cmake/version.sh makes it of the git tag; programs that ask link ccslice_version.

#pragma once

namespace ccslice {

/// Such as "1.2.0", or "1.2.0+12.g1a2b3c4" 12 commits after that.
extern const char* const kVersion;

}  // namespace ccslice
