// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Numbers that know what they number. A function that takes a cell, a corner and a vertex takes three integers; with
// bare ones the compiler accepts them in any order. Here a vertex's number is a VertexId, and neither a bare number nor
// the id of anything else becomes one unless its type is written: VertexId{n}. An id reads as its number, so it indexes
// arrays and goes into messages as it is. Nothing of this is left at run time.
//
// Where a number is the contract's, in errors, and in a control mesh's own arrays and what is reported of them, it
// stays a bare one: whoever reads it there names what it is.

#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace ccslice {

/// The number of one thing among those of its `Kind`, a type that needs no definition.
template <typename Kind>
class Id {
 public:
  constexpr Id() = default;
  constexpr explicit Id(std::uint32_t number) : number_(number) {}
  constexpr operator std::uint32_t() const { return number_; }  // NOLINT(google-explicit-constructor): on purpose.
  friend constexpr auto operator<=>(Id, Id) = default;
  /// So many ids on, for loops that skip some.
  constexpr Id& operator+=(std::uint32_t step) {
    number_ += step;
    return *this;
  }

 private:
  std::uint32_t number_ = 0;
};

/// Ids of different kinds have nothing to compare.
template <typename Kind, typename Other>
requires(!std::is_same_v<Kind, Other>) bool operator==(Id<Kind>, Id<Other>) = delete;

// Ids in a cell complex, at any level of refinement.
using VertexId = Id<struct VertexKind>;
using EdgeId = Id<struct EdgeKind>;
using FaceId = Id<struct FaceKind>;
using HalfFaceId = Id<struct HalfFaceKind>;  // 2 * face + side.
using CellId = Id<struct ComplexCellKind>;

/// A cell of the control mesh, as a limit-ready cell remembers it.
using ControlCellId = Id<struct ControlCellKind>;

// Ids in a prepared solid.
using LimitCellId = Id<struct LimitCellKind>;
using BoundaryFaceId = Id<struct BoundaryFaceKind>;  // In BoundarySurface::faces_and_interfaces().

/// Some of a printing's materials: bit m stands for material m.
using MaterialSet = std::uint32_t;

/// The ids 0 to count - 1, or begin to end - 1, in order.
template <typename Id>
class IdRange {
 public:
  class Iterator {
   public:
    constexpr explicit Iterator(std::uint32_t number) : number_(number) {}
    constexpr Id operator*() const { return Id{number_}; }
    constexpr Iterator& operator++() {
      ++number_;
      return *this;
    }
    friend constexpr bool operator==(Iterator, Iterator) = default;

   private:
    std::uint32_t number_;
  };

  constexpr explicit IdRange(std::size_t count) : end_(static_cast<std::uint32_t>(count)) {}
  constexpr IdRange(Id begin, Id end) : begin_(begin), end_(end) {}
  constexpr Iterator begin() const { return Iterator{begin_}; }
  constexpr Iterator end() const { return Iterator{end_}; }
  constexpr std::uint32_t size() const { return end_ - begin_; }
  std::vector<Id> to_vector() const {
    std::vector<Id> ids;
    ids.reserve(size());
    for (const Id id : *this) ids.push_back(id);
    return ids;
  }

 private:
  std::uint32_t begin_ = 0, end_;
};

}  // namespace ccslice
