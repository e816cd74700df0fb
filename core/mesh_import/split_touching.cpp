// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/split_touching.h"

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/base/contains.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/check_arrays.h"
#include "core/mesh/link_groups.h"
#include "core/mesh/manifold.h"
#include "core/mesh/region_values.h"
#include "core/mesh_import/mid_nodes.h"

namespace ccslice {
namespace {

class TouchSplitter {
 public:
  TouchSplitter(const ControlMesh& mesh, const CancellationToken& cancel)
      : mesh_(mesh), cancel_(cancel), complex_(make_cell_complex(mesh, cancel)), corners_(mesh.cell_vertices) {}

  /// Whether it touches itself.
  bool find();
  void split();
  void finish(ControlMesh& split, FileNumbers& numbers);
  const SplitReport& report() const { return report_; }

 private:
  VertexId origin_of(std::uint32_t copy) const {
    return VertexId{copy < mesh_.vertex_count() ? copy : origins_[copy - mesh_.vertex_count()]};
  }
  std::uint32_t& copy_in(CellId cell, VertexId vertex);
  bool is_joined(FaceId face);
  std::vector<CellId> cells_at(std::uint32_t copy);
  std::vector<LinkTriangle> link_at(std::uint32_t copy, std::span<const CellId> cells);
  void split_fans(VertexId vertex);
  void split_links();
  void look_at(std::uint32_t copy);
  void regroup(std::uint32_t copy, std::span<const CellId> cells, std::span<const std::uint32_t> groups);
  std::set<std::uint32_t> copies_of(VertexId vertex);
  void copy_values(ControlMesh& split);
  void copy_features(ControlMesh& split);
  void copy_mid_nodes(ControlMesh& split, FileNumbers& numbers);

  const ControlMesh& mesh_;
  const CancellationToken& cancel_;
  const CellComplex complex_;
  std::vector<std::uint32_t> corners_;    // As mesh_.cell_vertices, by copies.
  std::vector<std::size_t> cell_begins_;  // In corners_.
  std::vector<std::uint32_t> origins_;    // Of copies beyond the mesh's vertices.
  std::vector<VertexId> pinched_;         // Vertices that touch, and those of edges that do. Ascending.
  std::deque<std::uint32_t> queue_;       // Copies to look at.
  std::vector<std::uint8_t> queued_;      // By copy.
  SplitReport report_;
};

bool TouchSplitter::find() {
  PeriodicPoll poll(cancel_);
  ManifoldTest manifold(complex_);
  std::vector<std::uint8_t> marked(mesh_.vertex_count(), 0);
  for (const EdgeId e : complex_.edges()) {
    poll();
    if (manifold.holds_at(e)) continue;
    const auto [a, b] = complex_.edge_vertices(e);
    if (report_.edges++ == 0) report_.first = (mesh_.positions[a] + mesh_.positions[b]) / 2;
    marked[a] = marked[b] = 1;
  }
  for (const VertexId v : complex_.vertices()) {
    poll();
    if (!marked[v] && !manifold.holds_at(v)) {
      if (report_.vertices++ == 0 && report_.edges == 0) report_.first = mesh_.positions[v];
      marked[v] = 1;
    }
    if (marked[v]) pinched_.push_back(v);
  }
  return !pinched_.empty();
}

std::uint32_t& TouchSplitter::copy_in(CellId cell, VertexId vertex) {
  std::size_t at = cell_begins_[cell];
  while (origin_of(corners_[at]) != vertex) ++at;
  return corners_[at];
}

bool TouchSplitter::is_joined(FaceId face) {
  if (complex_.face_on_boundary(face)) return false;
  const auto [first, second] = half_faces_of(face);
  const CellId a = complex_.half_face_cell(first), b = complex_.half_face_cell(second);
  return std::ranges::all_of(complex_.face_vertices(face), [&](VertexId v) { return copy_in(a, v) == copy_in(b, v); });
}

std::vector<CellId> TouchSplitter::cells_at(std::uint32_t copy) {
  std::vector<CellId> cells;
  const VertexId vertex = origin_of(copy);
  for (const CellId c : complex_.vertex_cells(vertex)) {
    if (copy_in(c, vertex) == copy) cells.push_back(c);
  }
  return cells;
}

std::vector<LinkTriangle> TouchSplitter::link_at(std::uint32_t copy, std::span<const CellId> cells) {
  const VertexId vertex = origin_of(copy);
  std::vector<LinkTriangle> link;
  for (const CellId c : cells) {
    const auto vertices = complex_.cell_vertices(c);
    const auto corner = static_cast<std::size_t>(std::ranges::find(vertices, vertex) - vertices.begin());
    const auto& neighbours = cell_topology(complex_.kind(c)).corner_neighbours[corner];
    LinkTriangle& triangle = link.emplace_back();
    std::size_t next = 0;
    for (const HalfFaceId h : complex_.cell_half_faces(c)) {
      const auto ring = complex_.face_vertices(face_of(h));
      if (!contains(ring, vertex)) continue;
      LinkEdge& edge = triangle.edges[next++];
      for (const std::uint8_t n : neighbours) {
        if (!contains(ring, vertices[n])) edge.opposite = copy_in(c, vertices[n]);
      }
      if (!is_joined(face_of(h))) continue;
      const CellId other = complex_.half_face_cell(opposite(h));
      edge.beyond = static_cast<std::uint32_t>(std::ranges::find(cells, other) - cells.begin());
    }
  }
  return link;
}

/// The first group keeps the copy.
void TouchSplitter::regroup(std::uint32_t copy, std::span<const CellId> cells, std::span<const std::uint32_t> groups) {
  const VertexId vertex = origin_of(copy);
  std::vector<std::uint32_t> copies = {copy};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    while (groups[i] >= copies.size()) {
      copies.push_back(static_cast<std::uint32_t>(mesh_.vertex_count() + origins_.size()));
      origins_.push_back(vertex);
      queued_.push_back(0);
    }
    copy_in(cells[i], vertex) = copies[groups[i]];
  }
}

/// Cells that faces join at the vertex are one fan.
void TouchSplitter::split_fans(VertexId vertex) {
  const auto cells = complex_.vertex_cells(vertex);
  const LinkGroups fans = fans_of_link(link_at(vertex, cells));
  if (fans.count > 1) regroup(vertex, cells, fans.groups);
}

void TouchSplitter::look_at(std::uint32_t copy) {
  if (queued_[copy]) return;
  queued_[copy] = 1;
  queue_.push_back(copy);
}

void TouchSplitter::split_links() {
  PeriodicPoll poll(cancel_);
  while (!queue_.empty()) {
    poll();
    const std::uint32_t copy = queue_.front();
    queue_.pop_front();
    queued_[copy] = 0;
    const std::vector<CellId> cells = cells_at(copy);
    const std::vector<LinkTriangle> link = link_at(copy, cells);
    const LinkGroups grouping = group_link(link);
    if (grouping.count < 2) continue;
    std::set<FaceId> cut;
    const VertexId vertex = origin_of(copy);
    for (const FaceId f : complex_.vertex_faces(vertex)) {
      if (is_joined(f) && contains(cells, complex_.half_face_cell(half_faces_of(f)[0]))) cut.insert(f);
    }
    regroup(copy, cells, grouping.groups);
    std::erase_if(cut, [&](FaceId f) { return is_joined(f); });
    report_.faces += cut.size();
    for (const FaceId f : cut) {
      for (const HalfFaceId h : half_faces_of(f)) {
        for (const VertexId v : complex_.face_vertices(f)) {
          if (v != vertex) look_at(copy_in(complex_.half_face_cell(h), v));
        }
      }
    }
  }
}

void TouchSplitter::split() {
  std::size_t begin = 0;
  for (const CellKind kind : mesh_.cell_kinds) {
    cell_begins_.push_back(begin);
    begin += static_cast<std::size_t>(corner_count(kind));
  }
  queued_.assign(mesh_.vertex_count(), 0);
  // Edges that end in several fans are parted so, and need no cut at their other end.
  for (const VertexId v : pinched_) split_fans(v);
  for (const VertexId v : pinched_) look_at(v);
  for (std::uint32_t copy = 0; copy < origins_.size(); ++copy) {
    look_at(static_cast<std::uint32_t>(mesh_.vertex_count() + copy));
  }
  split_links();
  report_.new_vertices = origins_.size();
}

std::set<std::uint32_t> TouchSplitter::copies_of(VertexId vertex) {
  std::set<std::uint32_t> copies;
  for (const CellId c : complex_.vertex_cells(vertex)) copies.insert(copy_in(c, vertex));
  return copies;
}

/// Copies whose cells are of one region have that region's values, others have values for each as their vertex does.
void TouchSplitter::copy_values(ControlMesh& split) {
  const std::size_t channels = mesh_.channel_count();
  for (const std::uint32_t origin : origins_) {
    split.positions.push_back(mesh_.positions[origin]);
    const auto values = std::span(mesh_.channel_values).subspan(origin * channels, channels);
    split.channel_values.insert(split.channel_values.end(), values.begin(), values.end());
  }
  if (region_value_count(mesh_) == 0) return;
  std::map<std::pair<std::uint32_t, std::uint8_t>, std::span<const float>> rows;
  for (std::size_t i = 0; i < region_value_count(mesh_); ++i) {
    const VertexId vertex{mesh_.region_value_vertices[i]};
    const std::uint8_t region = mesh_.region_value_regions[i];
    for (const std::uint32_t copy : copies_of(vertex)) {
      std::set<std::uint8_t> regions;
      for (const CellId c : cells_at(copy)) regions.insert(region_of(mesh_, c));
      if (!regions.contains(region)) continue;
      const auto row = std::span(mesh_.region_values).subspan(i * channels, channels);
      if (regions.size() > 1) {
        rows[{copy, region}] = row;
      } else {
        std::ranges::copy(row, split.channel_values.begin() + static_cast<std::ptrdiff_t>(copy * channels));
      }
    }
  }
  clear_region_values(split);
  for (const auto& [place, row] : rows) append_region_values(place.first, place.second, row, split);
}

void TouchSplitter::copy_features(ControlMesh& split) {
  split.sharp_edges.clear();
  for (const auto& [a, b] : mesh_.sharp_edges) {
    const EdgeId e = complex_.find_edge(VertexId{a}, VertexId{b});
    std::set<std::array<std::uint32_t, 2>> copies;
    if (e == kNone) {
      copies.insert({a, b});  // For validate() to refuse.
    } else {
      for (const CellId c : complex_.edge_cells(e)) copies.insert({copy_in(c, VertexId{a}), copy_in(c, VertexId{b})});
    }
    split.sharp_edges.insert(split.sharp_edges.end(), copies.begin(), copies.end());
  }
  split.sharp_vertices.clear();
  for (const std::uint32_t v : mesh_.sharp_vertices) {
    const std::set<std::uint32_t> copies = copies_of(VertexId{v});
    split.sharp_vertices.insert(split.sharp_vertices.end(), copies.begin(), copies.end());
  }
  split.missed_vertices.clear();
  for (const MissedVertex& missed : mesh_.missed_vertices) {
    for (const std::uint32_t copy : copies_of(VertexId{missed.vertex})) {
      split.missed_vertices.push_back({copy, missed.position});
    }
  }
  std::ranges::sort(split.missed_vertices, {}, &MissedVertex::vertex);
}

void TouchSplitter::copy_mid_nodes(ControlMesh& split, FileNumbers& numbers) {
  const MidNodes& nodes = mesh_.mid_nodes;
  if (nodes.empty()) return;
  const std::size_t channels = mesh_.channel_count();
  MidNodeList list(channels);
  const auto source = [&](std::size_t node) {
    return MidNodeList::source_of(nodes, numbers.mid_nodes, channels, node);
  };
  for (const CellId c : complex_.cells()) {
    const auto old = [&](std::uint8_t i) { return mesh_.cell_vertices[cell_begins_[c] + i]; };
    const auto now = [&](std::uint8_t i) { return corners_[cell_begins_[c] + i]; };
    for (const auto& [i, j] : mid_edges(complex_.kind(c))) {
      const auto node = edge_node(nodes, {old(i), old(j)});
      if (node) list.add_edge({now(i), now(j)}, source(*node));
    }
    for (const auto& [i, j, k, l] : mid_faces(complex_.kind(c))) {
      const auto node = face_node(nodes, {old(i), old(j), old(k), old(l)});
      if (node) list.add_face({now(i), now(j), now(k), now(l)}, source(*node));
    }
  }
  for (std::size_t i = 0; i < nodes.cells.size(); ++i) {
    list.add_cell(nodes.cells[i], source(nodes.edges.size() + nodes.faces.size() + i));
  }
  MidNodeList::Result result = list.finish();
  split.mid_nodes = std::move(result.nodes);
  if (!numbers.mid_nodes.empty()) numbers.mid_nodes = std::move(result.numbers);
}

void TouchSplitter::finish(ControlMesh& split, FileNumbers& numbers) {
  copy_values(split);
  copy_features(split);
  copy_mid_nodes(split, numbers);
  if (!numbers.vertices.empty()) {
    for (const std::uint32_t origin : origins_) numbers.vertices.push_back(std::uint64_t{numbers.vertices[origin]});
  }
  split.cell_vertices = std::move(corners_);
}

}  // namespace

SplitReport split_touching(ControlMesh& mesh, FileNumbers& numbers, const CancellationToken& cancel) {
  check_arrays(mesh, {}, cancel);
  TouchSplitter splitter(mesh, cancel);
  if (!splitter.find()) return {};
  splitter.split();
  ControlMesh split = mesh;
  splitter.finish(split, numbers);
  mesh = std::move(split);
  return splitter.report();
}

}  // namespace ccslice
