// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/operators.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/refine.h"

namespace ccslice {

namespace {

constexpr int kMaxLimitSteps = 2000;

[[noreturn]] void broken(const char* what) { throw Error(ErrorCode::kInternal, what); }

/// Appends to `to` the rows of `from` that belong to `points`, with every column c replaced by c % period; kNone is an
/// empty row.
void append_rows(const Stencils& from, std::span<const VertexId> points, std::uint32_t period, Stencils& to) {
  std::vector<std::pair<std::uint32_t, double>> row;
  for (const VertexId p : points) {
    row.clear();
    if (p != kNone) {
      for (std::uint32_t e = from.offsets[p]; e < from.offsets[p + 1]; ++e) {
        const std::uint32_t column = from.indices[e] % period;
        const auto known =
            std::find_if(row.begin(), row.end(), [&](const auto& entry) { return entry.first == column; });
        if (known == row.end()) {
          row.emplace_back(column, from.weights[e]);
        } else {
          known->second += from.weights[e];
        }
      }
      std::sort(row.begin(), row.end());
    }
    to.append(row);
  }
}

/// row * (rows [first, first + row.size()) of the stencils).
std::vector<double> multiply(const std::vector<double>& row, const Stencils& stencils, std::uint32_t first,
                             std::uint32_t columns) {
  std::vector<double> result(columns, 0.0);
  for (std::uint32_t r = 0; r < row.size(); ++r) {
    for (std::uint32_t e = stencils.offsets[first + r]; e < stencils.offsets[first + r + 1]; ++e) {
      result[stencils.indices[e]] += row[r] * stencils.weights[e];
    }
  }
  return result;
}

/// The limit row at the irregular corner, whose control point has number 0.
template <typename Operators>
std::vector<double> limit_row(const Operators& operators, std::uint32_t self) {
  const auto& op = operators[self];
  const ChildRows& next = op.children[0];
  if (next.op != self) {
    if (operators[next.op].limit.empty()) broken("operators lead to each other in a circle");
    return multiply(operators[next.op].limit, op.stencils, next.first_row, op.points);
  }
  std::vector<double> row(op.points, 0.0);
  row[0] = 1;
  for (int step = 0; step < kMaxLimitSteps; ++step) {
    std::vector<double> better = multiply(row, op.stencils, next.first_row, op.points);
    double change = 0;
    for (std::uint32_t i = 0; i < op.points; ++i) change = std::max(change, std::abs(better[i] - row[i]));
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

/// An operator with its key.
template <typename Operator>
std::size_t bytes_of(const Operator& op, const std::vector<std::uint32_t>& key) {
  return sizeof(op) + op.stencils.offsets.capacity() * 4 + op.stencils.indices.capacity() * 4 +
         op.stencils.weights.capacity() * 8 + op.limit.capacity() * 8 + key.capacity() * 4 + 64;
}

ChildRows rows_after(const Stencils& stencils, std::size_t count, PhantomMask phantoms) {
  return {stencils.rows(), static_cast<std::uint32_t>(count), phantoms, kNone};
}

}  // namespace

std::uint32_t OperatorTable::line(const LineRing& ring) {
  const auto [known, fresh] = line_index_.try_emplace(ring.key, static_cast<std::uint32_t>(lines_.size()));
  const std::uint32_t self = known->second;
  if (!fresh) return self;
  lines_.emplace_back();
  const CellComplex complex = extrude(ring);
  const CellId middle{static_cast<std::uint32_t>(ring.quads.size())};
  const Refinement refined = refine(complex, std::array{middle});
  Classifier classifier(refined.complex);
  RingWalker walker(refined.complex);
  PlanarOperator op;
  op.points = ring.count;
  for (std::uint32_t c = 0; c < 4; ++c) {
    const CellId child{refined.first_child.front() + c};
    const auto found = classifier.classify(child);
    if (c == 0) {
      if (!found || found->cell_class != CellClass::kLine || found->anchor != 8) broken("a line cell lost its line");
      const LineRing next = walker.line(child, {});
      op.children[0] = rows_after(op.stencils, next.count, 0);
      append_rows(refined.stencils, std::span(next.points).subspan(next.count, next.count), ring.count, op.stencils);
      op.children[0].op = line(next);
    } else {
      if (!found || found->cell_class != CellClass::kRegular) broken("an outer child of a line cell isn't regular");
      const RegularRing next = walker.regular(child);
      op.children[c] = rows_after(op.stencils, 16, next.phantoms & 15);
      append_rows(refined.stencils, std::span(next.points).subspan(16, 16), ring.count, op.stencils);
    }
  }
  lines_[self] = std::move(op);
  lines_[self].limit = limit_row(lines_, self);
  bytes_ += bytes_of(lines_[self], ring.key);
  return self;
}

std::uint32_t OperatorTable::surface(const SurfaceRing& ring) {
  const auto [known, fresh] = surface_index_.try_emplace(ring.key, static_cast<std::uint32_t>(surfaces_.size()));
  const std::uint32_t self = known->second;
  if (!fresh) return self;
  surfaces_.emplace_back();
  const auto n = static_cast<std::uint32_t>(ring.points.size());
  const Refinement refined = refine(thicken(ring), std::array{CellId{0}});
  SurfaceWalker walker(refined.complex);
  PlanarOperator op;
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
    op.children[c] = rows_after(op.stencils, next.points.size(), next.phantoms);
    append_rows(refined.stencils, next.points, 2 * n, op.stencils);
    if (c == 0) op.children[0].op = surface(next);
  }
  if (std::any_of(op.stencils.indices.begin(), op.stencils.indices.end(), [n](std::uint32_t i) { return i >= n; })) {
    broken("a boundary rule reads a control point inside");
  }
  surfaces_[self] = std::move(op);
  surfaces_[self].limit = limit_row(surfaces_, self);
  bytes_ += bytes_of(surfaces_[self], ring.key);
  return self;
}

std::uint32_t OperatorTable::vertex(const VertexRing& ring) {
  const auto [known, fresh] = vertex_index_.try_emplace(ring.key, static_cast<std::uint32_t>(vertices_.size()));
  const std::uint32_t self = known->second;
  if (!fresh) return self;
  vertices_.emplace_back();
  const auto n = static_cast<std::uint32_t>(ring.points.size());
  std::vector<VertexId> corners;
  for (const auto& cell : ring.cells) {
    for (const std::uint32_t number : cell) corners.emplace_back(number);
  }
  const CellComplex complex(n, std::vector<CellKind>(ring.cells.size(), CellKind::kHex), std::move(corners),
                            ring.sharp_edges, ring.sharp_vertices);
  const Refinement refined = refine(complex, std::array{CellId{0}});
  Classifier classifier(refined.complex);
  RingWalker walker(refined.complex);
  VertexOperator op;
  op.points = n;
  for (std::uint32_t c = 0; c < 8; ++c) {
    const CellId cell{refined.first_child.front() + c};
    const auto found = classifier.classify(cell);
    if (!found) broken("a child of a vertex cell isn't limit-ready");
    VertexOperator::Child& child = op.children[c];
    child.cell_class = found->cell_class;
    child.first_row = op.stencils.rows();
    if (found->cell_class == CellClass::kRegular) {
      const RegularRing next = walker.regular(cell);
      child.count = 64;
      child.phantoms = next.phantoms;
      append_rows(refined.stencils, next.points, n, op.stencils);
    } else if (found->cell_class == CellClass::kLine) {
      child.frame = frame_at(cell_tables::kHexEdges[found->anchor][0], found->anchor / 4);
      const LineRing next = walker.line(cell, child.frame);
      child.count = 4 * next.count;
      child.layer_points = next.count;
      child.phantoms = next.phantoms;
      append_rows(refined.stencils, next.points, n, op.stencils);
      child.op = line(next);
    } else {
      if (c != 0 || found->anchor != 0) broken("a vertex cell's irregular vertex moved");
      const VertexRing next = walker.vertex(cell, {});
      child.count = static_cast<std::uint32_t>(next.points.size());
      append_rows(refined.stencils, next.points, n, op.stencils);
      child.op = vertex(next);
    }
  }
  if (op.children[0].cell_class != CellClass::kVertex) broken("a vertex cell lost its irregular vertex");
  vertices_[self] = std::move(op);
  vertices_[self].limit = limit_row(vertices_, self);
  bytes_ += bytes_of(vertices_[self], ring.key);
  return self;
}

std::uint32_t OperatorTable::max_ring_points() const {
  std::uint32_t most = 64;
  for (const auto& op : lines_) most = std::max(most, 4 * op.points);
  for (const auto& op : vertices_) {
    most = std::max(most, op.points);
    for (const auto& child : op.children) most = std::max(most, child.count);
  }
  for (const auto& op : surfaces_) most = std::max(most, op.points);
  return most;
}

}  // namespace ccslice
