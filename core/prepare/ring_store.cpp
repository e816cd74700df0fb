// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/ring_store.h"

#include <algorithm>

#include "core/base/error.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kOwnPoints = 64;
constexpr std::size_t kKeyBytes = 80;  // What an order takes in a map besides its numbers.

}  // namespace

/// Rings are much of what is kept: growing, they would be there twice.
RingStore::RingStore(std::size_t points, LimitSolid::Data& data) : data_(data) {
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
  data_.cells[cell].ring_order = keep_order();
  cells_.push_back(cell);
}

std::uint32_t RingStore::keep_order() {
  const auto [known, fresh] = known_orders_.try_emplace(order_, static_cast<std::uint32_t>(data_.ring_orders.size()));
  if (fresh) {
    data_.ring_orders.insert(data_.ring_orders.end(), order_.begin(), order_.end());
    bytes_ += known->first.capacity() * sizeof(std::uint32_t) + kKeyBytes;
  }
  return known->second;
}

void RingStore::put_own(LimitCellId cell, std::uint32_t first) {
  order_.clear();
  for (std::uint32_t n = 0; n < kOwnPoints; ++n) order_.push_back(n);
  data_.cells[cell].ring_order = keep_order();
  data_.cells[cell].ring_begin = append_own(first, kOwnPoints);
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

std::uint32_t RingStore::begin_list(std::size_t count) const {
  if (data_.rings.size() + count >= kNone) {
    throw Error(
        ErrorCode::kMeshTooComplex,
        "cell_vertices: the one-rings of the limit-ready cells need more than 2^32 entries; split the part or use a "
        "coarser control mesh",
        "cell_vertices");
  }
  return static_cast<std::uint32_t>(data_.rings.size());
}

std::uint32_t RingStore::append_own(std::uint32_t first, std::uint32_t count) {
  const std::uint32_t begin = begin_list(count);
  for (std::uint32_t n = 0; n < count; ++n) data_.rings.push_back(first + n);
  return begin;
}

std::uint32_t RingStore::append(std::span<const VertexId> points) {
  const std::uint32_t begin = begin_list(points.size());
  for (const VertexId p : points) data_.rings.push_back(p == kNone ? kNone : level_->point(p));
  return begin;
}

}  // namespace ccslice
