// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/operator_table.h"

#include <algorithm>
#include <memory>

namespace ccslice {

namespace {

constexpr std::size_t kKeyBytes = 64;  // What a key takes in a map besides its numbers.

std::size_t bytes_of(const NumberKey& key) { return key.capacity() * 4 + kKeyBytes; }

template <typename Operator>
std::size_t bytes_of(const Operator& op) {
  std::size_t bytes = sizeof(op) + op.stencils.memory_bytes();
  if constexpr (requires { op.rows; }) bytes += op.rows.capacity() * 4;
  if constexpr (requires { op.limit; }) bytes += op.limit.capacity() * 8;
  if constexpr (requires { op.carried; }) bytes += op.carried.capacity() * 4;
  return bytes;
}

/// `ring`: of a line or of a surface.
template <typename Ring>
std::size_t bytes_of_ring(const Ring& ring) {
  return 4 * (ring.points.capacity() + 4 * ring.quads.capacity() + ring.key.capacity());
}

std::size_t bytes_of_made(const StarOperator& made) { return bytes_of(made); }
template <typename Ring>
std::size_t bytes_of_made(const MadePlanar<Ring>& made) {
  return bytes_of(made.op) + bytes_of_ring(made.next);
}
std::size_t bytes_of_made(const MadeCorner& made) {
  std::size_t bytes = bytes_of(made.op) + sizeof(made) - sizeof(made.op);
  for (const LineRing& line : made.lines) bytes += bytes_of_ring(line);
  const VertexRing& next = made.next;
  bytes += 4 * (next.points.capacity() + next.shared.capacity() + 8 * next.cells.capacity() + next.key.capacity());
  return bytes + 4 * (made.next_cells.points.capacity() + 8 * made.next_cells.cells.capacity());
}

}  // namespace

/// What was made ahead, or else is made now.
template <typename Made, typename Make>
Made OperatorTable::take(AheadByKey<Made>& ahead, const NumberKey& key, Make make) {
  auto known = ahead.extract(key);
  if (known.empty()) return make();
  ahead_bytes_ -= bytes_of_made(*known.mapped()) + bytes_of(known.key());
  return std::move(*known.mapped());
}

template <typename Ring>
std::uint32_t OperatorTable::planar(TableByKey<std::uint32_t>& index, std::vector<PlanarOperator>& operators,
                                    AheadByKey<MadePlanar<Ring>>& ahead, const Ring& ring,
                                    MadePlanar<Ring> (*make)(const Ring&)) {
  const auto [known, fresh] = index.try_emplace(ring.key, static_cast<std::uint32_t>(operators.size()));
  const auto& [key, self] = *known;
  if (!fresh) return self;
  // It has its number before its children are looked at: the one at the irregular corner may have the same ring, and
  // leads here.
  operators.emplace_back();
  MadePlanar<Ring> made = take(ahead, key, [&] { return make(ring); });
  const std::uint32_t next = made.op.children[0].op = planar(index, operators, ahead, made.next, make);
  if (made.op.limit.empty()) made.op.limit = limit_through(operators[next].limit, made.op);
  add_bytes(bytes_of(made.op), bytes_of(key));
  operators[self] = std::move(made.op);
  return self;
}

std::uint32_t OperatorTable::line(const LineRing& ring) {
  return planar(line_index_, lines_, lines_ahead_, ring, make_line_operator);
}

std::uint32_t OperatorTable::surface(const SurfaceRing& ring) {
  return planar(surface_index_, surfaces_, surfaces_ahead_, ring, make_surface_operator);
}

std::uint32_t OperatorTable::star(const VertexStar& star) {
  const auto [known, fresh] = star_index_.try_emplace(star.key, static_cast<std::uint32_t>(stars_.size()));
  if (!fresh) return known->second;
  StarOperator op = take(stars_ahead_, known->first, [&] { return make_star_operator(star); });
  add_bytes(bytes_of(op), bytes_of(known->first));
  stars_.push_back(std::move(op));
  return known->second;
}

std::uint32_t OperatorTable::vertex(std::uint32_t star, std::uint32_t corner, const VertexRing& ring) {
  VertexOperator op{star, corner, ring.shared};
  NumberKey key{op.star, op.corner};
  key.insert(key.end(), op.shared.begin(), op.shared.end());
  const auto [known, fresh] = vertex_index_.try_emplace(std::move(key), static_cast<std::uint32_t>(vertices_.size()));
  if (!fresh) return known->second;
  add_bytes(sizeof(op) + op.shared.capacity() * 4, bytes_of(known->first));
  vertices_.push_back(std::move(op));
  return known->second;
}

std::uint32_t OperatorTable::corner(const VertexRing& ring, RingWalker& walker, CellId cell, const Frame& frame) {
  return corner_of(ring, [&] { return walker.neighbourhood(cell, frame); });
}

std::uint32_t OperatorTable::corner_of(const VertexRing& ring, const std::function<NumberedCells()>& cells) {
  const auto [known, fresh] = corner_index_.try_emplace(ring.key, static_cast<std::uint32_t>(corners_.size()));
  const auto& [key, self] = *known;
  if (!fresh) return self;
  corners_.emplace_back();
  MadeCorner made = take(corners_ahead_, key, [&] {
    return make_corner_operator(ring, cells(), [this](const NumberKey& next) { return lacks_corner(next); });
  });
  for (std::uint32_t c = 0; c < 8; ++c) {
    CornerOperator::Child& child = made.op.children[c];
    if (child.cell_class == CellClass::kLine) child.op = line(made.lines[c]);
    if (c == 0) child.op = corner_of(made.next, [&] { return made.next_cells; });
  }
  add_bytes(bytes_of(made.op), bytes_of(key));
  corners_[self] = std::move(made.op);
  return self;
}

/// make(walker): the operator; lead_on(made): what it leads to is wanted as well.
template <typename Made, typename Make, typename LeadOn>
void OperatorTable::want(const TableByKey<std::uint32_t>& index, AheadByKey<Made>& ahead, const NumberKey& key,
                         Make make, LeadOn lead_on) {
  if (index.contains(key)) return;
  const auto [place, fresh] = ahead.try_emplace(key);
  if (!fresh) return;
  auto* const entry = &*place;
  wanted_.push_back({[entry, make](RingWalker& walker) { entry->second.emplace(make(walker)); },
                     [this, entry, lead_on] {
                       ahead_bytes_ += bytes_of_made(*entry->second) + bytes_of(entry->first);
                       lead_on(*entry->second);
                     }});
}

void OperatorTable::want(const LineRing& ring) {
  want(
      line_index_, lines_ahead_, ring.key, [&ring](RingWalker&) { return make_line_operator(ring); },
      [this](const MadeLine& made) { want(made.next); });
}

void OperatorTable::want(const SurfaceRing& ring) {
  want(
      surface_index_, surfaces_ahead_, ring.key, [&ring](RingWalker&) { return make_surface_operator(ring); },
      [this](const MadeSurface& made) { want(made.next); });
}

void OperatorTable::want(const VertexStar& star) {
  want(
      star_index_, stars_ahead_, star.key, [&star](RingWalker&) { return make_star_operator(star); },
      [](const StarOperator&) {});
}

void OperatorTable::want(const VertexRing& ring, CellId cell, const Frame& frame) {
  want_corner(ring, [cell, frame](RingWalker& walker) { return walker.neighbourhood(cell, frame); });
}

void OperatorTable::want_corner(const VertexRing& ring, const std::function<NumberedCells(RingWalker&)>& cells) {
  const auto make = [this, &ring, cells](RingWalker& walker) {
    return make_corner_operator(ring, cells(walker), [this](const NumberKey& next) { return lacks_corner(next); });
  };
  want(corner_index_, corners_ahead_, ring.key, make, [this](const MadeCorner& made) {
    for (const LineRing& line : made.lines) {
      if (line.count > 0) want(line);
    }
    want_corner(made.next, [&made](RingWalker&) { return made.next_cells; });
  });
}

std::uint32_t OperatorTable::max_ring_points() const {
  std::uint32_t most = 64;
  for (const auto& op : lines_) most = std::max({most, 4 * op.points, 4 * op.stencils.rows()});
  for (const auto& op : corners_) {
    for (const auto& child : op.children) most = std::max(most, child.count);
  }
  for (const auto& op : surfaces_) most = std::max(most, op.points);
  return most;
}

void OperatorTable::forget_keys() {
  for (auto* index : {&line_index_, &star_index_, &corner_index_, &vertex_index_, &surface_index_}) *index = {};
  key_bytes_ = 0;
  wanted_ = {};
  lines_ahead_ = {};
  stars_ahead_ = {};
  corners_ahead_ = {};
  surfaces_ahead_ = {};
}

}  // namespace ccslice
