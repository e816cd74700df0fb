// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/subject.h"
#include "core/prepare/prepare_solid.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace ccslice::oracle {
namespace {

constexpr int kDeepestLimitCell = 4;

Ancestry hex_child(const Ancestry& cell, int bits) {
  Ancestry child = cell;
  child.level += 1;
  for (int d = 0; d < 3; ++d) child.ijk[d] = 2 * cell.ijk[d] + (bits >> d & 1);
  return child;
}

}  // namespace

Subject::Subject(ControlMesh mesh) : control_(std::move(mesh)) {
  validate(control_);
  solid_ = prepare_solid(control_);
  brute_ = to_brute_mesh(control_);
  topology_ = build_topology(brute_.cells, brute_.vertex_count());
  diagonal_mm_ = solid_->summary().bounding_box.diagonal().norm();
  for (std::size_t c = 0; c < control_.channel_count(); ++c) {
    double low = control_.channel_values[c], high = low;
    for (std::size_t v = 0; v < control_.vertex_count(); ++v) {
      const double value = control_.channel_values[v * control_.channel_count() + c];
      low = std::min(low, value);
      high = std::max(high, value);
    }
    channel_spans_.push_back(std::max(high - low, 1e-30));
  }
}

const Subject::Matches& Subject::matches() const {
  if (!matches_) matches_ = match_limit_cells();
  return *matches_;
}

Subject::Matches Subject::match_limit_cells() const {
  Matches matches;
  matches.cells.resize(solid_->cell_count());
  std::uint32_t next = 0;
  for (std::uint32_t c = 0; c < control_.cell_count(); ++c) {
    const std::uint32_t first = next;
    while (next < solid_->cell_count() && solid_->control_cell(LimitCellId{next}) == c) ++next;
    matches.first_cell.push_back(first);
    match_control_cell(c, first, next - first, matches.cells);
  }
  matches.first_cell.push_back(next);
  if (next != solid_->cell_count()) throw std::runtime_error("limit cells aren't in the order of their control cells");
  return matches;
}

void Subject::match_control_cell(std::uint32_t control_cell, std::uint32_t first, std::uint32_t count,
                                 std::vector<Ancestry>& cells) const {
  Ancestry root;
  root.control_cell = control_cell;
  const bool hex = control_.cell_kinds[control_cell] == CellKind::kHex;
  const auto corners = static_cast<std::uint32_t>(corner_count(control_.cell_kinds[control_cell]));
  if (hex && count == 1) {
    cells[first] = root;
  } else if (count == corners) {
    for (std::uint32_t i = 0; i < count; ++i) {
      cells[first + i] = hex ? hex_child(root, static_cast<int>(i)) : root;
      if (!hex) cells[first + i].child = static_cast<int>(i);
    }
  } else {
    LimitEvaluator evaluator(*solid_);
    std::uint32_t next = first;
    match_by_position(evaluator, OneRing(brute_, topology_, control_cell), first + count, next, cells);
    if (next != first + count)
      throw std::runtime_error("too many limit cells in control cell " + std::to_string(control_cell));
  }
}

void Subject::match_by_position(LimitEvaluator& evaluator, const OneRing& ring, std::uint32_t last, std::uint32_t& next,
                                std::vector<Ancestry>& cells) const {
  const BruteCell& cell = ring.focus();
  if (cell.kind == CellKind::kHex && next < last) {
    const Vec3 centre = ring.limit_at_centre().head<3>();
    if ((evaluator.geo({LimitCellId{next}, Vec3::Constant(0.5)}) - centre).norm() < 1e-7 * diagonal_mm_) {
      cells[next++] = cell.from;
      return;
    }
  }
  if (next >= last || cell.from.level >= kDeepestLimitCell) {
    throw std::runtime_error("limit cells of control cell " + std::to_string(cell.from.control_cell) +
                             " don't match any refinement of it");
  }
  for (int i = 0; i < corner_count(cell.kind); ++i) match_by_position(evaluator, ring.child(i), last, next, cells);
}

OneRing Subject::one_ring(std::uint32_t limit_cell) const {
  const Ancestry& at = ancestry(limit_cell);
  OneRing ring(brute_, topology_, at.control_cell);
  if (at.child >= 0) ring = ring.child(at.child);
  for (int level = 0; level < at.level; ++level) ring = ring.child(child_bits(at, level));
  return ring;
}

CellParam Subject::locate(const Ancestry& cell, const Vec3& local) const {
  const std::vector<std::uint32_t>& first = matches().first_cell;
  for (std::uint32_t i = first[cell.control_cell]; i < first[cell.control_cell + 1]; ++i) {
    const Ancestry& limit = ancestry(i);
    const int below = cell.level - limit.level;
    if (limit.child != cell.child || below < 0) continue;
    bool within = true;
    CellParam at{LimitCellId{i}, Vec3::Zero()};
    for (int d = 0; d < 3; ++d) {
      within = within && cell.ijk[d] >> below == limit.ijk[d];
      at.uvw[d] = std::ldexp(cell.ijk[d] - std::ldexp(limit.ijk[d], below) + local[d], -below);
    }
    if (within) return at;
  }
  throw std::runtime_error("no limit cell there");
}

CellParam Subject::locate_in_any(const Ancestry& cell, const Vec3& local) const {
  const std::vector<std::uint32_t>& first = matches().first_cell;
  for (std::uint32_t i = first[cell.control_cell]; i < first[cell.control_cell + 1]; ++i) {
    const Ancestry& limit = ancestry(i);
    if (limit.child != cell.child) continue;
    CellParam at{LimitCellId{i}, Vec3::Zero()};
    for (int d = 0; d < 3; ++d) {
      at.uvw[d] = std::ldexp(cell.ijk[d] + local[d], limit.level - cell.level) - limit.ijk[d];
    }
    if (at.uvw.minCoeff() >= 0 && at.uvw.maxCoeff() <= 1) return at;
  }
  throw std::runtime_error("no limit cell there");
}

CellParam Subject::locate_corner(const Ancestry& cell, int bits) const {
  return locate(cell, Vec3(bits & 1, bits >> 1 & 1, bits >> 2 & 1));
}

void Subject::compare(LimitEvaluator& evaluator, const CellParam& at, const PointValue& expected,
                      WorstError& worst) const {
  ++worst.samples;
  const double error = (evaluator.geo(at) - expected.head<3>()).norm() / diagonal_mm_;
  if (!(error <= worst.position)) {
    worst.position = error;
    worst.position_at = to_text(at);
  }
  std::array<double, kMaxStride> channels{};
  const std::size_t count = channel_spans_.size();
  evaluator.mat(at, {channels.data(), count});
  for (std::size_t c = 0; c < count; ++c) {
    const double channel_error = std::abs(channels[c] - expected[3 + static_cast<int>(c)]) / channel_spans_[c];
    if (!(channel_error <= worst.channel)) {
      worst.channel = channel_error;
      worst.channel_at = to_text(at);
    }
  }
}

int child_bits(const Ancestry& cell, int level) {
  int bits = 0;
  for (int d = 0; d < 3; ++d) bits |= static_cast<int>(cell.ijk[d] >> (cell.level - 1 - level) & 1) << d;
  return bits;
}

std::string to_text(const CellParam& at) {
  std::ostringstream text;
  text.precision(17);
  text << "cell " << at.cell << " uvw " << at.uvw.transpose();
  return text.str();
}

}  // namespace ccslice::oracle
