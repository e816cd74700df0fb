// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/point_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "client/cli/base/text_values.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr std::size_t kBlockBytes = 256 << 10;
constexpr std::size_t kMostLineBytes = 1 << 20;

}  // namespace

PointFile::PointFile(std::string path) : path_(std::move(path)), file_(path_, std::ios::binary) {
  std::error_code status;
  if (std::filesystem::is_directory(path_, status)) {
    throw Error(ErrorCode::kFileUnreadable, path_ + " is a folder, not a file");
  }
  if (!file_) throw Error(ErrorCode::kFileUnreadable, "cannot open " + path_ + ": " + std::strerror(errno));
}

bool PointFile::read_block() {
  block_ = std::move(rest_);
  rest_.clear();
  for (;;) {
    const std::size_t before = block_.size();
    block_.resize(before + kBlockBytes);
    file_.read(block_.data() + before, kBlockBytes);
    block_.resize(before + static_cast<std::size_t>(file_.gcount()));
    if (file_.bad()) throw Error(ErrorCode::kFileUnreadable, "cannot read " + path_ + ": " + std::strerror(errno));
    if (!file_) break;  // What is left is the last line.
    const std::size_t end = block_.rfind('\n');
    if (end != std::string::npos) {
      rest_ = block_.substr(end + 1);
      block_.resize(end + 1);
      break;
    }
    if (block_.size() > kMostLineBytes) {
      throw Error(ErrorCode::kFileSyntax, "line " + std::to_string(line_) + " has more than " +
                                              std::to_string(kMostLineBytes) + " bytes: give each point a line");
    }
  }
  std::ranges::replace(block_, ',', ' ');
  scanner_.emplace(block_);
  scanner_->start_at_line(line_);
  line_ += static_cast<std::size_t>(std::ranges::count(block_, '\n'));
  return !block_.empty();
}

std::vector<double> PointFile::next(std::size_t most_points) {
  std::vector<double> points;
  while (points.size() < 3 * most_points) {
    if (scanner_ && !scanner_->at_end()) {
      points.push_back(scanner_->real("a coordinate"));
    } else if (!read_block()) {
      break;
    }
  }
  if (points.size() % 3 != 0) throw UsageError(path_ + " must hold three coordinates a point");
  return points;
}

}  // namespace ccslice::cli
