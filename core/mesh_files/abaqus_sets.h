// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The element sets of an Abaqus input file [Abaqus, Element definition: grouping elements into element sets]. *ELSET
// lists elements and earlier sets, or with GENERATE first and last elements and steps; *ELEMENT names a set for its
// elements. A part's set holds its elements in every instance. The assembly's sets hold those of one instance, or name
// them as INSTANCE.SET and INSTANCE.NUMBER. *SOLID SECTION gives a set's elements a material. Names count whatever
// their case.

#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "core/mesh_files/abaqus_lines.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Whose elements a set's numbers are.
struct AbaqusScope {
  std::size_t part = 0;
  std::string instance;  // "": of all instances of the part.

  auto operator<=>(const AbaqusScope&) const = default;
};

/// A part's elements in the mesh.
struct PlacedElements {
  AbaqusScope scope;
  std::span<const std::uint64_t> numbers;  // Of the elements,
  std::uint32_t first_cell = 0;            // which are cells from this one on.
};

class AbaqusSets {
 public:
  /// The set of that name, a new one unless it has come before.
  std::size_t open(const AbaqusScope& scope, std::string_view name);
  /// The same for one that Abaqus made for itself: it isn't handed over, but others may name it.
  std::size_t open_internal(const AbaqusScope& scope, std::string_view name);
  void add(std::size_t set, std::uint64_t number);
  /// All elements of the instance.
  void add_instance(std::size_t set, std::string_view instance);
  /// A data line of *ELSET, whose numbers and names are those of `members`: the set's own scope, or an instance.
  void add_entries(std::size_t set, const AbaqusScope& members, bool generate, AbaqusLines& lines);

  /// The elements of the set are of that material.
  void add_section(const AbaqusScope& scope, std::string_view set, std::string_view material);

  /// What finish() couldn't hand over.
  struct LeftOut {
    std::vector<std::string> empty;    // Sets without cells.
    std::vector<std::string> unknown;  // Names in data lines, of sets that hadn't come there.
  };

  /// Hands over the sets that have cells, one for all of the same name, and the materials likewise. A set named in a
  /// data line or a section stands for all that the file puts into it. Throws Error{kMeshTooLarge} where sets repeat
  /// cells without end.
  LeftOut finish(const std::vector<PlacedElements>& placed, MeshFile& file);

 private:
  class Resolver;
  struct Range {
    std::uint64_t first = 0, last = 0, step = 1;
  };
  struct Member {
    std::size_t of;  // The set that it is added to.
    AbaqusScope scope{};
    std::string set{};  // A set's name in capitals; empty if elements are added.
    Range numbers{};    // Elements, if `set` is empty.
  };
  enum class Kind { kSet, kInternal, kMaterial };
  struct Set {
    std::string name;  // As written first.
    AbaqusScope scope;
    std::size_t first_member;  // Members from this one on may name it.
    Kind kind;
  };
  std::size_t open(const AbaqusScope& scope, std::string_view name, Kind kind);
  void add_number(std::size_t set, const AbaqusScope& scope, std::uint64_t number);

  /// The name is in capitals. Materials have names of their own.
  using Key = std::tuple<AbaqusScope, std::string, bool>;

  std::vector<Set> sets_;
  std::vector<Member> members_;  // Of all sets, in the order of the file.
  std::map<Key, std::size_t> index_;
};

}  // namespace ccslice
