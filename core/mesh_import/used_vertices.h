// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files have vertices that no cell uses: centres of arcs, reference points, nodes of second order, points that a filter
// left behind. A solid has none, so readers leave them out. Whatever numbers such a vertex has do no harm.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {

/// Numbers that a vertex can't have, with their places in the file: NaN, infinite, too large for a float.
class UnfitNumbers {
 public:
  /// A coordinate of `vertex` that `scanner` has just read, passed through. `what` says what it is.
  double coordinate(double value, std::size_t vertex, std::string_view what, const TextScanner& scanner);
  /// A channel's value of `vertex`, likewise.
  float value(double value, std::size_t vertex, std::string_view what, const TextScanner& scanner);
  /// The same for files that no TextScanner reads.
  float value(double value, std::size_t vertex, std::string_view what, std::uint64_t mark, std::string_view token);
  /// The three coordinates that `numbers` reads next; `scanner` knows where they are.
  template <typename Numbers>
  Vec3 position(Numbers& numbers, std::size_t vertex, const TextScanner& scanner) {
    constexpr std::string_view kWhat = "a coordinate";
    Vec3 position;
    for (double& number : position) number = coordinate(numbers.any_real(kWhat), vertex, kWhat, scanner);
    return position;
  }
  /// A coordinate of `vertex`, for files that no TextScanner reads.
  double coordinate(double value, std::size_t vertex, std::string_view what, std::uint64_t mark,
                    std::string_view token);

  bool empty() const { return numbers_.empty(); }

  struct Complaint {
    std::uint64_t mark;
    std::string message;
  };
  /// The complaint of the first call whose vertex is used, or nothing. `numbers`: of the vertices that the calls count.
  std::optional<Complaint> first_used(const std::vector<bool>& used, const FileNumbers& numbers) const;
  /// Throws Error{kMeshNonFinite} at its place.
  void throw_if_used(const std::vector<bool>& used, const FileNumbers& numbers, const TextScanner& scanner) const;

 private:
  struct Number {
    std::size_t vertex;
    std::uint64_t mark;
    std::string_view token, what, why;
  };
  /// The first of a row at one vertex: it is what is said of them.
  void add(const Number& number);

  std::vector<Number> numbers_;
};

/// Which vertices the cells use. REQUIRES: the cells' vertices exist.
std::vector<bool> used_vertices(const ControlMesh& mesh);

/// Those, and the nodes that second_order lists. REQUIRES: they exist, too.
std::vector<bool> used_nodes(const MeshFile& file);

/// Makes mid_nodes of second_order, then leaves out the vertices that no cell uses as a corner, with a note of how many
/// aren't such nodes either, nor left_out_nodes. numbers.vertices goes along. Throws Error{kMeshNonFinite} if a node
/// that cells use has an unfit number. REQUIRES: the vertices of cells and all nodes exist, and nothing is sharp.
void leave_out_unused_vertices(const UnfitNumbers& unfit, const TextScanner& scanner, MeshFile& file);

}  // namespace ccslice
