// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A control mesh prepared by the core, beside the oracle's own view of it. The two are tied together by numbering
// alone: limit cells come in the order of their control cells, a refined cell's children in the order of their corners,
// and a child's frame is known. Which cells the core refined is told from its counts; where a count leaves it open,
// from the limit position of a cell's centre.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "tests/support/brute_force.h"

namespace ccslice::oracle {

/// The largest errors met, positions relative to the box diagonal, channels relative to their range.
struct WorstError {
  double position = 0, channel = 0;
  std::string position_at, channel_at;
  std::size_t samples = 0;
};

class Subject {
 public:
  /// Validates (and so reorients) the mesh and prepares it.
  explicit Subject(ControlMesh mesh);

  const LimitSolid& solid() const { return *solid_; }
  std::shared_ptr<const LimitSolid> shared_solid() const { return solid_; }
  const ControlMesh& control() const { return control_; }
  const BruteMesh& brute() const { return brute_; }
  const BruteTopology& topology() const { return topology_; }
  double diagonal_mm() const { return diagonal_mm_; }

  /// The oracle's cell for a limit cell: the same box of the same root.
  const Ancestry& ancestry(std::uint32_t limit_cell) const { return matches().cells[limit_cell]; }
  /// Its one-ring, for evaluating and going on.
  OneRing one_ring(std::uint32_t limit_cell) const;
  /// The limit cell and parameter of a point of a cell of any refinement, `local` in that cell's frame. REQUIRES: the
  /// cell lies within a limit cell.
  CellParam locate(const Ancestry& cell, const Vec3& local) const;
  CellParam locate_corner(const Ancestry& cell, int corner_bits) const;
  /// The same where the cell may be larger than a limit cell: the first limit cell that has the point.
  CellParam locate_in_any(const Ancestry& cell, const Vec3& local) const;

  /// Compares geo and mat at a parameter with the oracle's limit there.
  void compare(LimitEvaluator& evaluator, const CellParam& at, const PointValue& expected, WorstError& worst) const;

 private:
  /// Whose cells the limit cells are.
  struct Matches {
    std::vector<Ancestry> cells;            // By limit cell.
    std::vector<std::uint32_t> first_cell;  // Of each control cell, and the end.
  };
  /// Found at first use, which takes as long as all else where cells aren't hexahedra: not every test asks for them.
  const Matches& matches() const;
  Matches match_limit_cells() const;
  void match_control_cell(std::uint32_t control_cell, std::uint32_t first, std::uint32_t count,
                          std::vector<Ancestry>& cells) const;
  void match_by_position(LimitEvaluator& evaluator, const OneRing& ring, std::uint32_t last, std::uint32_t& next,
                         std::vector<Ancestry>& cells) const;

  ControlMesh control_;
  std::shared_ptr<const LimitSolid> solid_;
  BruteMesh brute_;
  BruteTopology topology_;
  double diagonal_mm_ = 0;
  std::vector<double> channel_spans_;
  mutable std::optional<Matches> matches_;
};

/// Corner bits of a child of a hex at a level of an ancestry (0: the root's children).
int child_bits(const Ancestry& cell, int level);

std::string to_text(const CellParam& at);

}  // namespace ccslice::oracle
