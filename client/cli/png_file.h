// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Colour pictures as PNG files (ISO/IEC 15948), 8 bits a component.

#pragma once

#include <string>

#include "client/cli/picture.h"

namespace ccslice::cli {

/// The bytes of a PNG file: every row filtered by the difference to the one above it, which suits drawn pictures.
std::string to_png(const Picture& picture);

}  // namespace ccslice::cli
