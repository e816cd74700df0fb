// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

namespace ccslice::bench {

/// Draws a PNG with gnuplot (group `bench` of deploy/install.sh). `commands`: all but terminal and output. Throws
/// std::runtime_error.
void plot_png(const std::string& path, int width, int height, const std::string& commands);

}  // namespace ccslice::bench
