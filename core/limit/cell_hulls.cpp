// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_hulls.h"

#include <vector>

#include "core/limit/cell_parts.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {
namespace {

constexpr float kFloatRounding = 1e-5F;  // Rounding of floats near 1, with room.
constexpr std::uint32_t kCancelPeriod = 256;

/// Empty if there would be too many.
CellHulls hulls_near(const LimitSolid::Data& data, const std::vector<bool>& near, int halvings,
                     const CancellationToken& cancel) {
  const std::size_t most = CellHulls::kMost + CellHulls::kMostPerCell * data.cells.size();
  PatchBuilder builder(data, kPositionDimension);
  CellHulls parts;
  for (const LimitCellId c : IdRange<LimitCellId>(data.cells.size())) {
    if (c % kCancelPeriod == 0) cancel.throw_if_cancelled();
    parts.start_cell();
    if (near[c]) append_parts(data.cell_maps[c], data.cells[c], {.halvings = halvings}, builder, parts);
    if (parts.size() > most) return {};
  }
  parts.finish();
  return parts;
}

}  // namespace

void CellHulls::append(const Box3& part) {
  parts_.push_back({part.min().cast<float>().array() - kFloatRounding * (1 + part.min().cast<float>().array().abs()),
                    part.max().cast<float>().array() + kFloatRounding * (1 + part.max().cast<float>().array().abs())});
}

void CellHulls::finish() {
  start_cell();
  parts_.shrink_to_fit();
}

void find_hulls_near_folds(const CancellationToken& cancel, LimitSolid::Data& data) {
  if (data.fold_boxes.size() == 0) return;
  std::vector<bool> near;
  for (const LimitCellId c : IdRange<LimitCellId>(data.cells.size())) {
    near.push_back(data.fold_boxes.any_meeting(data.cell_boxes.box(c), [](std::uint32_t) { return true; }));
  }
  for (int halvings = 2; halvings > 0 && data.hulls_near_folds.size() == 0; --halvings) {
    data.hulls_near_folds = hulls_near(data, near, halvings, cancel);
  }
}

}  // namespace ccslice
