// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/brute_force_topology.h"

#include <algorithm>
#include <stdexcept>

namespace ccslice::oracle {
namespace {

KindTables make_tables(int corners, std::vector<std::array<int, 2>> edges, std::vector<std::vector<int>> faces) {
  KindTables t{corners, std::move(edges), std::move(faces), {}};
  for (const auto& face : t.faces) {
    std::vector<int> ids;
    for (std::size_t e = 0; e < t.edges.size(); ++e) {
      const auto on_face = [&](int c) { return std::find(face.begin(), face.end(), c) != face.end(); };
      if (on_face(t.edges[e][0]) && on_face(t.edges[e][1])) ids.push_back(static_cast<int>(e));
    }
    t.face_edges.push_back(ids);
  }
  return t;
}

/// One use of a face or edge by a cell; uses of the same thing have the same key.
template <std::size_t N>
struct Use {
  std::array<std::uint32_t, N> key;
  std::uint32_t cell;
  int local;
  bool operator<(const Use& o) const { return std::tie(key, cell, local) < std::tie(o.key, o.cell, o.local); }
};

void collect_faces(const std::vector<BruteCell>& cells, BruteTopology& topology) {
  std::vector<Use<4>> uses;
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    const KindTables& t = tables(cells[c].kind);
    for (int f = 0; f < static_cast<int>(t.faces.size()); ++f) {
      std::array<std::uint32_t, 4> key{kNone, kNone, kNone, kNone};
      for (std::size_t i = 0; i < t.faces[f].size(); ++i) key[i] = cells[c].v[t.faces[f][i]];
      std::sort(key.begin(), key.end());
      uses.push_back({key, c, f});
    }
  }
  std::sort(uses.begin(), uses.end());
  topology.cell_faces.assign(cells.size(), {kNone, kNone, kNone, kNone, kNone, kNone});
  for (std::size_t i = 0; i < uses.size(); ++i) {
    const Use<4>& use = uses[i];
    if (i == 0 || use.key != uses[i - 1].key) {
      BruteFace face;
      const std::vector<int>& corners = tables(cells[use.cell].kind).faces[use.local];
      for (std::size_t k = 0; k < corners.size(); ++k) face.v[k] = cells[use.cell].v[corners[k]];
      face.cells[0] = use.cell;
      face.first_local = use.local;
      face.boundary = cells[use.cell].boundary_faces >> use.local & 1;
      topology.faces.push_back(face);
    } else if (topology.faces.back().cells[1] == kNone) {
      topology.faces.back().cells[1] = use.cell;
    } else {
      throw std::logic_error("brute force: a face in more than two cells");
    }
    topology.cell_faces[use.cell][use.local] = static_cast<std::uint32_t>(topology.faces.size() - 1);
  }
}

void collect_edges(const std::vector<BruteCell>& cells, BruteTopology& topology) {
  std::vector<Use<2>> uses;
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    const KindTables& t = tables(cells[c].kind);
    for (int e = 0; e < static_cast<int>(t.edges.size()); ++e) {
      const auto [a, b] = std::minmax(cells[c].v[t.edges[e][0]], cells[c].v[t.edges[e][1]]);
      uses.push_back({{a, b}, c, e});
    }
  }
  std::sort(uses.begin(), uses.end());
  topology.cell_edges.resize(cells.size());
  for (std::size_t i = 0; i < uses.size(); ++i) {
    if (i == 0 || uses[i].key != uses[i - 1].key) topology.edges.push_back(uses[i].key);
    topology.cell_edges[uses[i].cell][uses[i].local] = static_cast<std::uint32_t>(topology.edges.size() - 1);
  }
}

using Pairs = std::vector<std::array<std::uint32_t, 2>>;

void collect_incidences(const std::vector<BruteCell>& cells, std::size_t vertex_count, BruteTopology& topology) {
  Pairs edge_faces, edge_cells, vertex_edges, vertex_faces, vertex_cells;
  for (std::uint32_t c = 0; c < cells.size(); ++c) {
    const KindTables& t = tables(cells[c].kind);
    for (int i = 0; i < t.corners; ++i) vertex_cells.push_back({cells[c].v[i], c});
    for (std::size_t e = 0; e < t.edges.size(); ++e) edge_cells.push_back({topology.cell_edges[c][e], c});
  }
  for (std::uint32_t e = 0; e < topology.edges.size(); ++e) {
    for (const std::uint32_t v : topology.edges[e]) vertex_edges.push_back({v, e});
  }
  for (std::uint32_t f = 0; f < topology.faces.size(); ++f) {
    const BruteFace& face = topology.faces[f];
    for (int i = 0; i < face.corners(); ++i) vertex_faces.push_back({face.v[i], f});
    for (const int e : tables(cells[face.cells[0]].kind).face_edges[face.first_local]) {
      edge_faces.push_back({topology.cell_edges[face.cells[0]][e], f});
    }
  }
  topology.edge_faces = Incidence(topology.edges.size(), std::move(edge_faces));
  topology.edge_cells = Incidence(topology.edges.size(), std::move(edge_cells));
  topology.vertex_edges = Incidence(vertex_count, std::move(vertex_edges));
  topology.vertex_faces = Incidence(vertex_count, std::move(vertex_faces));
  topology.vertex_cells = Incidence(vertex_count, std::move(vertex_cells));
}

}  // namespace

const KindTables& tables(CellKind kind) {
  static const KindTables hex =
      make_tables(8, {{0, 1}, {3, 2}, {4, 5}, {7, 6}, {0, 3}, {1, 2}, {4, 7}, {5, 6}, {0, 4}, {1, 5}, {3, 7}, {2, 6}},
                  {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4}, {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}});
  static const KindTables tet =
      make_tables(4, {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
  static const KindTables wedge =
      make_tables(6, {{0, 1}, {1, 2}, {0, 2}, {3, 4}, {4, 5}, {3, 5}, {0, 3}, {1, 4}, {2, 5}},
                  {{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}});
  return kind == CellKind::kHex ? hex : kind == CellKind::kTet ? tet : wedge;
}

Incidence::Incidence(std::size_t items, Pairs pairs) {
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  begin_.assign(items + 1, 0);
  for (const auto& [item, id] : pairs) {
    ++begin_[item + 1];
    ids_.push_back(id);
  }
  for (std::size_t i = 0; i < items; ++i) begin_[i + 1] += begin_[i];
}

bool BruteTopology::edge_complete(std::uint32_t edge) const {
  return std::ranges::all_of(edge_faces[edge], [&](std::uint32_t f) { return faces[f].complete(); });
}

bool BruteTopology::vertex_complete(std::uint32_t vertex) const {
  return std::ranges::all_of(vertex_faces[vertex], [&](std::uint32_t f) { return faces[f].complete(); });
}

bool BruteTopology::edge_on_boundary(std::uint32_t edge) const {
  return std::ranges::any_of(edge_faces[edge], [&](std::uint32_t f) { return faces[f].boundary; });
}

bool BruteTopology::vertex_on_boundary(std::uint32_t vertex) const {
  return std::ranges::any_of(vertex_faces[vertex], [&](std::uint32_t f) { return faces[f].boundary; });
}

BruteTopology build_topology(const std::vector<BruteCell>& cells, std::size_t vertex_count) {
  BruteTopology topology;
  collect_faces(cells, topology);
  collect_edges(cells, topology);
  collect_incidences(cells, vertex_count, topology);
  return topology;
}

}  // namespace ccslice::oracle
