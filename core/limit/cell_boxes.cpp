// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <vector>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {

namespace {

constexpr std::uint32_t kCancelPeriod = 256;

/// Boxes of cells: the Bezier nets of the outermost patches, and the hull of what remains at the irregular place.
class CellBoxes {
 public:
  explicit CellBoxes(const LimitSolid::Data& data) : data_(data), builder_(data), grid_(64 * data.dimension) {}

  Box3 box(const LimitCell& cell) {
    box_ = Box3();
    if (cell.cell_class == CellClass::kRegular) {
      add_patch(cell, {});
    } else if (cell.cell_class == CellClass::kLine) {
      add_line(cell, {});
    } else {
      for (std::uint8_t child = 1; child < 8; ++child) {
        const bool line = data_.operators.vertices()[cell.op].children[child].cell_class == CellClass::kLine;
        const PatchPath path{0, child, 0, 0};
        line ? add_line(cell, path) : add_patch(cell, path);
      }
      box_.extend(builder_.remaining_box(cell, {}));
    }
    return box_;
  }

 private:
  void add_patch(const LimitCell& cell, const PatchPath& path) {
    builder_.build(cell, path, grid_.data());
    bspline_to_bezier(grid_.data(), 3, data_.dimension);
    for (std::size_t p = 0; p < 64; ++p) box_.extend(Vec3::Map(grid_.data() + p * data_.dimension).eval());
  }

  void add_line(const LimitCell& cell, PatchPath path) {
    for (path.line_child = 1; path.line_child < 4; ++path.line_child) add_patch(cell, path);
    path.line_child = 0;
    path.line_level = 1;
    box_.extend(builder_.remaining_box(cell, path));
  }

  const LimitSolid::Data& data_;
  PatchBuilder builder_;
  std::vector<double> grid_;
  Box3 box_;
};

}  // namespace

void build_cell_boxes(const CancellationToken& cancel, LimitSolid::Data& data) {
  CellBoxes boxes(data);
  std::vector<Box3> all;
  all.reserve(data.cells.size());
  for (const LimitCell& cell : data.cells) {
    if (all.size() % kCancelPeriod == 0) cancel.throw_if_cancelled();
    all.push_back(boxes.box(cell));
  }
  data.cell_boxes = BoxTree(all);
}

}  // namespace ccslice
