// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/make_operators.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/base/error.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"

namespace ccslice {

namespace {

constexpr int kMaxLimitSteps = 2000;

[[noreturn]] void broken(const char* what) { throw Error(ErrorCode::kInternal, what); }

/// The rows of an operator's children. Each different point has one, made when all points are known.
class ChildRowMaker {
 public:
  /// `points`: of the refined complex.
  explicit ChildRowMaker(std::uint32_t points) : row_of_(points, kNone) {}

  /// Gives the next child these points of the refined complex; kNone has an empty row.
  ChildRows add(std::span<const VertexId> points, PhantomMask phantoms) {
    const ChildRows child{static_cast<std::uint32_t>(rows_.size()), static_cast<std::uint32_t>(points.size()), phantoms,
                          kNone};
    for (const VertexId p : points) {
      std::uint32_t& row = p == kNone ? empty_row_ : row_of_[p];
      if (row == kNone) {
        row = static_cast<std::uint32_t>(made_.size());
        made_.push_back(p);
      }
      rows_.push_back(row);
    }
    return child;
  }

  /// fill(point, row) gives a row what makes the point, by column. Sorted by their numbers of entries, rows are run
  /// through without a surprise at the end of each.
  template <typename Fill>
  void finish(Fill fill, ChildStencils& to) {
    std::vector<std::vector<std::pair<std::uint32_t, double>>> filled(made_.size());
    std::vector<std::uint32_t> order(made_.size()), place(made_.size());
    for (std::uint32_t r = 0; r < made_.size(); ++r) {
      order[r] = r;
      if (made_[r] != kNone) fill(made_[r], filled[r]);
      std::sort(filled[r].begin(), filled[r].end());
    }
    std::ranges::stable_sort(order, {}, [&](std::uint32_t r) { return filled[r].size(); });
    Stencils stencils;
    for (const std::uint32_t r : order) {
      place[r] = stencils.rows();
      stencils.append(filled[r]);
    }
    to.stencils = PackedStencils(stencils);
    to.rows.reserve(rows_.size());
    for (const std::uint32_t row : rows_) to.rows.push_back(place[row]);
  }

 private:
  std::vector<std::uint32_t> row_of_;  // By refined point; kNone if no child has it.
  std::uint32_t empty_row_ = kNone;
  std::vector<VertexId> made_;  // By row.
  std::vector<std::uint32_t> rows_;
};

/// Gives `to` a row, with every column c replaced by c % period. So the layers of an extruded ring are added up: what a
/// product of rules does with data that are constant along the line is the planar rule, as the other one's weights add
/// up to 1.
void fill_planar_row(const Stencils& from, std::uint32_t row, std::uint32_t period,
                     std::vector<std::pair<std::uint32_t, double>>& to) {
  for (std::uint32_t e = from.offsets[row]; e < from.offsets[row + 1]; ++e) {
    const std::uint32_t column = from.indices[e] % period;
    const auto known = std::find_if(to.begin(), to.end(), [&](const auto& entry) { return entry.first == column; });
    if (known == to.end()) {
      to.emplace_back(column, from.weights[e]);
    } else {
      known->second += from.weights[e];
    }
  }
}

/// row * (the chosen rows of the stencils).
std::vector<double> multiply(const std::vector<double>& row, const PackedStencils& stencils,
                             std::span<const std::uint32_t> chosen, std::uint32_t columns) {
  std::vector<double> result(columns, 0.0);
  for (std::size_t r = 0; r < row.size(); ++r) {
    stencils.for_each(chosen[r], [&](std::uint32_t column, double weight) { result[column] += row[r] * weight; });
  }
  return result;
}

/// e0 A A A ..., carried to convergence: the limit at point 0, where A is the chosen rows. After n steps point 0 is row
/// 0 of A^n times the control points, which tends to the limit, whether or not A can be diagonalized.
std::vector<double> limit_of_step(const PackedStencils& stencils, std::span<const std::uint32_t> chosen) {
  const auto points = static_cast<std::uint32_t>(chosen.size());
  std::vector<double> row(points, 0.0);
  row[0] = 1;
  for (int step = 0; step < kMaxLimitSteps; ++step) {
    std::vector<double> better = multiply(row, stencils, chosen, points);
    double change = 0;
    for (std::uint32_t i = 0; i < points; ++i) change = std::max(change, std::abs(better[i] - row[i]));
    row = std::move(better);
    if (change < 1e-17) break;
  }
  return row;
}

/// The 2-D ring in three layers of cells, so that refining the middle one sees the rules of the solid's inside.
CellComplex extrude(const LineRing& ring) {
  const std::uint32_t n = ring.count;
  std::vector<VertexId> corners;
  for (std::uint32_t layer = 0; layer < 3; ++layer) {
    for (const auto& quad : ring.quads) {
      for (std::uint32_t j = 0; j < 8; ++j) corners.emplace_back(quad[j & 3] + n * (layer + (j >> 2)));
    }
  }
  std::vector<std::array<std::uint32_t, 2>> sharp;
  for (std::uint32_t j = 0; j < 4; ++j) {
    if (!(ring.sharp_corners >> j & 1)) continue;
    for (std::uint32_t layer = 0; layer < 3; ++layer) {
      sharp.push_back({ring.quads[0][j] + n * layer, ring.quads[0][j] + n * (layer + 1)});
    }
  }
  return CellComplex(4 * n, std::vector<CellKind>(3 * ring.quads.size(), CellKind::kHex), std::move(corners), sharp,
                     {});
}

/// The surface ring as the outside (w = 1) of one layer of cells: the boundary rules see boundary faces only.
CellComplex thicken(const SurfaceRing& ring) {
  const auto n = static_cast<std::uint32_t>(ring.points.size());
  std::vector<VertexId> corners;
  for (const auto& quad : ring.quads) {
    for (std::uint32_t j = 0; j < 8; ++j) corners.emplace_back(quad[j & 3] + (j < 4 ? n : 0));
  }
  return CellComplex(2 * n, std::vector<CellKind>(ring.quads.size(), CellKind::kHex), std::move(corners),
                     ring.sharp_edges, ring.sharp_vertices);
}

CellComplex complex_of(const NumberedCells& ring) {
  std::vector<VertexId> corners;
  corners.reserve(8 * ring.cells.size());
  for (const auto& cell : ring.cells) {
    for (const std::uint32_t number : cell) corners.emplace_back(number);
  }
  return CellComplex(static_cast<std::uint32_t>(ring.points.size()),
                     std::vector<CellKind>(ring.cells.size(), CellKind::kHex), std::move(corners), ring.sharp_edges,
                     ring.sharp_vertices);
}

/// Rows of a corner operator from those of the whole neighbourhood. Points of the star one level on are columns of
/// their own, as the star's operator makes them. All others have to follow from points of the ring.
class CornerRows {
 public:
  /// `next`: the ring of children[0].
  CornerRows(const VertexRing& ring, const NumberedCells& all, const Refinement& refined, const VertexRing& next)
      : refined_(refined),
        next_(next),
        column_of_(all.points.size(), kNone),
        next_column_of_(refined.complex.vertex_count(), kNone) {
    for (std::uint32_t column = 0; column < ring.points.size(); ++column) {
      const auto at = std::find(all.points.begin(), all.points.end(), ring.points[column]);
      column_of_[static_cast<std::size_t>(at - all.points.begin())] = column;
    }
    for (std::uint32_t k = 0; k < next.shared.size(); ++k) {
      next_column_of_[next.points[k]] = static_cast<std::uint32_t>(ring.points.size()) + k;
    }
  }

  std::vector<std::uint32_t> carried(const CellComplex& complex) const {
    std::vector<std::uint32_t> towards;
    for (std::uint32_t k = 0; k < next_.shared.size(); ++k) {
      towards.push_back(column(seen_from(complex, refined_, next_.points[k], VertexId{0})));
    }
    return towards;
  }

  /// Gives `row` what makes a refined point.
  void fill(VertexId point, std::vector<std::pair<std::uint32_t, double>>& row) const {
    if (next_column_of_[point] != kNone) {
      row.emplace_back(next_column_of_[point], 1.0);
      return;
    }
    for (std::uint32_t e = refined_.stencils.offsets[point]; e < refined_.stencils.offsets[point + 1]; ++e) {
      row.emplace_back(column(refined_.stencils.indices[e]), refined_.stencils.weights[e]);
    }
  }

 private:
  std::uint32_t column(std::uint32_t point) const {
    if (column_of_[point] == kNone) broken("a vertex cell needs a point beyond its ring");
    return column_of_[point];
  }

  const Refinement& refined_;
  const VertexRing& next_;
  std::vector<std::uint32_t> column_of_;       // By point of the neighbourhood.
  std::vector<std::uint32_t> next_column_of_;  // By refined point.
};

}  // namespace

MadeLine make_line_operator(const LineRing& ring) {
  const CellComplex complex = extrude(ring);
  const CellId middle{static_cast<std::uint32_t>(ring.quads.size())};
  const Refinement refined = refine(complex, std::array{middle});
  Classifier classifier(refined.complex);
  RingWalker walker(refined.complex);
  ChildRowMaker rows(refined.complex.vertex_count());
  MadeLine made;
  PlanarOperator& op = made.op;
  op.points = ring.count;
  for (std::uint32_t c = 0; c < 4; ++c) {
    const CellId child{refined.first_child.front() + c};
    const auto found = classifier.classify(child);
    if (c == 0) {
      if (!found || found->cell_class != CellClass::kLine || found->anchor != 8) broken("a line cell lost its line");
      made.next = walker.line(child, {});
      // One of the child's four layers is enough, as they are alike: the one that lies in a layer of the parent's.
      op.children[0] = rows.add(std::span(made.next.points).subspan(made.next.count, made.next.count), 0);
    } else {
      if (!found || found->cell_class != CellClass::kRegular) broken("an outer child of a line cell isn't regular");
      const RegularRing regular = walker.regular(child);
      op.children[c] = rows.add(std::span(regular.points).subspan(16, 16), regular.phantoms & 15);
    }
  }
  rows.finish([&](VertexId p, auto& row) { fill_planar_row(refined.stencils, p, ring.count, row); }, op);
  if (made.next.key == ring.key) op.limit = limit_of_step(op.stencils, op.rows_of(op.children[0]));
  return made;
}

MadeSurface make_surface_operator(const SurfaceRing& ring) {
  const auto n = static_cast<std::uint32_t>(ring.points.size());
  const Refinement refined = refine(thicken(ring), std::array{CellId{0}});
  SurfaceWalker walker(refined.complex);
  ChildRowMaker rows(refined.complex.vertex_count());
  MadeSurface made;
  PlanarOperator& op = made.op;
  op.points = n;
  for (std::uint32_t c = 0; c < 4; ++c) {
    const CellId child{refined.first_child.front() + 4 + c};
    const FaceId face = face_of(refined.complex.cell_half_faces(child)[5]);
    // The child keeps the axes of the face: its vertex (0,0) is the child cell's corner 4.
    const auto cycle = refined.complex.face_vertices(face);
    const VertexId origin = refined.complex.cell_vertices(child)[4];
    const auto start = static_cast<std::uint8_t>(std::find(cycle.begin(), cycle.end(), origin) - cycle.begin());
    SurfaceRing next = c == 0 ? walker.irregular_ring(face, start) : walker.walk(face);
    if (c > 0 && (!next.regular || start != 0)) broken("an outer child of a boundary face isn't regular");
    op.children[c] = rows.add(next.points, next.phantoms);
    if (c == 0) made.next = std::move(next);
  }
  rows.finish([&](VertexId p, auto& row) { fill_planar_row(refined.stencils, p, 2 * n, row); }, op);
  for (std::uint32_t row = 0; row < op.stencils.rows(); ++row) {
    op.stencils.for_each(row, [n](std::uint32_t column, double) {
      if (column >= n) broken("a boundary rule reads a control point inside");
    });
  }
  if (made.next.key == ring.key) op.limit = limit_of_step(op.stencils, op.rows_of(op.children[0]));
  return made;
}

StarOperator make_star_operator(const VertexStar& star) {
  const CellComplex complex = complex_of(star);
  StarOperator op;
  op.points = complex.vertex_count();
  op.stencils = PackedStencils(refine_star(complex, VertexId{0}));
  std::vector<std::uint32_t> all_rows(op.points);
  std::iota(all_rows.begin(), all_rows.end(), 0u);
  op.limit = limit_of_step(op.stencils, all_rows);
  return op;
}

MadeCorner make_corner_operator(const VertexRing& ring, const NumberedCells& cells,
                                const std::function<bool(const NumberKey&)>& wants) {
  const CellComplex complex = complex_of(cells);
  const Refinement refined = refine(complex, std::array{CellId{0}});
  Classifier classifier(refined.complex);
  RingWalker walker(refined.complex);
  const CellId inner = refined.first_child.front();
  const VertexStar star = walker.star(inner, {});
  MadeCorner made;
  made.next = walker.vertex(inner, {}, star.points);
  if (wants(made.next.key)) made.next_cells = walker.neighbourhood(inner, {});
  const CornerRows corner_rows(ring, cells, refined, made.next);
  ChildRowMaker rows(refined.complex.vertex_count());
  CornerOperator& op = made.op;
  op.shared = static_cast<std::uint32_t>(ring.shared.size());
  op.own = static_cast<std::uint32_t>(ring.own().size());
  op.carried = corner_rows.carried(complex);
  for (std::uint32_t c = 0; c < 8; ++c) {
    const CellId cell{inner + c};
    const auto found = classifier.classify(cell);
    if (!found) broken("a child of a vertex cell isn't limit-ready");
    const bool moved = (found->cell_class == CellClass::kVertex) != (c == 0) || (c == 0 && found->anchor != 0);
    if (moved) broken("a vertex cell's irregular vertex moved");
    CornerOperator::Child& child = op.children[c];
    child.cell_class = found->cell_class;
    ChildRows& in_rows = child;
    if (c == 0) {
      in_rows = rows.add(made.next.own(), 0);
    } else if (found->cell_class == CellClass::kRegular) {
      const RegularRing regular = walker.regular(cell);
      in_rows = rows.add(regular.points, regular.phantoms);
    } else {
      child.frame = frame_at(cell_tables::kHexEdges[found->anchor][0], found->anchor / 4);
      LineRing& line = made.lines[c] = walker.line(cell, child.frame);
      child.layer_points = line.count;
      in_rows = rows.add(line.points, line.phantoms);
    }
  }
  rows.finish([&](VertexId p, auto& row) { corner_rows.fill(p, row); }, op);
  return made;
}

/// Subdividing moves no limit, so the row of the ring one level on, times the step there, is this one's.
std::vector<double> limit_through(const std::vector<double>& limit_of_next, const PlanarOperator& op) {
  if (limit_of_next.empty()) broken("operators lead to each other in a circle");
  return multiply(limit_of_next, op.stencils, op.rows_of(op.children[0]), op.points);
}

}  // namespace ccslice
