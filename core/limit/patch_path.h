// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a parameter lies in the tree of regular patches that tiles an irregular cell [Luu19, 3; after Stam].
//
// A line cell: level n from max(u,v), then one of three patches over [2^-(n+1), 2^-n]-sized boxes, full length along the line.
// A vertex cell: level n from max(u,v,w), then one of seven sub-cells, which is a patch or a line cell in turn. u = 1/2
// belongs to the outer sub-cell.

#pragma once

#include <array>
#include <cstdint>

#include "core/base/types.h"
#include "core/limit/solid_data.h"

namespace ccslice {

/// Deepest level told apart. Below it (parameters under 2^-kMaxPatchLevel) positions and channels come from limit rows.
inline constexpr int kMaxPatchLevel = 40;

struct PatchPath {
  std::uint8_t level = 0;       // Vertex cells: levels descended at the irregular corner.
  std::uint8_t child = 0;       // Vertex cells: the outer sub-cell (1 to 7).
  std::uint8_t line_level = 0;  // Line cells and line sub-cells.
  std::uint8_t line_child = 0;  // Likewise: 1 to 3, or 0 in regular sub-cells.

  std::uint32_t packed() const {
    return static_cast<std::uint32_t>(level) | static_cast<std::uint32_t>(child) << 8 |
           static_cast<std::uint32_t>(line_level) << 16 | static_cast<std::uint32_t>(line_child) << 24;
  }
};

/// A patch, the parameter within it, and how its parameters depend on the cell's: local a = factor[a] * cell axis[a] + const.
struct PatchPlace {
  PatchPath path;
  Vec3 local;
  std::array<std::uint8_t, 3> axis;
  Vec3 factor;
  bool at_vertex = false;  // Within 2^-kMaxPatchLevel of the irregular vertex ...
  bool at_line = false;    // ... or of the irregular line: `local`'s third coordinate still counts.
};

PatchPlace find_patch(const LimitSolid::Data& data, const LimitCell& cell, const Vec3& uvw) noexcept;

/// Walks the operators and writes the patch's 4 x 4 x 4 grid (phantoms filled) of `dimension` doubles a point.
class PatchBuilder {
 public:
  explicit PatchBuilder(const LimitSolid::Data& data);

  /// REQUIRES: `grid` holds 64 * dimension doubles.
  void build(const LimitCell& cell, const PatchPath& path, double* grid) noexcept;
  /// Box of the control points that remain after path.level (and then path.line_level) levels: it holds the limit of
  /// what remains at the irregular vertex or line. `path.child` 0 means the vertex itself.
  Box3 remaining_box(const LimitCell& cell, const PatchPath& path) noexcept;
  /// The limit at the irregular vertex of a vertex cell: `dimension` doubles.
  void limit_at_vertex(const LimitCell& cell, double* out) noexcept;
  /// The limit at w on the irregular line of a line cell, or of the line sub-cell at the path.
  void limit_at_line(const LimitCell& cell, const PatchPath& path, double w, double* out) noexcept;

 private:
  struct Layers {
    double* points;
    std::uint32_t op;
  };
  void gather(std::span<const std::uint32_t> ring, double* out) const noexcept;
  Box3 box_of(std::size_t points) const noexcept;
  /// The sub-cell of a vertex cell: fills `a_` with its grid or layers.
  const VertexOperator::Child& descend_vertex(const LimitCell& cell, const PatchPath& path) noexcept;
  void fill_layers(std::uint32_t layer_points, PhantomMask phantoms) noexcept;
  std::uint32_t descend_line(std::uint32_t op, int levels) noexcept;
  void finish_line(std::uint32_t op, std::uint8_t child, double* grid) noexcept;
  /// Loads the four layers of a line cell or sub-cell into `a_`; returns its operator.
  std::uint32_t load_line(const LimitCell& cell, const PatchPath& path) noexcept;

  const LimitSolid::Data& data_;
  std::size_t dimension_;
  std::vector<double> a_, b_;  // Ring points, ping and pong.
};

}  // namespace ccslice
