// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/mid_nodes.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/number_text.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice {
namespace {

constexpr float kSameValues = 1e-6f;  // Values that differ by less, as a share of the larger, agree.

constexpr std::array<std::array<std::uint8_t, 2>, 6> kTetEdges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
constexpr std::array<std::array<std::uint8_t, 2>, 9> kWedgeEdges = {
    {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}}};
constexpr std::array<std::array<std::uint8_t, 2>, 12> kHexEdges = {
    {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6}, {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};
constexpr std::array<std::array<std::uint8_t, 4>, 3> kWedgeFaces = {{{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}};
constexpr std::array<std::array<std::uint8_t, 4>, 6> kHexFaces = {
    {{0, 3, 7, 4}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 2, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}}};

/// Adds the nodes of one cell. Edges and faces that repeated corners have made less of have none.
void add_nodes(const MeshFile& file, std::size_t cell, std::span<const std::uint32_t> corners,
               std::span<const std::uint32_t> nodes, MidNodeList& list) {
  const ControlMesh& mesh = file.mesh;
  const std::size_t channels = mesh.channel_count();
  const auto source = [&](std::uint32_t node) {
    const auto values = std::span(mesh.channel_values).subspan(node * channels, channels);
    return MidNodeList::Source{mesh.positions[node], values, file_vertex(file.numbers, node)};
  };
  std::size_t next = 0;
  const auto next_node = [&]() { return next < nodes.size() ? nodes[next++] : kNone; };
  for (const auto& [a, b] : mid_edges(mesh.cell_kinds[cell])) {
    const std::uint32_t node = next_node();
    if (node == kNone || corners[a] == corners[b]) continue;
    list.add_edge({corners[a], corners[b]}, source(node));
  }
  for (const auto& [a, b, c, d] : mid_faces(mesh.cell_kinds[cell])) {
    const std::uint32_t node = next_node();
    std::array<std::uint32_t, 4> ring = {corners[a], corners[b], corners[c], corners[d]};
    std::ranges::sort(ring);
    if (node == kNone || std::ranges::adjacent_find(ring) != ring.end()) continue;
    list.add_face(ring, source(node));
  }
  const std::uint32_t node = next_node();
  if (node != kNone) list.add_cell(static_cast<std::uint32_t>(cell), source(node));
}

/// `keys`: ascending. `first`: the node of the first key.
template <typename Key>
std::optional<std::size_t> node_in(const std::vector<Key>& keys, std::size_t first, const Key& key) {
  const auto found = std::ranges::lower_bound(keys, key);
  if (found == keys.end() || *found != key) return std::nullopt;
  return first + static_cast<std::size_t>(found - keys.begin());
}

}  // namespace

std::span<const std::array<std::uint8_t, 2>> mid_edges(CellKind kind) {
  if (kind == CellKind::kHex) return kHexEdges;
  return kind == CellKind::kTet ? std::span<const std::array<std::uint8_t, 2>>(kTetEdges) : kWedgeEdges;
}

std::span<const std::array<std::uint8_t, 4>> mid_faces(CellKind kind) {
  if (kind == CellKind::kHex) return kHexFaces;
  return kind == CellKind::kTet ? std::span<const std::array<std::uint8_t, 4>>{} : kWedgeFaces;
}

std::optional<std::size_t> edge_node(const MidNodes& nodes, std::array<std::uint32_t, 2> vertices) {
  std::ranges::sort(vertices);
  return node_in(nodes.edges, 0, vertices);
}

std::optional<std::size_t> face_node(const MidNodes& nodes, std::array<std::uint32_t, 4> vertices) {
  std::ranges::sort(vertices);
  return node_in(nodes.faces, nodes.edges.size(), vertices);
}

std::optional<std::size_t> cell_node(const MidNodes& nodes, std::uint32_t cell) {
  return node_in(nodes.cells, nodes.edges.size() + nodes.faces.size(), cell);
}

/// Where the table has the key, or would have it.
std::uint32_t& MidNodeList::place_of(const std::array<std::uint32_t, 5>& key) {
  std::uint64_t hash = 0;
  for (const std::uint32_t part : key) {
    hash = (hash ^ part) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 32;
  }
  std::size_t place = hash % places_.size();
  while (places_[place] != kNone && nodes_[places_[place]].key != key) place = (place + 1) % places_.size();
  return places_[place];
}

/// Half of the table stays empty.
void MidNodeList::grow() {
  constexpr std::size_t kFew = 64;
  places_.assign(std::max(kFew, 2 * places_.size()), kNone);
  for (const Node& node : nodes_) place_of(node.key) = node.index;
}

void MidNodeList::add(std::array<std::uint32_t, 5> key, const Source& source) {
  const auto& [position, values, number] = source;
  if (2 * (nodes_.size() + 1) > places_.size()) grow();
  std::uint32_t& place = place_of(key);
  if (place != kNone) {
    Node& first = nodes_[place];
    first.shared = true;
    first.apart_mm = std::max(first.apart_mm, (position - positions_[place]).norm());
    for (std::size_t c = 0; c < channels_; ++c) {
      const float known = values_[place * channels_ + c];
      const float most = kSameValues * std::max(std::abs(known), std::abs(values[c]));
      first.disagree = first.disagree || !(std::abs(values[c] - known) <= most);
    }
    return;
  }
  place = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({key, place});
  positions_.push_back(position);
  values_.insert(values_.end(), values.begin(), values.end());
  numbers_.push_back(number);
}

void MidNodeList::add_edge(std::array<std::uint32_t, 2> vertices, const Source& source) {
  std::ranges::sort(vertices);
  add({2, vertices[0], vertices[1], 0, 0}, source);
}

void MidNodeList::add_face(std::array<std::uint32_t, 4> vertices, const Source& source) {
  std::ranges::sort(vertices);
  add({4, vertices[0], vertices[1], vertices[2], vertices[3]}, source);
}

void MidNodeList::add_cell(std::uint32_t cell, const Source& source) { add({8, cell, 0, 0, 0}, source); }

void MidNodeList::add(const MidNodes& nodes, std::span<const std::uint64_t> numbers,
                      std::span<const std::uint32_t> new_vertices, std::span<const std::uint32_t> new_cells) {
  std::size_t next = 0;
  const auto add_as = [&](auto key, std::span<const std::uint32_t> new_ids, auto add_key) {
    const Source source = source_of(nodes, numbers, channels_, next++);
    for (std::uint32_t& id : key) id = new_ids[id];
    std::ranges::sort(key);
    const bool repeated = std::ranges::adjacent_find(key) != key.end();
    if (!repeated && key.back() != kNone) add_key(key, source);
  };
  for (const auto& edge : nodes.edges) {
    add_as(edge, new_vertices, [&](const auto&... arguments) { add_edge(arguments...); });
  }
  for (const auto& face : nodes.faces) {
    add_as(face, new_vertices, [&](const auto&... arguments) { add_face(arguments...); });
  }
  for (const std::uint32_t cell : nodes.cells) {
    add_as(std::array{cell}, new_cells, [&](const auto& key, const Source& source) { add_cell(key[0], source); });
  }
}

MidNodeList::Result MidNodeList::finish(double same_mm) const {
  std::vector<Node> sorted = nodes_;
  std::ranges::sort(sorted, {}, &Node::key);
  Result result;
  MidNodes& nodes = result.nodes;
  for (const auto& [key, index, apart_mm, disagree, shared] : sorted) {
    result.shared += shared;
    result.other_values += disagree;
    if (apart_mm > same_mm) {
      result.conflicts.emplace_back(nodes.positions.size(), apart_mm);
      result.farthest_apart_mm = std::max(result.farthest_apart_mm, apart_mm);
    }
    if (key[0] == 2) nodes.edges.push_back({key[1], key[2]});
    if (key[0] == 4) nodes.faces.push_back({key[1], key[2], key[3], key[4]});
    if (key[0] == 8) nodes.cells.push_back(key[1]);
    nodes.positions.push_back(positions_[index]);
    result.numbers.push_back(numbers_[index]);
    const auto values = values_.begin() + static_cast<std::ptrdiff_t>(index * channels_);
    nodes.values.insert(nodes.values.end(), values, values + static_cast<std::ptrdiff_t>(channels_));
  }
  return result;
}

bool is_another_order(const ControlMesh& mesh, const MidNodeList::Result& result) {
  constexpr double kFar = 0.2;  // Of the distance between two of the corners.
  constexpr std::size_t kFewest = 2, kOneIn = 3;
  const MidNodes& nodes = result.nodes;
  const auto is_far = [&](const auto& corners, double apart_mm) {
    double length = 0;
    for (const std::uint32_t a : corners) {
      for (const std::uint32_t b : corners) length = std::max(length, (mesh.positions[a] - mesh.positions[b]).norm());
    }
    return apart_mm > kFar * length;
  };
  std::size_t far = 0;
  for (const auto& [node, apart_mm] : result.conflicts) {
    if (node < nodes.edges.size()) {
      far += is_far(nodes.edges[node], apart_mm);
    } else if (node < nodes.edges.size() + nodes.faces.size()) {
      far += is_far(nodes.faces[node - nodes.edges.size()], apart_mm);
    }
  }
  return far >= kFewest && kOneIn * far >= result.shared;
}

MidNodeCorners::MidNodeCorners(const ControlMesh& mesh) : mesh_(mesh) {
  const std::vector<std::uint32_t>& cells = mesh.mid_nodes.cells;
  std::uint32_t begin = 0;
  for (std::uint32_t cell = 0; first_corners_.size() < cells.size(); ++cell) {
    if (cells[first_corners_.size()] == cell) first_corners_.push_back(begin);
    begin += static_cast<std::uint32_t>(corner_count(mesh.cell_kinds[cell]));
  }
}

std::span<const std::uint32_t> MidNodeCorners::operator[](std::size_t node) const {
  const MidNodes& nodes = mesh_.mid_nodes;
  if (node < nodes.edges.size()) return nodes.edges[node];
  node -= nodes.edges.size();
  if (node < nodes.faces.size()) return nodes.faces[node];
  const std::uint32_t begin = first_corners_[node - nodes.faces.size()];
  return std::span(mesh_.cell_vertices).subspan(begin, 8);
}

std::string other_order_text(double farthest_apart_mm, std::size_t places) {
  constexpr int kDigits = 3;
  return "cells of second order have their common nodes up to " + number_text(farthest_apart_mm, kDigits) +
         " apart, in " + std::to_string(places) +
         " places: they aren't in the format's order. All nodes between corners are left out, so edges are straight. "
         "Save the mesh with the format's own order of nodes";
}

void take_mid_nodes(MeshFile& file) {
  const SecondOrderCells curved = std::exchange(file.second_order, {});
  if (curved.cells.empty()) return;
  const ControlMesh& mesh = file.mesh;
  MidNodeList list(mesh.channel_count());
  std::size_t corner = 0, next = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count() && next < curved.cells.size(); ++cell) {
    const auto corners = static_cast<std::size_t>(corner_count(mesh.cell_kinds[cell]));
    if (curved.cells[next] == cell) {
      const std::uint64_t begin = curved.first_nodes[next];
      const std::uint64_t end = ++next < curved.cells.size() ? curved.first_nodes[next] : curved.nodes.size();
      add_nodes(file, cell, std::span(mesh.cell_vertices).subspan(corner, corners),
                std::span(curved.nodes).subspan(begin, end - begin), list);
    }
    corner += corners;
  }
  MidNodeList::Result result = list.finish();
  if (is_another_order(mesh, result)) {
    file.warnings.push_back(other_order_text(result.farthest_apart_mm, result.conflicts.size()));
    return;
  }
  file.mesh.mid_nodes = std::move(result.nodes);
  file.numbers.mid_nodes = std::move(result.numbers);
  if (result.other_values > 0) {
    file.warnings.push_back(std::to_string(result.other_values) +
                            " edges, faces or cells have nodes in their middle that disagree in a channel; the first "
                            "of each is taken");
  }
  if (result.conflicts.empty()) return;
  constexpr int kDigits = 3;
  file.warnings.push_back(std::to_string(result.conflicts.size()) +
                          " edges, faces or cells have several nodes in their middle, up to " +
                          number_text(result.farthest_apart_mm, kDigits) + " apart; the first of each is taken");
}

}  // namespace ccslice
