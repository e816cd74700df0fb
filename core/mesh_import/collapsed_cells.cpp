// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/collapsed_cells.h"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <optional>
#include <set>
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
#include "core/mesh_import/join_points.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/polyhedra.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice {
namespace {

using Quadrilateral = std::array<std::uint32_t, 4>;  // The places of its vertices, ascending.

enum class Shape : std::uint8_t { kCell, kPyramid, kTetOverQuadrilateral };

struct Collapsed {
  std::uint32_t cell = 0;
  Shape shape = Shape::kCell;
  CellKind kind = CellKind::kTet;
  std::vector<std::uint32_t> corners;              // A pyramid's: its base, then its apex.
  std::array<std::uint32_t, 4> base{};             // In cyclic order, unless it is a plain cell.
  std::array<std::uint32_t, 2> diagonal_of_tet{};  // Over a quadrilateral: the edge that halves it.
};

std::array<std::uint32_t, 2> sorted_ends(std::uint32_t a, std::uint32_t b) { return {std::min(a, b), std::max(a, b)}; }

bool has_repeated_corner(std::span<const std::uint32_t> corners) {
  for (std::size_t i = 1; i < corners.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (corners[i] == corners[k]) return true;
    }
  }
  return false;
}

std::array<std::uint32_t, 4> corners_of_face(CellKind kind, const LocalFace& face,
                                             std::span<const std::uint32_t> corners) {
  std::array<std::uint32_t, 4> ring{};
  for (std::size_t i = 0; i < face.size; ++i) ring[i] = corners[vtk_corner(kind, face.corners[i])];
  return ring;
}

/// What is left of the faces once repeated corners are one.
std::vector<FaceRing> faces_left(CellKind kind, std::span<const std::uint32_t> corners) {
  std::vector<FaceRing> rings;
  for (const LocalFace& face : cell_topology(kind).faces) {
    FaceRing ring;
    const auto whole = corners_of_face(kind, face, corners);
    for (std::size_t i = 0; i < face.size; ++i) {
      if (ring.empty() || ring.back() != whole[i]) ring.push_back(whole[i]);
    }
    while (ring.size() > 1 && ring.back() == ring.front()) ring.pop_back();
    if (ring.size() > 2) rings.push_back(std::move(ring));
  }
  return rings;
}

/// Two triangles that close a quadrilateral: between two corners of theirs runs an edge of the tetrahedron, which no
/// face shows.
std::optional<Collapsed> tet_over_quadrilateral(std::span<const FaceRing> rings, std::size_t vertices) {
  const auto quadrilateral = std::ranges::find(rings, std::size_t{4}, &FaceRing::size);
  if (rings.size() != 3 || vertices != 4 || quadrilateral == rings.end()) return std::nullopt;
  if (std::ranges::count(rings, std::size_t{3}, &FaceRing::size) != 2) return std::nullopt;
  Collapsed result{0, Shape::kTetOverQuadrilateral, CellKind::kTet, *quadrilateral};
  std::ranges::copy(*quadrilateral, result.base.begin());
  const auto in_one_triangle = [&](std::uint32_t vertex) {
    return std::ranges::count_if(rings, [&](const FaceRing& ring) { return contains(ring, vertex); }) == 2;
  };
  const std::size_t from = in_one_triangle(result.base[0]) ? 0 : 1;
  for (std::size_t i = 0; i < 4; ++i) {
    if (in_one_triangle(result.base[i]) != (i % 2 == from)) return std::nullopt;
  }
  result.diagonal_of_tet = sorted_ends(result.base[from], result.base[from + 2]);
  return result;
}

std::optional<Collapsed> what_is_left(CellKind kind, std::span<const std::uint32_t> corners) {
  const std::set<std::uint32_t> vertices(corners.begin(), corners.end());
  const std::vector<FaceRing> rings = faces_left(kind, corners);
  if (auto tet = tet_over_quadrilateral(rings, vertices.size())) return tet;
  const std::optional<CornersOfPolyhedron> found = corners_of_polyhedron(rings);
  if (!found) return std::nullopt;
  Collapsed result{0, Shape::kCell, found->kind, found->corners};
  if (found->kind == CellKind::kHex) {
    if (found->corners[4] != found->corners[7]) return std::nullopt;  // As many faces as before.
    result.shape = Shape::kPyramid;
    result.kind = CellKind::kTet;
    result.corners.resize(5);
    std::copy_n(result.corners.begin(), 4, result.base.begin());
  }
  const bool whole =
      std::set(result.corners.begin(), result.corners.end()) == vertices && result.corners.size() == vertices.size();
  return whole ? std::optional(result) : std::nullopt;
}

class Resolver {
 public:
  explicit Resolver(MeshFile& file) : file_(file), mesh_(file.mesh) {}

  void resolve() {
    find_collapsed();
    if (collapsed_.empty()) return;
    find_places();
    find_quadrilaterals();
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
    bool has_node = false;  // In its middle.
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
      std::optional<Collapsed> found = what_is_left(kind, corners);
      if (!found) return;
      found->cell = cell;
      collapsed_.push_back(std::move(*found));
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

  /// Whether the cells on both sides of a quadrilateral go round it alike, and there are two at most.
  bool fits(const Halved& halved) const {
    return halved.cells.size() < 3 && std::ranges::all_of(halved.cells, [&](std::size_t i) {
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
      ids.insert(ids.end(), {cell.cell, beyond});
    };
    const auto look_at = [&](std::uint32_t cell, CellKind kind, std::span<const std::uint32_t> corners) {
      for (const LocalFace& face : cell_topology(kind).faces) {
        if (face.size != 4) continue;
        const auto found = halved_.find(key_of(corners_of_face(kind, face, corners)));
        if (found != halved_.end()) add(found->second, cell);
      }
    };
    auto next = collapsed_.begin();
    for_each_cell([&](std::uint32_t cell, CellKind kind, std::span<const std::uint32_t> corners) {
      const bool is_collapsed = next != collapsed_.end() && next->cell == cell;
      if (!is_collapsed) return look_at(cell, kind, corners);
      if (next->shape == Shape::kCell) look_at(cell, next->kind, next->corners);
      ++next;
    });
    for (const auto& [key, halved] : halved_) {
      if (!fits(halved)) add(halved, collapsed_[halved.cells.back()].cell);
    }
    if (count == 0) return;
    std::ranges::sort(ids);
    throw Error(ErrorCode::kMeshUnsupportedCell,
                "a pyramid never refines to hexahedra, and as two tetrahedra it doesn't fit a hexahedron or a wedge "
                "beyond its quadrilateral: " +
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
  const auto values_of = [&](std::size_t node) { return std::span(nodes.values).subspan(node * channels, channels); };
  std::size_t node = 0;
  for (const auto& edge : nodes.edges) {
    list.add_edge(edge, nodes.positions[node], values_of(node));
    ++node;
  }
  for (const auto& face : nodes.faces) {
    const auto halved = halved_.find(key_of(face));
    if (halved == halved_.end()) {
      list.add_face(face, nodes.positions[node], values_of(node));
    } else {
      list.add_edge(ends_of_diagonal(face, halved->second), nodes.positions[node], values_of(node));
      halved->second.has_node = true;
    }
    ++node;
  }
  for (const std::uint32_t cell : nodes.cells) {
    const bool is_whole = !std::ranges::binary_search(collapsed_, cell, {}, &Collapsed::cell);
    if (is_whole) list.add_cell(first[cell], nodes.positions[node], values_of(node));
    ++node;
  }
  for (const auto& [key, halved] : halved_) {
    if (!halved.has_node) add_node_of_diagonal(halved, nodes, list);
  }
  mesh_.mid_nodes = list.finish().nodes;
}

/// Where the quadrilateral of second order has its middle: half of its edges' nodes without a quarter of its corners.
void Resolver::add_node_of_diagonal(const Halved& halved, const MidNodes& nodes, MidNodeList& list) const {
  const std::size_t channels = mesh_.channel_count();
  Vec3 middle = Vec3::Zero();
  std::vector<float> values(channels);
  bool curved = false;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::uint32_t a = halved.ring[i], b = halved.ring[(i + 1) % 4];
    const std::optional<std::size_t> node = edge_node(nodes, {a, b});
    curved |= node.has_value();
    const auto half_way = [&](auto from, auto to) { return (from + to) / 2; };
    middle += (node ? nodes.positions[*node] : Vec3(half_way(mesh_.positions[a], mesh_.positions[b]))) / 2;
    middle -= mesh_.positions[a] / 4;
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const auto value = [&](std::uint32_t vertex) { return mesh_.channel_values[vertex * channels + channel]; };
      const float at = node ? nodes.values[*node * channels + channel] : half_way(value(a), value(b));
      values[channel] += at / 2 - value(a) / 4;
    }
  }
  if (curved) list.add_edge(ends_of_diagonal(halved.ring, halved), middle, values);
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
