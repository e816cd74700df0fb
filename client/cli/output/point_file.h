// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files of points, x y z or x,y,z of each and # before comments, read block by block: they may be of any length, and
// pipes.

#pragma once

#include <cstddef>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh_import/text_scanner.h"

namespace ccslice::cli {

class PointFile {
 public:
  /// Throws Error{kFileUnreadable}.
  explicit PointFile(std::string path);

  /// x, y, z of the next points, `most_points` of them unless the file ends; nothing at its end. Throws
  /// Error{kFileUnreadable, kFileSyntax, kMeshNonFinite}, with the line, and UsageError for a point cut short.
  std::vector<double> next(std::size_t most_points);

 private:
  /// Whole lines. False at the end of the file.
  bool read_block();

  std::string path_;
  std::ifstream file_;
  std::string block_, rest_;  // The lines at hand; the begin of the line that comes after them.
  std::size_t line_ = 1;      // That of the block's end.
  std::optional<TextScanner> scanner_;
};

}  // namespace ccslice::cli
