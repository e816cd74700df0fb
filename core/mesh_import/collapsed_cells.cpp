// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/collapsed_cells.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/contains.h"
#include "core/base/count_text.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_counts.h"
#include "core/mesh/point_clusters.h"
#include "core/mesh_import/collapsed_shape.h"
#include "core/mesh_import/join_points.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice {
namespace {

using Quadrilateral = std::array<std::uint32_t, 4>;  // The places of its vertices, ascending.
using Shape = CollapsedShape;

struct Collapsed : CollapsedCell {
  std::uint32_t cell = 0;
};

class Resolver {
 public:
  explicit Resolver(MeshFile& file) : file_(file), mesh_(file.mesh) {}

  void resolve() {
    find_collapsed();
    if (collapsed_.empty()) return;
    find_places();
    find_quadrilaterals();
    follow_triangles();
    refuse_cells_beyond();
    replace_cells();
    note();
  }

 private:
  /// A quadrilateral that is to be halved: along which diagonal, and for which of the collapsed cells.
  struct Halved {
    std::array<std::uint32_t, 4> ring{};
    std::array<std::uint32_t, 2> diagonal{};  // The places of its ends, ascending.
    std::vector<std::size_t> cells;
    std::optional<std::uint32_t> beside;  // A cell that has triangles over three of the corners, as it's halved.
    bool has_node = false;                // In its middle.
    bool is_torn = false;                 // Cells have halved it along both diagonals.
  };

  template <typename Use>
  void for_each_cell(Use use) const {
    std::size_t begin = 0;
    for (std::uint32_t cell = 0; cell < mesh_.cell_count(); ++cell) {
      const auto corners = static_cast<std::size_t>(corner_count(mesh_.cell_kinds[cell]));
      use(cell, mesh_.cell_kinds[cell], std::span<const std::uint32_t>(mesh_.cell_vertices).subspan(begin, corners));
      begin += corners;
    }
  }

  void find_collapsed() {
    for_each_cell([&](std::uint32_t cell, CellKind kind, std::span<const std::uint32_t> corners) {
      if (!has_repeated_corner(corners)) return;
      std::optional<CollapsedCell> found = what_is_left(kind, corners);
      if (found) collapsed_.push_back({std::move(*found), cell});
    });
  }

  /// Cells of files in which each has points of its own are neighbours by their points' places.
  void find_places() {
    if (std::ranges::all_of(collapsed_, [](const Collapsed& cell) { return cell.shape == Shape::kCell; })) return;
    places_.resize(mesh_.vertex_count());
    std::iota(places_.begin(), places_.end(), 0u);
    for (const PointCluster& cluster : find_point_clusters(mesh_.positions, same_place_mm(mesh_))) {
      for (const std::uint32_t point : cluster.points) places_[point] = cluster.points.front();
    }
  }

  /// Of a vertex; of kNone it is kNone.
  std::uint32_t place_of(std::uint32_t vertex) const { return vertex < places_.size() ? places_[vertex] : vertex; }

  Quadrilateral key_of(std::array<std::uint32_t, 4> ring) const {
    for (std::uint32_t& vertex : ring) vertex = place_of(vertex);
    std::ranges::sort(ring);
    return ring;
  }

  std::array<std::uint32_t, 2> places_of_ends(std::uint32_t a, std::uint32_t b) const {
    return sorted_ends(place_of(a), place_of(b));
  }

  /// Whether the triangles on both sides of the diagonal from corner `from` on are turned the same way.
  bool parts_well(const std::array<std::uint32_t, 4>& ring, std::size_t from) const {
    const auto at = [&](std::size_t i) -> const Vec3& { return mesh_.positions[ring[(from + i) % 4]]; };
    const Vec3 first = (at(1) - at(0)).cross(at(2) - at(0)), second = (at(2) - at(0)).cross(at(3) - at(0));
    return first.dot(second) > 0;
  }

  std::array<std::uint32_t, 2> diagonal_of(const std::array<std::uint32_t, 4>& ring) const {
    const auto length = [&](std::size_t from) {
      return (mesh_.positions[ring[from + 2]] - mesh_.positions[ring[from]]).squaredNorm();
    };
    const auto ends = [&](std::size_t from) { return places_of_ends(ring[from], ring[from + 2]); };
    const bool first = parts_well(ring, 0), second = parts_well(ring, 1);
    if (first != second) return ends(first ? 0 : 1);
    if (length(0) != length(1)) return ends(length(0) < length(1) ? 0 : 1);
    return std::min(ends(0), ends(1));
  }

  /// Tetrahedra come first: they leave no choice.
  void find_quadrilaterals() {
    for (const Shape shape : {Shape::kTetOverQuadrilateral, Shape::kPyramid}) {
      for (std::size_t i = 0; i < collapsed_.size(); ++i) {
        const Collapsed& cell = collapsed_[i];
        if (cell.shape != shape) continue;
        const auto [place, is_new] = halved_.try_emplace(key_of(cell.base));
        Halved& halved = place->second;
        if (is_new) {
          halved.ring = cell.base;
          const auto& [a, b] = cell.diagonal_of_tet;
          halved.diagonal = shape == Shape::kPyramid ? diagonal_of(cell.base) : places_of_ends(a, b);
        }
        halved.cells.push_back(i);
      }
    }
  }

  /// The cells that stay as they are, or become others of as many faces: as use(cell, kind, corners).
  template <typename Use>
  void for_each_plain_cell(Use use) const {
    auto next = collapsed_.begin();
    for_each_cell([&](std::uint32_t cell, CellKind kind, std::span<const std::uint32_t> corners) {
      const bool is_collapsed = next != collapsed_.end() && next->cell == cell;
      if (!is_collapsed) return use(cell, kind, corners);
      if (next->shape == Shape::kCell) use(cell, next->kind, std::span<const std::uint32_t>(next->corners));
      ++next;
    });
  }

  /// Triangles of cells over three corners of a quadrilateral have halved it.
  void follow_triangles() {
    struct HalvedBy {
      Halved* halved;
      std::array<std::uint32_t, 2> diagonal;
    };
    std::map<std::array<std::uint32_t, 3>, HalvedBy> triangles;
    const auto key_of_triangle = [&](std::array<std::uint32_t, 3> corners) {
      for (std::uint32_t& corner : corners) corner = place_of(corner);
      std::ranges::sort(corners);
      return corners;
    };
    for (auto& [key, halved] : halved_) {
      if (!are_pyramids(halved)) continue;  // Four triangles of a tetrahedron are over its quadrilateral.
      const auto at = [&](std::size_t i) { return halved.ring[i % 4]; };
      for (std::size_t i = 0; i < 4; ++i) {
        triangles.try_emplace(key_of_triangle({at(i), at(i + 1), at(i + 2)}),
                              HalvedBy{&halved, places_of_ends(at(i), at(i + 2))});
      }
    }
    if (triangles.empty()) return;
    for_each_plain_cell([&](std::uint32_t cell, CellKind kind, std::span<const std::uint32_t> corners) {
      for (const LocalFace& face : cell_topology(kind).faces) {
        if (face.size != 3) continue;
        const auto ring = corners_of_face(kind, face, corners);
        const auto found = triangles.find(key_of_triangle({ring[0], ring[1], ring[2]}));
        if (found == triangles.end()) continue;
        auto& [halved, diagonal] = found->second;
        if (halved->beside && halved->diagonal != diagonal) halved->is_torn = true;
        halved->diagonal = diagonal;
        halved->beside = cell;
      }
    });
  }

  bool are_pyramids(const Halved& halved) const {
    return std::ranges::all_of(halved.cells, [&](std::size_t i) { return collapsed_[i].shape == Shape::kPyramid; });
  }

  /// Whether the cells on both sides of a quadrilateral go round it alike, and there are two at most.
  bool fits(const Halved& halved) const {
    return halved.cells.size() < 3 && !halved.is_torn && std::ranges::all_of(halved.cells, [&](std::size_t i) {
             const auto& base = collapsed_[i].base;
             return halved.diagonal == places_of_ends(base[0], base[2]) ||
                    halved.diagonal == places_of_ends(base[1], base[3]);
           });
  }

  /// Of these four vertices those that the diagonal runs between, ascending.
  std::array<std::uint32_t, 2> ends_of_diagonal(const std::array<std::uint32_t, 4>& vertices,
                                                const Halved& halved) const {
    std::vector<std::uint32_t> ends;
    for (const std::uint32_t vertex : vertices) {
      if (contains(halved.diagonal, place_of(vertex))) ends.push_back(vertex);
    }
    return sorted_ends(ends.front(), ends.back());
  }

  Vec3 middle_of(const std::array<std::uint32_t, 4>& ring) const {
    Vec3 middle = Vec3::Zero();
    for (const std::uint32_t vertex : ring) middle += mesh_.positions[vertex] / 4;
    return middle;
  }

  std::string number_of(std::uint32_t cell) const { return std::to_string(file_cell(file_.numbers, cell)); }

  /// Names each quadrilateral that can't be halved, by the cell that would be and the one beyond.
  void refuse_cells_beyond() const {
    if (halved_.empty()) return;
    std::vector<std::string> pairs;
    std::vector<std::int64_t> ids;
    std::size_t count = 0;
    const auto add = [&](const Halved& halved, std::uint32_t beyond) {
      if (++count > kMaxEchoItems) return;
      const Collapsed& cell = collapsed_[halved.cells.front()];
      const std::string what = cell.shape == Shape::kPyramid ? "pyramid " : "collapsed tetrahedron ";
      pairs.push_back(what + number_of(cell.cell) + " at " + file_.numbers.cell_noun + " " + number_of(beyond));
      if (count == 1) pairs.back() += " near " + place_in_mm(middle_of(halved.ring));
      ids.insert(ids.end(), {cell.cell, beyond});
    };
    const auto look_at = [&](std::uint32_t cell, CellKind kind, std::span<const std::uint32_t> corners) {
      for (const LocalFace& face : cell_topology(kind).faces) {
        if (face.size != 4) continue;
        const auto found = halved_.find(key_of(corners_of_face(kind, face, corners)));
        if (found != halved_.end()) add(found->second, cell);
      }
    };
    for_each_plain_cell(look_at);
    for (const auto& [key, halved] : halved_) {
      if (!fits(halved)) add(halved, halved.is_torn ? *halved.beside : collapsed_[halved.cells.back()].cell);
    }
    if (count == 0) return;
    std::ranges::sort(ids);
    throw Error(ErrorCode::kMeshUnsupportedCell,
                "a pyramid never refines to hexahedra, and as two tetrahedra it doesn't fit the cell beyond its "
                "quadrilateral: " +
                    echoed_list(pairs, count) +
                    "; mesh the part without pyramids, of tetrahedra alone or of hexahedra and wedges alone",
                "cells", ids);
  }

  void replace_cells();
  void append(const Collapsed& cell, std::vector<CellKind>& kinds, std::vector<std::uint32_t>& vertices) const;
  void renumber_cells(std::span<const std::uint32_t> first, std::size_t count);
  void renumber_mid_nodes(std::span<const std::uint32_t> first);
  void add_node_of_diagonal(const Halved& halved, const MidNodes& nodes, MidNodeList& list) const;
  void note();

  MeshFile& file_;
  ControlMesh& mesh_;
  std::vector<Collapsed> collapsed_;   // By cell, ascending.
  std::vector<std::uint32_t> places_;  // By vertex: the first one in its place. Empty if nothing is halved.
  std::map<Quadrilateral, Halved> halved_;
};

void Resolver::append(const Collapsed& cell, std::vector<CellKind>& kinds, std::vector<std::uint32_t>& vertices) const {
  kinds.push_back(cell.kind);
  if (cell.shape != Shape::kPyramid) {
    vertices.insert(vertices.end(), cell.corners.begin(), cell.corners.end());
    return;
  }
  kinds.push_back(cell.kind);
  const auto& base = cell.base;
  const std::size_t from = contains(halved_.at(key_of(base)).diagonal, place_of(base[0])) ? 0 : 1;
  const auto at = [&](std::size_t i) { return base[(from + i) % 4]; };
  vertices.insert(vertices.end(), {at(0), at(1), at(2), cell.corners[4], at(0), at(2), at(3), cell.corners[4]});
}

void Resolver::replace_cells() {
  std::vector<CellKind> kinds;
  std::vector<std::uint32_t> vertices, first;  // The first cell that a cell has become.
  auto next = collapsed_.begin();
  for_each_cell([&](std::uint32_t cell, CellKind kind, std::span<const std::uint32_t> corners) {
    first.push_back(static_cast<std::uint32_t>(kinds.size()));
    if (next != collapsed_.end() && next->cell == cell) return append(*next++, kinds, vertices);
    kinds.push_back(kind);
    vertices.insert(vertices.end(), corners.begin(), corners.end());
  });
  mesh_.cell_kinds = std::move(kinds);
  mesh_.cell_vertices = std::move(vertices);
  if (!mesh_.mid_nodes.empty()) renumber_mid_nodes(first);
  if (mesh_.cell_count() > first.size()) renumber_cells(first, mesh_.cell_count());
}

/// What a cell had goes to both halves of it.
void Resolver::renumber_cells(std::span<const std::uint32_t> first, std::size_t count) {
  std::vector<std::uint32_t> old;  // By cell: what it was.
  for (std::uint32_t cell = 0; cell < first.size(); ++cell) {
    const std::size_t end = cell + 1 < first.size() ? first[cell + 1] : count;
    old.resize(end, cell);
  }
  const auto expand = [&](auto& of_cells) {
    if (of_cells.empty()) return;
    auto all = std::move(of_cells);
    of_cells = {};
    of_cells.reserve(count);
    for (const std::uint32_t cell : old) of_cells.push_back(all[cell]);
  };
  for (CellNumbers& numbers : file_.cell_numbers) expand(numbers.of_cells);
  expand(file_.numbers.cells);
  expand(mesh_.cell_regions);
  for (auto* sets : {&file_.cell_sets, &file_.cell_materials}) {
    for (CellSet& set : *sets) {
      std::vector<std::uint32_t> cells;
      for (const std::uint32_t cell : set.cells) {
        const std::size_t end = cell + 1 < first.size() ? first[cell + 1] : count;
        for (std::uint32_t part = first[cell]; part < end; ++part) cells.push_back(part);
      }
      set.cells = std::move(cells);
    }
  }
}

/// Nodes in the middle of cells that are no hexahedra any more are left out, and those of halved quadrilaterals, which
/// become nodes of the diagonals.
void Resolver::renumber_mid_nodes(std::span<const std::uint32_t> first) {
  const MidNodes nodes = std::exchange(mesh_.mid_nodes, {});
  const std::size_t channels = mesh_.channel_count();
  MidNodeList list(channels);
  std::size_t node = 0;
  const auto next = [&] { return MidNodeList::source_of(nodes, file_.numbers.mid_nodes, channels, node++); };
  for (const auto& edge : nodes.edges) list.add_edge(edge, next());
  for (const auto& face : nodes.faces) {
    const auto halved = halved_.find(key_of(face));
    if (halved == halved_.end()) {
      list.add_face(face, next());
    } else {
      list.add_edge(ends_of_diagonal(face, halved->second), next());
      halved->second.has_node = true;
    }
  }
  for (const std::uint32_t cell : nodes.cells) {
    const MidNodeList::Source source = next();
    const bool is_whole = !std::ranges::binary_search(collapsed_, cell, {}, &Collapsed::cell);
    if (is_whole) list.add_cell(first[cell], source);
  }
  for (const auto& [key, halved] : halved_) {
    if (!halved.has_node) add_node_of_diagonal(halved, nodes, list);
  }
  MidNodeList::Result result = list.finish();
  mesh_.mid_nodes = std::move(result.nodes);
  if (!file_.numbers.mid_nodes.empty()) file_.numbers.mid_nodes = std::move(result.numbers);
}

/// Where the quadrilateral of second order has its middle: half of its edges' nodes without a quarter of its corners.
/// The file has no such node, so it is called by the number of an edge's.
void Resolver::add_node_of_diagonal(const Halved& halved, const MidNodes& nodes, MidNodeList& list) const {
  const std::size_t channels = mesh_.channel_count();
  Vec3 middle = Vec3::Zero();
  std::vector<float> values(channels);
  std::optional<std::size_t> curved;  // The last node of an edge.
  for (std::size_t i = 0; i < 4; ++i) {
    const std::uint32_t a = halved.ring[i], b = halved.ring[(i + 1) % 4];
    const std::optional<std::size_t> node = edge_node(nodes, {a, b});
    if (node) curved = node;
    const auto half_way = [&](auto from, auto to) { return (from + to) / 2; };
    middle += (node ? nodes.positions[*node] : Vec3(half_way(mesh_.positions[a], mesh_.positions[b]))) / 2;
    middle -= mesh_.positions[a] / 4;
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const auto value = [&](std::uint32_t vertex) { return mesh_.channel_values[vertex * channels + channel]; };
      const float at = node ? nodes.values[*node * channels + channel] : half_way(value(a), value(b));
      values[channel] += at / 2 - value(a) / 4;
    }
  }
  if (!curved) return;
  const std::uint64_t number = MidNodeList::source_of(nodes, file_.numbers.mid_nodes, channels, *curved).number;
  list.add_edge(ends_of_diagonal(halved.ring, halved), {middle, values, number});
}

void Resolver::note() {
  std::array<std::size_t, 3> of_kind{};
  std::size_t pyramids = 0;
  for (const Collapsed& cell : collapsed_) {
    (cell.shape == Shape::kPyramid ? pyramids : of_kind[static_cast<std::size_t>(cell.kind)]) += 1;
  }
  std::vector<std::string> kinds;
  for (const CellKindTraits& traits : kCellKinds) {
    const std::size_t count = of_kind[static_cast<std::size_t>(traits.kind)];
    if (count > 0) kinds.push_back(count_text(count, noun_of(traits.kind)));
  }
  if (!kinds.empty()) {
    file_.warnings.push_back("cells with repeated corners are read as what they are: " +
                             echoed_list(kinds, kinds.size()));
  }
  if (pyramids > 0) {
    file_.warnings.push_back(count_text(pyramids, "pyramid") + (pyramids == 1 ? " is" : " are") +
                             " read as two tetrahedra each");
  }
}

}  // namespace

void resolve_collapsed_cells(MeshFile& file) { Resolver(file).resolve(); }

}  // namespace ccslice
