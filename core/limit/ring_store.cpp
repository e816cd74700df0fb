// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/ring_store.h"

#include <algorithm>

#include "core/base/error.h"

namespace ccslice {
namespace {

// Of nearly all, or fewer. The children of a regular cell have 5 x 5 x 5.
constexpr std::size_t kCellPoints = 64, kFamilyPoints = 160, kFacePoints = 16;
constexpr std::size_t kKeyBytes = 80;  // What an order takes in a map besides its numbers.

}  // namespace

/// Rings are much of what is kept: growing, they would be there twice.
RingStore::RingStore(std::size_t cells, std::size_t families, std::size_t faces, LimitSolid::Data& data) : data_(data) {
  const std::size_t points = kCellPoints * cells + kFamilyPoints * families + kFacePoints * faces;
  data_.rings.reserve(std::min<std::size_t>(points, kNone));
}

void RingStore::enter(const Level& level) {
  level_ = &level;
  places_.assign(level.complex.vertex_count(), kNone);
}

std::uint32_t RingStore::place_of(VertexId point) {
  std::uint32_t& place = point == kNone ? phantom_place_ : places_[point];
  if (place == kNone) {
    place = static_cast<std::uint32_t>(points_.size());
    points_.push_back(point);
  }
  return place;
}

void RingStore::put(LimitCellId cell, std::span<const VertexId> ring) {
  order_.clear();
  for (const VertexId p : ring) order_.push_back(place_of(p));
  const auto [known, fresh] = known_orders_.try_emplace(order_, static_cast<std::uint32_t>(data_.ring_orders.size()));
  if (fresh) {
    data_.ring_orders.insert(data_.ring_orders.end(), order_.begin(), order_.end());
    bytes_ += known->first.capacity() * sizeof(std::uint32_t) + kKeyBytes;
  }
  data_.cells[cell].ring_order = known->second;
  cells_.push_back(cell);
}

void RingStore::end_family() {
  if (cells_.empty()) return;
  const std::uint32_t begin = append(points_);
  for (const LimitCellId cell : cells_) data_.cells[cell].ring_begin = begin;
  for (const VertexId p : points_) {
    if (p != kNone) places_[p] = kNone;
  }
  phantom_place_ = kNone;
  points_.clear();
  cells_.clear();
}

std::uint32_t RingStore::append(std::span<const VertexId> points) {
  if (data_.rings.size() + points.size() >= kNone) {
    throw Error(
        ErrorCode::kMeshTooComplex,
        "cell_vertices: the one-rings of the limit-ready cells need more than 2^32 entries; split the part or use a "
        "coarser control mesh",
        "cell_vertices");
  }
  const auto begin = static_cast<std::uint32_t>(data_.rings.size());
  for (const VertexId p : points) data_.rings.push_back(p == kNone ? kNone : level_->point(p));
  return begin;
}

}  // namespace ccslice
