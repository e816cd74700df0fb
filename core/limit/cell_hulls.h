// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the cells near folds aren't: boxes of the parts of each cell, which hold it far more closely than its own box.
//
// Near folds every cell whose box holds a point has to be searched thoroughly, lest a lower cell holds it too. The
// parts of a cell, some ten or twenty, are boxes around pieces of its Bezier net, in the parameters that the cell's map
// guesses (CellMap), where cells are nearly cubes however they lie in space. A point in none of them isn't in the cell.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/types.h"

namespace ccslice {

class CellHulls {
 public:
  CellHulls() = default;
  /// With room for so many.
  CellHulls(std::size_t cells, std::size_t parts) {
    first_.reserve(cells + 1);
    parts_.reserve(parts);
  }

  /// What they take.
  static std::size_t bytes_of(std::size_t cells, std::size_t parts) {
    return (cells + 1) * sizeof(std::uint32_t) + parts * sizeof(Part);
  }

  /// False if the cell comes nowhere within `margin` (by axis) of the guess.
  bool may_hold(LimitCellId cell, const Vec3& guess, const Vec3& margin) const noexcept {
    if (first_.empty() || first_[cell] == first_[cell + 1]) return true;
    const Eigen::Array3f low = (guess - margin).cast<float>().array(), high = (guess + margin).cast<float>().array();
    for (std::uint32_t part = first_[cell]; part < first_[cell + 1]; ++part) {
      if ((parts_[part].min <= high).all() && (low <= parts_[part].max).all()) return true;
    }
    return false;
  }

  /// The next cell's, in parameters that its map guesses; none for cells of which nothing is known.
  void start_cell() { first_.push_back(static_cast<std::uint32_t>(parts_.size())); }
  void append(const Box3& part);
  /// After the last cell.
  void finish() { start_cell(); }
  std::size_t size() const { return parts_.size(); }
  std::size_t memory_bytes() const {
    return first_.capacity() * sizeof(std::uint32_t) + parts_.capacity() * sizeof(Part);
  }

 private:
  struct Part {
    Eigen::Array3f min, max;
  };
  std::vector<std::uint32_t> first_;  // By cell, and the end.
  std::vector<Part> parts_;
};

}  // namespace ccslice
