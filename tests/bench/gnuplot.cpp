// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/gnuplot.h"

#include <cstdio>
#include <stdexcept>

namespace ccslice::bench {

void plot_png(const std::string& path, int width, int height, const std::string& commands) {
  if (path.find_first_of("'\n") != std::string::npos) throw std::runtime_error(path + ": can't be quoted for gnuplot");
  std::FILE* gnuplot = popen("gnuplot", "w");
  if (!gnuplot) throw std::runtime_error("can't start gnuplot");
  const std::string text = "set terminal pngcairo size " + std::to_string(width) + "," + std::to_string(height) +
                           " noenhanced\nset output '" + path + "'\n" + commands;
  const bool written = std::fputs(text.c_str(), gnuplot) >= 0;
  if (pclose(gnuplot) != 0 || !written) {
    throw std::runtime_error("gnuplot didn't draw " + path + " (deploy/install.sh bench installs it)");
  }
}

}  // namespace ccslice::bench
