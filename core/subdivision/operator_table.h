// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The operators of a solid, each once, by numbers. Numbers are given in the order in which rings are brought, whether
// operators were made ahead on several threads or not.

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "core/subdivision/key_hash.h"
#include "core/subdivision/make_operators.h"
#include "core/subdivision/operators.h"
#include "core/subdivision/ring.h"
#include "core/subdivision/surface_ring.h"

namespace ccslice {

class OperatorTable {
 public:
  /// The operator of a ring, made if it isn't known yet.
  std::uint32_t line(const LineRing& ring);
  std::uint32_t star(const VertexStar& star);
  /// `ring`: the walker's, of this cell in this frame.
  std::uint32_t corner(const VertexRing& ring, RingWalker& walker, CellId cell, const Frame& frame);
  std::uint32_t surface(const SurfaceRing& ring);
  /// The operator of a vertex cell with that star, whose ring has that corner operator.
  std::uint32_t vertex(std::uint32_t star, std::uint32_t corner, const VertexRing& ring);

  /// The operator of a ring, or kNone if it isn't known yet. While nothing else is called, on any thread.
  std::uint32_t find(const LineRing& ring) const { return found(line_index_, ring.key); }
  std::uint32_t find(const VertexRing& ring) const { return found(corner_index_, ring.key); }
  std::uint32_t find(const SurfaceRing& ring) const { return found(surface_index_, ring.key); }

  /// Notes that this operator will be asked for, unless it is known. REQUIRES: until make_wanted() has nothing left to
  /// make, the ring stays where it is, the cell in the complex of all walkers, and no operator is asked for.
  void want(const LineRing& ring);
  void want(const VertexStar& star);
  void want(const VertexRing& ring, CellId cell, const Frame& frame);
  void want(const SurfaceRing& ring);
  /// Makes some of what is wanted, and notes what they lead to. False if there is nothing to make.
  /// for_each(count, make): calls make(walker, i) for each i, on any threads, each of which has its own walker.
  template <typename ForEach>
  bool make_wanted(ForEach for_each);

  const std::vector<PlanarOperator>& lines() const { return lines_; }
  const std::vector<StarOperator>& stars() const { return stars_; }
  const std::vector<CornerOperator>& corners() const { return corners_; }
  const std::vector<VertexOperator>& vertices() const { return vertices_; }
  const std::vector<PlanarOperator>& surfaces() const { return surfaces_; }

  /// With those that were made ahead.
  std::size_t memory_bytes() const { return kept_bytes_ + key_bytes_ + ahead_bytes_; }
  /// What stays of memory_bytes() when keys are forgotten.
  std::size_t kept_bytes() const { return kept_bytes_; }
  /// Largest number of control points of any regular or line ring or of a line ring's children together (all layers
  /// counted), of a vertex cell's own, or of a ring on the surface.
  std::uint32_t max_ring_points() const;
  /// Forgets the keys by which equal rings meet. REQUIRES: no more operators are asked for, those made ahead have been.
  void forget_keys();

 private:
  static constexpr std::size_t kMadeTogether = 64;  // Some 1 MB.

  /// By key; nothing until it is made.
  template <typename Made>
  using AheadByKey = TableByKey<std::optional<Made>>;

  /// An operator to make ahead: what any thread may do, and what is left to do when its turn has come.
  struct Wanted {
    std::function<void(RingWalker&)> make;
    std::function<void()> note;
  };

  static std::uint32_t found(const TableByKey<std::uint32_t>& index, const NumberKey& key) {
    const auto known = index.find(key);
    return known == index.end() ? kNone : known->second;
  }
  template <typename Made, typename Make>
  Made take(AheadByKey<Made>& ahead, const NumberKey& key, Make make);
  template <typename Made, typename Make, typename LeadOn>
  void want(const TableByKey<std::uint32_t>& index, AheadByKey<Made>& ahead, const NumberKey& key, Make make,
            LeadOn lead_on);
  template <typename Ring>
  std::uint32_t planar(TableByKey<std::uint32_t>& index, std::vector<PlanarOperator>& operators,
                       AheadByKey<MadePlanar<Ring>>& ahead, const Ring& ring, MadePlanar<Ring> (*make)(const Ring&));
  /// `cells`: gives the neighbourhood that the ring is of.
  void want_corner(const VertexRing& ring, const std::function<NumberedCells(RingWalker&)>& cells);
  std::uint32_t corner_of(const VertexRing& ring, const std::function<NumberedCells()>& cells);
  bool lacks_corner(const NumberKey& key) const {
    return !corner_index_.contains(key) && !corners_ahead_.contains(key);
  }
  void add_bytes(std::size_t kept, std::size_t of_key) {
    kept_bytes_ += kept;
    key_bytes_ += of_key;
  }

  TableByKey<std::uint32_t> line_index_, star_index_, corner_index_, vertex_index_, surface_index_;
  std::vector<PlanarOperator> lines_, surfaces_;
  std::vector<StarOperator> stars_;
  std::vector<CornerOperator> corners_;
  std::vector<VertexOperator> vertices_;
  std::size_t kept_bytes_ = 0, key_bytes_ = 0;

  std::vector<Wanted> wanted_;
  AheadByKey<MadeLine> lines_ahead_;
  AheadByKey<StarOperator> stars_ahead_;
  AheadByKey<MadeCorner> corners_ahead_;
  AheadByKey<MadeSurface> surfaces_ahead_;
  std::size_t ahead_bytes_ = 0;
};

template <typename ForEach>
bool OperatorTable::make_wanted(ForEach for_each) {
  if (wanted_.empty()) return false;
  std::vector<Wanted> now;
  while (!wanted_.empty() && now.size() < kMadeTogether) {
    now.push_back(std::move(wanted_.back()));
    wanted_.pop_back();
  }
  for_each(now.size(), [&](RingWalker& walker, std::size_t i) { now[i].make(walker); });
  for (const Wanted& wanted : now) wanted.note();
  return true;
}

}  // namespace ccslice
