// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/check_arrays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/echo.h"
#include "core/base/number_text.h"
#include "core/mesh/offenders.h"
#include "core/mesh/region_values.h"
#include "core/mesh/validate.h"

namespace ccslice {

namespace {

void check_limit(std::size_t value, std::size_t limit, const char* what, const char* field) {
  if (value <= limit) return;
  throw Error(ErrorCode::kMeshTooLarge,
              std::string(field) + ": " + std::to_string(value) + " " + what + " are more than the limit of " +
                  std::to_string(limit) + "; split the part or use a coarser control mesh",
              field);
}

void check_length(std::size_t length, std::size_t expected, const char* field, const std::string& reckoning) {
  if (length == expected) return;
  throw Error(ErrorCode::kMeshArrayMismatch,
              std::string(field) + " holds " + std::to_string(length) + " numbers, but " + reckoning + " need " +
                  std::to_string(expected),
              field);
}

void check_sizes(const ControlMesh& mesh, const MeshLimits& limits) {
  const std::size_t cells = mesh.cell_count(), vertices = mesh.vertex_count(), channels = mesh.channel_count();
  if (cells == 0) {
    throw Error(ErrorCode::kMeshEmpty, "the mesh has no cells: a solid needs at least one", "cell_kinds");
  }
  if (vertices == 0) throw Error(ErrorCode::kMeshEmpty, "the mesh has no vertices: give positions", "positions_mm");
  check_limit(vertices, limits.max_vertices, "vertices", "positions_mm");
  check_limit(cells, limits.max_cells, "cells", "cell_kinds");
  check_limit(channels, limits.max_channels, "channels", "channel_names");
  std::size_t corners = 0;
  for (const CellKind kind : mesh.cell_kinds) corners += static_cast<std::size_t>(corner_count(kind));
  check_length(mesh.cell_vertices.size(), corners, "cell_vertices", "the " + std::to_string(cells) + " cells");
  check_length(mesh.channel_values.size(), vertices * channels, "channel_values",
               std::to_string(vertices) + " vertices with " + std::to_string(channels) + " channels");
  const std::size_t regions = mesh.cell_region_names.size();
  check_limit(regions, limits.max_cell_regions, "cell regions", "cell_region_names");
  check_length(mesh.cell_regions.size(), regions == 0 ? 0 : cells, "cell_regions",
               regions == 0 ? "cells without named regions" : "the " + std::to_string(cells) + " cells");
  const MidNodes& nodes = mesh.mid_nodes;
  const std::size_t mid_nodes = nodes.edges.size() + nodes.faces.size() + nodes.cells.size();
  check_limit(mid_nodes, 4 * limits.max_vertices, "mid-nodes", "edge_node_vertices");
  check_length(3 * nodes.positions.size(), 3 * mid_nodes, "node_positions_mm",
               std::to_string(mid_nodes) + " mid-nodes");
  check_length(nodes.values.size(), mid_nodes * channels, "node_values",
               std::to_string(mid_nodes) + " mid-nodes with " + std::to_string(channels) + " channels");
  if (!mesh.interpolating) {
    check_length(mesh.missed_vertices.size(), 0, "missed_vertices", "meshes without 'interpolating'");
  }
}

/// What is named in a mesh: channels, or regions of cells.
struct NamedKind {
  ErrorCode code;
  const char* one;
  const char* field;
  std::size_t max_bytes;
};

void check_names(const std::vector<std::string>& names, const NamedKind& kind) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string& name = names[i];
    const auto refuse = [&](const std::string& what) {
      const std::string field = std::string(kind.field) + "[" + std::to_string(i) + "]";
      throw Error(kind.code, field + " " + what, field, {static_cast<std::int64_t>(i)});
    };
    if (name.empty()) refuse(std::string("is empty: give each ") + kind.one + " a name");
    if (name.size() > kind.max_bytes) {
      refuse("'" + echoed(name) + "' has " + std::to_string(name.size()) + " bytes, the limit is " +
             std::to_string(kind.max_bytes) + ": shorten it");
    }
    if (!seen.insert(name).second) refuse("repeats the name '" + echoed(name) + "': rename one");
  }
}

void check_cell_regions(const ControlMesh& mesh) {
  const std::size_t names = mesh.cell_region_names.size();
  Offenders unknown;
  for (std::size_t c = 0; c < mesh.cell_regions.size(); ++c) {
    if (mesh.cell_regions[c] >= names) unknown.add(static_cast<std::int64_t>(c), c);
  }
  unknown.throw_if_any(ErrorCode::kMeshBadCellRegion, "no such cell region:", kCells,
                       "cell_region_names holds " + std::to_string(names) + " names, counted from 0", "cell_regions");
}

/// at(i): the i-th position and its vertex.
template <typename At>
void check_positions(std::size_t count, At at, const char* field, const Noun& noun, const MeshLimits& limits,
                     const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders non_finite, far;
  for (std::size_t i = 0; i < count; ++i) {
    poll();
    const auto [v, p] = at(i);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double coordinate = p[static_cast<Eigen::Index>(axis)];
      if (std::isfinite(coordinate) && std::abs(coordinate) <= limits.max_abs_coordinate_mm) continue;
      (p.allFinite() ? far : non_finite).add(static_cast<std::int64_t>(v), 3 * i + axis);
      break;
    }
  }
  non_finite.throw_if_any(ErrorCode::kMeshNonFinite, "NaN or infinite position at", noun, "give finite millimetres",
                          field);
  far.throw_if_any(ErrorCode::kMeshCoordinateOutOfRange, "coordinates beyond the limit at", noun,
                   "positions are in mm, at most " + number_text(limits.max_abs_coordinate_mm) + " from the origin",
                   field);
}

/// With those of mid-nodes and missed vertices.
void check_all_positions(const ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel) {
  using Place = std::pair<std::size_t, const Vec3&>;
  check_positions(
      mesh.vertex_count(), [&](std::size_t v) { return Place(v, mesh.positions[v]); }, "positions_mm", kVertices,
      limits, cancel);
  check_positions(
      mesh.mid_nodes.positions.size(), [&](std::size_t n) { return Place(n, mesh.mid_nodes.positions[n]); },
      "node_positions_mm", kMidNodes, limits, cancel);
  const std::vector<MissedVertex>& missed = mesh.missed_vertices;
  check_positions(
      missed.size(), [&](std::size_t i) { return Place(missed[i].vertex, missed[i].position); }, "missed_positions_mm",
      kVertices, limits, cancel);
}

void check_channel_values(std::span<const float> all, std::size_t channels, const char* field, const Noun& noun,
                          const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders non_finite;
  for (std::size_t v = 0; v * channels < all.size(); ++v) {
    poll();
    const auto values = all.subspan(v * channels, channels);
    const auto bad = std::find_if_not(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
    if (bad == values.end()) continue;
    non_finite.add(static_cast<std::int64_t>(v), v * channels + static_cast<std::size_t>(bad - values.begin()));
  }
  non_finite.throw_if_any(ErrorCode::kMeshNonFinite, "NaN or infinite channel value at", noun, "give finite values",
                          field);
}

/// The first corner that repeats an earlier one.
std::optional<std::size_t> repeated_corner(std::span<const std::uint32_t> corners) {
  for (std::size_t i = 1; i < corners.size(); ++i) {
    const auto earlier = corners.first(i);
    if (std::find(earlier.begin(), earlier.end(), corners[i]) != earlier.end()) return i;
  }
  return std::nullopt;
}

/// How many cells use each vertex.
std::vector<std::uint32_t> check_corners(const ControlMesh& mesh, const std::string& bound,
                                         const CancellationToken& cancel) {
  PeriodicPoll poll(cancel);
  Offenders range, repeated;
  const std::size_t n = mesh.vertex_count();
  std::vector<std::uint32_t> used(n, 0);
  std::size_t begin = 0;
  for (std::size_t c = 0; c < mesh.cell_count(); ++c) {
    poll();
    const auto corners =
        std::span(mesh.cell_vertices).subspan(begin, static_cast<std::size_t>(corner_count(mesh.cell_kinds[c])));
    const auto beyond = std::find_if(corners.begin(), corners.end(), [n](std::uint32_t v) { return v >= n; });
    if (beyond != corners.end()) {
      range.add(static_cast<std::int64_t>(c), begin + static_cast<std::size_t>(beyond - corners.begin()));
    } else {
      const auto twice = repeated_corner(corners);
      if (twice) repeated.add(static_cast<std::int64_t>(c), begin + *twice);
      for (const std::uint32_t v : corners) ++used[v];
    }
    begin += corners.size();
  }
  range.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "vertex id out of range in", kCells, bound, "cell_vertices");
  repeated.throw_if_any(ErrorCode::kMeshRepeatedVertex, "a vertex is repeated in", kCells,
                        "collapsed cells never refine to hexahedra: remove or remesh them", "cell_vertices");
  return used;
}

void check_usage(const std::vector<std::uint32_t>& used, const MeshLimits& limits) {
  Offenders isolated, valence;
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v] == 0) isolated.add(static_cast<std::int64_t>(v), 3 * v);
    if (used[v] > limits.max_vertex_valence) valence.add(static_cast<std::int64_t>(v));
  }
  isolated.throw_if_any(ErrorCode::kMeshIsolatedVertex, "no cell uses", kVertices, "remove them", "positions_mm");
  // Before anything is built whose cost grows with the square of a valence.
  valence.throw_if_any(ErrorCode::kMeshValenceTooHigh, "too many cells round", kVertices,
                       "the limit is " + std::to_string(limits.max_vertex_valence) +
                           "; mesh the part with a core of some cells there, where they all come to a point or a line",
                       "cell_vertices");
}

void check_sharp_indices(const ControlMesh& mesh, const std::string& bound) {
  Offenders edges, vertices;
  const std::size_t n = mesh.vertex_count();
  for (std::size_t i = 0; i < mesh.sharp_edges.size(); ++i) {
    const auto [a, b] = mesh.sharp_edges[i];
    if (a >= n || b >= n) edges.add(static_cast<std::int64_t>(i), 2 * i + (a >= n ? 0 : 1));
  }
  edges.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "vertex id out of range in", kSharpEdges, bound, "sharp_edges");
  for (std::size_t i = 0; i < mesh.sharp_vertices.size(); ++i) {
    if (mesh.sharp_vertices[i] >= n) vertices.add(mesh.sharp_vertices[i], i);
  }
  vertices.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "out of range:", kSharpVertices, bound, "sharp_vertices");
}

void check_missed_vertices(const ControlMesh& mesh, const std::string& bound) {
  const std::vector<MissedVertex>& missed = mesh.missed_vertices;
  Offenders beyond, late;
  for (std::size_t i = 0; i < missed.size(); ++i) {
    if (missed[i].vertex >= mesh.vertex_count()) beyond.add(missed[i].vertex, i);
    if (i > 0 && missed[i].vertex <= missed[i - 1].vertex) late.add(missed[i].vertex, i);
  }
  beyond.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "out of range:", kVertices, bound, "missed_vertices");
  late.throw_if_any(ErrorCode::kMeshRepeatedVertex, "missed again or too late:", kVertices,
                    "list them in ascending order, each once", "missed_vertices");
}

/// Keys of mid-nodes name vertices and cells that there are, and ascend. Whether these have such an edge or face needs
/// the complex.
void check_mid_node_keys(const ControlMesh& mesh) {
  const auto check = [](const auto& keys, const char* field, auto is_one) {
    Offenders unknown, late;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (!is_one(keys[i])) unknown.add(static_cast<std::int64_t>(i));
      if (i > 0 && !(keys[i - 1] < keys[i])) late.add(static_cast<std::int64_t>(i));
    }
    unknown.throw_if_any(ErrorCode::kMeshBadMidNode, "vertices or cells that there aren't, or out of order, for",
                         kMidNodes, "name those of the mesh, vertices in ascending order", field);
    late.throw_if_any(ErrorCode::kMeshBadMidNode, "again or too late:", kMidNodes,
                      "list them in ascending order, each once", field);
  };
  const auto ascends = [&](const auto& vertices) {
    return std::ranges::adjacent_find(vertices, std::greater_equal<>()) == vertices.end() &&
           vertices.back() < mesh.vertex_count();
  };
  check(mesh.mid_nodes.edges, "edge_node_vertices", ascends);
  check(mesh.mid_nodes.faces, "face_node_vertices", ascends);
  check(mesh.mid_nodes.cells, "cell_node_cells",
        [&](std::uint32_t cell) { return cell < mesh.cell_count() && mesh.cell_kinds[cell] == CellKind::kHex; });
}

/// What is sharp or fitted can't be taken as meshed, too.
void check_as_meshed(const ControlMesh& mesh) {
  if (!mesh.as_meshed) return;
  const auto refuse = [](const char* field) {
    throw Error(ErrorCode::kMeshBadSharpFeature,
                std::string(field) + " can't go with as_meshed, which smooths nothing: leave one of them out", field);
  };
  if (!mesh.sharp_edges.empty()) refuse("sharp_edges");
  if (!mesh.sharp_vertices.empty()) refuse("sharp_vertices");
  if (mesh.interpolating) refuse("interpolating");
}

}  // namespace

void check_arrays(const ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel) {
  check_sizes(mesh, limits);
  check_names(mesh.channel_names,
              {ErrorCode::kMeshBadChannel, "channel", "channel_names", limits.max_channel_name_bytes});
  check_names(mesh.cell_region_names,
              {ErrorCode::kMeshBadCellRegion, "cell region", "cell_region_names", limits.max_cell_region_name_bytes});
  check_cell_regions(mesh);
  check_all_positions(mesh, limits, cancel);
  check_channel_values(mesh.channel_values, mesh.channel_count(), "channel_values", kVertices, cancel);
  check_channel_values(mesh.mid_nodes.values, mesh.channel_count(), "node_values", kMidNodes, cancel);
  const std::string bound = "vertex ids run from 0 to " + std::to_string(mesh.vertex_count() - 1);
  check_usage(check_corners(mesh, bound, cancel), limits);
  check_region_values(mesh);
  check_sharp_indices(mesh, bound);
  check_missed_vertices(mesh, bound);
  check_mid_node_keys(mesh);
  check_as_meshed(mesh);
}

}  // namespace ccslice
