// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/limit/cell_hulls.h"
#include "core/limit/cell_parts.h"
#include "core/limit/patch_path.h"
#include "core/limit/solid_data.h"
#include "core/prepare/prepare.h"

namespace ccslice {
namespace {

// Closest first. Smaller parts save no time: what these can't rule out is proved where it is asked for (part_trees.h).
constexpr std::array<PartSizes, 2> kSizes = {{{.levels = 2, .halvings = 1}, {.levels = 1, .halvings = 1}}};

/// Visits the cells near folds one after the other.
class CellsNearFolds {
 public:
  CellsNearFolds(const LimitSolid::Data& data, const CancellationToken& cancel)
      : data_(data), cancel_(cancel), builder_(data, kPositionDimension) {}

  std::size_t count_parts(const PartSizes& sizes) {
    std::size_t count = 0;
    PeriodicPoll poll(cancel_, kCancelPeriod);
    for (const LimitCellId c : cells()) {
      poll();
      if (is_near(c)) count += part_count(data_.cells[c], sizes, builder_);
    }
    return count;
  }

  CellHulls make_parts(const PartSizes& sizes, std::size_t count) {
    CellHulls parts(data_.cells.size(), count);
    PeriodicPoll poll(cancel_, kCancelPeriod);
    for (const LimitCellId c : cells()) {
      poll();
      parts.start_cell();
      if (is_near(c)) append_parts(data_.cell_maps[c], data_.cells[c], sizes, builder_, parts);
    }
    parts.finish();
    return parts;
  }

 private:
  static constexpr std::uint32_t kCancelPeriod = 256;

  IdRange<LimitCellId> cells() const { return IdRange<LimitCellId>(data_.cells.size()); }
  bool is_near(LimitCellId cell) const {
    return data_.fold_boxes.any_meeting(data_.cell_boxes.box(cell), [](std::uint32_t) { return true; });
  }

  const LimitSolid::Data& data_;
  const CancellationToken& cancel_;
  PatchBuilder builder_;
};

}  // namespace

void find_hulls_near_folds(std::size_t most_bytes, const CancellationToken& cancel, LimitSolid::Data& data) {
  if (data.fold_boxes.size() == 0) return;
  CellsNearFolds near(data, cancel);
  for (const PartSizes& sizes : kSizes) {
    const std::size_t count = near.count_parts(sizes);
    if (CellHulls::bytes_of(data.cells.size(), count) > most_bytes) continue;
    data.hulls_near_folds = near.make_parts(sizes, count);
    return;
  }
}

}  // namespace ccslice
