// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/curved_cells.h"

#include <algorithm>

#include "core/mesh_import/mid_nodes.h"

namespace ccslice {
namespace {

constexpr std::size_t kGrid = 27;       // 3 x 3 x 3 places, index i + 3 j + 9 k.
constexpr std::size_t kMostNodes = 27;  // Of a hexahedron; 10 of a tetrahedron, 18 of a wedge: corners, edges, faces.

/// What a B-spline's control points weigh at the values at 0, 1/2 and 1.
constexpr double kBSpline[4][3] = {{16.0 / 3, -20.0 / 3, 7.0 / 3},
                                   {1.0 / 3, 4.0 / 3, -2.0 / 3},
                                   {-2.0 / 3, 4.0 / 3, 1.0 / 3},
                                   {7.0 / 3, -20.0 / 3, 16.0 / 3}};
/// The same of Bezier points of degree 2.
constexpr double kBezier[3][3] = {{1, 0, 0}, {-0.5, 2, -0.5}, {0, 0, 1}};

/// `in`: 3 x 3 x 3 points; returns n x n x n points, n = Rows, each axis mapped by the matrix.
template <std::size_t Rows>
std::vector<double> map_axes(std::vector<double> in, const double (&matrix)[Rows][3], std::size_t dimension) {
  std::array<std::size_t, 3> size = {3, 3, 3};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::array<std::size_t, 3> mapped = size;
    mapped[axis] = Rows;
    std::vector<double> out(mapped[0] * mapped[1] * mapped[2] * dimension, 0.0);
    for (std::size_t k = 0; k < mapped[2]; ++k) {
      for (std::size_t j = 0; j < mapped[1]; ++j) {
        for (std::size_t i = 0; i < mapped[0]; ++i) {
          std::array<std::size_t, 3> from = {i, j, k};
          double* to = &out[(i + mapped[0] * (j + mapped[1] * k)) * dimension];
          for (std::size_t n = 0; n < 3; ++n) {
            const double weight = matrix[std::array{i, j, k}[axis]][n];
            from[axis] = n;
            const double* value = &in[(from[0] + size[0] * (from[1] + size[1] * from[2])) * dimension];
            for (std::size_t d = 0; d < dimension; ++d) to[d] += weight * value[d];
          }
        }
      }
    }
    in = std::move(out);
    size = mapped;
  }
  return in;
}

/// Where a place of a tetrahedron or wedge is: barycentric coordinates, of a wedge those of the triangle, and along it.
struct NodePlace {
  std::array<double, 4> share{};
  double along = 0;
};

/// Where a corner of a child (bits along its axes) lies in a cell: in the middle of what joins the child's corner of
/// the cell to those ends.
NodePlace place_of(CellKind kind, std::size_t child, std::size_t bits) {
  const auto& ends = cell_topology(kind).corner_neighbours[child];
  const auto in_triangle = [&](std::size_t corner) { return kind == CellKind::kTet ? corner : corner % 3; };
  NodePlace place;
  place.along = kind == CellKind::kWedge && child >= 3 ? 1 : 0;
  double count = 1;
  place.share[in_triangle(child)] = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(bits >> axis & 1)) continue;
    if (in_triangle(ends[axis]) == in_triangle(child)) {
      place.along = 0.5;
    } else {
      place.share[in_triangle(ends[axis])] = 1;
      ++count;
    }
  }
  for (double& share : place.share) share /= count;
  return place;
}

/// The functions of degree 2 over a triangle or tetrahedron of those coordinates, of its corners, then of these edges.
template <std::size_t Corners, std::size_t Edges>
std::array<double, Corners + Edges> simplex_functions(const std::array<double, 4>& share,
                                                      std::span<const std::array<std::uint8_t, 2>> edges) {
  std::array<double, Corners + Edges> values;
  for (std::size_t i = 0; i < Corners; ++i) values[i] = share[i] * (2 * share[i] - 1);
  for (std::size_t e = 0; e < Edges; ++e) values[Corners + e] = 4 * share[edges[e][0]] * share[edges[e][1]];
  return values;
}

/// What a tetrahedron's 10 nodes, or a wedge's 18, weigh at a place.
std::array<double, kMostNodes> node_weights(CellKind kind, const NodePlace& place) {
  std::array<double, kMostNodes> weights{};
  if (kind == CellKind::kTet) {
    const auto values = simplex_functions<4, 6>(place.share, mid_edges(kind));
    std::ranges::copy(values, weights.begin());
    return weights;
  }
  // Nodes: 6 corners, edges of both triangles, edges between them, quadrilaterals, in the order of the lower edges.
  const auto across = simplex_functions<3, 3>(place.share, mid_edges(kind).first(3));
  const double t = place.along;
  const double low = (1 - t) * (1 - 2 * t), middle = 4 * t * (1 - t), high = t * (2 * t - 1);
  for (std::size_t i = 0; i < 3; ++i) {
    weights[i] = across[i] * low, weights[3 + i] = across[i] * high, weights[12 + i] = across[i] * middle;
    weights[6 + i] = across[3 + i] * low, weights[9 + i] = across[3 + i] * high;
    weights[15 + i] = across[3 + i] * middle;
  }
  return weights;
}

/// Which of a hexahedron's 3 x 3 x 3 places is in the middle of these corners, in VTK's order.
std::size_t place_between(std::span<const std::uint8_t> corners) {
  std::array<std::size_t, 3> twice{};
  for (const std::uint8_t corner : corners) {
    for (std::size_t axis = 0; axis < 3; ++axis) twice[axis] += vtk_to_bits(corner) >> axis & 1u;
  }
  for (std::size_t& sum : twice) sum = 2 * sum / corners.size();
  return twice[0] + 3 * twice[1] + 9 * twice[2];
}

}  // namespace

CurvedCells::CurvedCells(const ControlMesh& mesh, std::span<const std::uint32_t> origins, std::span<const float> values)
    : mesh_(mesh), origins_(origins), values_(values), dimension_(3 + mesh.channel_count()) {
  if (!any()) return;
  std::uint32_t begin = 0;
  for (const CellKind kind : mesh.cell_kinds) {
    first_corners_.push_back(begin);
    begin += static_cast<std::uint32_t>(corner_count(kind));
  }
  curved_.assign(mesh.cell_count(), 0);
  for (const ControlCellId cell : IdRange<ControlCellId>(mesh.cell_count())) {
    const auto at = corners(cell);
    const CellKind kind = mesh.cell_kinds[cell];
    const auto has_edge = [&](const auto& edge) { return node_of_edge({at[edge[0]], at[edge[1]]}).has_value(); };
    const auto has_face = [&](const auto& face) {
      return node_of_face({at[face[0]], at[face[1]], at[face[2]], at[face[3]]}).has_value();
    };
    curved_[cell] = std::ranges::any_of(mid_edges(kind), has_edge) || std::ranges::any_of(mid_faces(kind), has_face) ||
                    cell_node(mesh.mid_nodes, cell).has_value();
  }
}

std::span<const std::uint32_t> CurvedCells::corners(ControlCellId cell) const {
  return std::span(mesh_.cell_vertices)
      .subspan(first_corners_[cell], static_cast<std::size_t>(corner_count(mesh_.cell_kinds[cell])));
}

std::uint32_t CurvedCells::original(std::uint32_t vertex) const { return origins_.empty() ? vertex : origins_[vertex]; }

std::optional<std::size_t> CurvedCells::node_of_edge(std::array<std::uint32_t, 2> vertices) const {
  for (std::uint32_t& vertex : vertices) vertex = original(vertex);
  return edge_node(mesh_.mid_nodes, vertices);
}

std::optional<std::size_t> CurvedCells::node_of_face(std::array<std::uint32_t, 4> vertices) const {
  for (std::uint32_t& vertex : vertices) vertex = original(vertex);
  return face_node(mesh_.mid_nodes, vertices);
}

/// Positions and channels of a cell's nodes: corners, edges, faces and middle.
class CurvedCells::Nodes {
 public:
  Nodes(const CurvedCells& cells, ControlCellId cell)
      : cells_(cells), at_(cells.corners(cell)), kind_(cells.mesh_.cell_kinds[cell]), dimension_(cells.dimension_) {
    for (const std::uint32_t vertex : at_) add_vertex(vertex);
    for (const auto& [a, b] : mid_edges(kind_)) {
      add({{a, 0.5}, {b, 0.5}}, cells.node_of_edge({at_[a], at_[b]}), std::array{a, b});
    }
    for (const auto& face : mid_faces(kind_)) add_face(face);
    if (kind_ == CellKind::kHex) add_middle(cell);
  }

  std::span<const double> operator[](std::size_t node) const {
    return std::span(values_).subspan(node * dimension_, dimension_);
  }

 private:
  using Terms = std::vector<std::pair<std::size_t, double>>;  // Nodes and their weights.

  void add_vertex(std::uint32_t vertex) {
    const ControlMesh& mesh = cells_.mesh_;
    const auto& position = mesh.positions[vertex];
    values_.insert(values_.end(), position.begin(), position.end());
    for (std::size_t c = 0; c + 3 < dimension_; ++c) {
      values_.push_back(mesh.channel_values[vertex * (dimension_ - 3) + c]);
    }
  }

  /// Adds the node, or else what the terms say. A channel that jumps at a corner has the corners' mean.
  void add(const Terms& terms, std::optional<std::size_t> node, std::span<const std::uint8_t> corners) {
    const std::size_t begin = values_.size();
    values_.resize(begin + dimension_, 0.0);
    for (const auto& [term, weight] : terms) {
      for (std::size_t d = 0; d < dimension_; ++d) values_[begin + d] += weight * values_[term * dimension_ + d];
    }
    if (!node) return;
    const MidNodes& nodes = cells_.mesh_.mid_nodes;
    std::ranges::copy(nodes.positions[*node], values_.begin() + static_cast<std::ptrdiff_t>(begin));
    const std::size_t channels = dimension_ - 3;
    for (std::size_t c = 0; c < channels; ++c) {
      double sum = 0;
      bool jumps = false;
      for (const std::uint8_t corner : corners) {
        const double value = values_[corner * dimension_ + 3 + c];
        jumps = jumps || value != cells_.values_[cells_.original(at_[corner]) * channels + c];
        sum += value;
      }
      values_[begin + 3 + c] =
          jumps ? sum / static_cast<double>(corners.size()) : double{nodes.values[*node * channels + c]};
    }
  }

  void add_face(const std::array<std::uint8_t, 4>& face) {
    Terms terms;
    for (const std::uint8_t corner : face) terms.emplace_back(corner, -0.25);
    const auto edges = mid_edges(kind_);
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto has = [&](std::uint8_t corner) { return std::ranges::find(face, corner) != face.end(); };
      if (has(edges[e][0]) && has(edges[e][1])) terms.emplace_back(at_.size() + e, 0.5);
    }
    add(terms, cells_.node_of_face({at_[face[0]], at_[face[1]], at_[face[2]], at_[face[3]]}), face);
  }

  void add_middle(ControlCellId cell) {
    constexpr std::array<std::uint8_t, 8> kAll = {0, 1, 2, 3, 4, 5, 6, 7};
    Terms terms;
    for (std::size_t n = 0; n < 26; ++n) terms.emplace_back(n, n < 8 ? 0.125 : n < 20 ? -0.25 : 0.5);
    add(terms, cell_node(cells_.mesh_.mid_nodes, cell), kAll);
  }

  const CurvedCells& cells_;
  std::span<const std::uint32_t> at_;
  CellKind kind_;
  std::size_t dimension_;
  std::vector<double> values_;
};

/// Values of a cell's child, a hexahedron, at 3 x 3 x 3 places.
std::vector<double> CurvedCells::values_of_child(ControlCellId cell, std::size_t child) const {
  const CellKind kind = mesh_.cell_kinds[cell];
  const Nodes nodes(*this, cell);
  std::vector<double> values(kGrid * dimension_, 0.0);
  const auto add = [&](std::size_t place, std::size_t node, double weight) {
    for (std::size_t d = 0; d < dimension_; ++d) values[place * dimension_ + d] += weight * nodes[node][d];
  };
  if (kind == CellKind::kHex) {
    std::size_t node = 0;
    for (std::uint8_t corner = 0; corner < 8; ++corner) add(place_between(std::array{corner}), node++, 1);
    for (const auto& edge : mid_edges(kind)) add(place_between(edge), node++, 1);
    for (const auto& face : mid_faces(kind)) add(place_between(face), node++, 1);
    add(kGrid / 2, node, 1);
    return values;
  }
  std::array<NodePlace, 8> ends;
  for (std::size_t bits = 0; bits < 8; ++bits) ends[bits] = place_of(kind, child, bits);
  for (std::size_t place = 0; place < kGrid; ++place) {
    const std::array<double, 3> uvw = {0.5 * static_cast<double>(place % 3), 0.5 * static_cast<double>(place / 3 % 3),
                                       0.5 * static_cast<double>(place / 9)};
    NodePlace at;
    for (std::size_t bits = 0; bits < 8; ++bits) {
      double weight = 1;
      for (std::size_t axis = 0; axis < 3; ++axis) weight *= bits >> axis & 1 ? uvw[axis] : 1 - uvw[axis];
      for (std::size_t i = 0; i < 4; ++i) at.share[i] += weight * ends[bits].share[i];
      at.along += weight * ends[bits].along;
    }
    const auto weights = node_weights(kind, at);
    const std::size_t count = kind == CellKind::kTet ? 10 : 18;
    for (std::size_t node = 0; node < count; ++node) add(place, node, weights[node]);
  }
  return values;
}

std::vector<double> CurvedCells::patch(ControlCellId cell, std::size_t child) const {
  return map_axes(values_of_child(cell, child), kBSpline, dimension_);
}

/// Across the side a B-spline is (1, 4, 1) / 6 of its first three control points, or of its last three.
std::vector<double> CurvedCells::side(std::span<const double> patch, const std::array<std::uint8_t, 3>& corners) const {
  constexpr std::array<std::size_t, 3> kStride = {1, 4, 16};
  const unsigned s_bit = corners[0] ^ corners[1], t_bit = corners[1] ^ corners[2];
  const auto axis_of = [](unsigned bit) { return static_cast<std::size_t>(bit >> 1); };  // 1, 2, 4 -> 0, 1, 2.
  const std::size_t s = axis_of(s_bit), t = axis_of(t_bit), across = 3 - s - t;
  const auto along = [&](std::size_t axis, std::size_t n) {
    return kStride[axis] * ((corners[0] >> axis & 1) != 0 ? 3 - n : n);
  };
  const std::size_t first = (corners[0] >> across & 1) != 0 ? 1 : 0;
  std::vector<double> points(16 * dimension_, 0.0);
  for (std::size_t n = 0; n < 16; ++n) {
    for (std::size_t layer = 0; layer < 3; ++layer) {
      const std::size_t from = along(s, n % 4) + along(t, n / 4) + kStride[across] * (first + layer);
      const double weight = (layer == 1 ? 4.0 : 1.0) / 6;
      for (std::size_t d = 0; d < dimension_; ++d) points[n * dimension_ + d] += weight * patch[from * dimension_ + d];
    }
  }
  return points;
}

std::vector<std::pair<double, double>> CurvedCells::channel_ranges(const CancellationToken& cancel) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<std::pair<double, double>> ranges(dimension_ - 3, {kInfinity, -kInfinity});
  if (ranges.empty()) return ranges;
  PeriodicPoll poll(cancel, 64);
  for (const ControlCellId cell : IdRange<ControlCellId>(mesh_.cell_count())) {
    poll();
    if (!is_curved(cell)) continue;
    const CellKind kind = mesh_.cell_kinds[cell];
    const std::size_t children = kind == CellKind::kHex ? 1 : static_cast<std::size_t>(corner_count(kind));
    for (std::size_t child = 0; child < children; ++child) {
      const std::vector<double> points = map_axes(values_of_child(cell, child), kBezier, dimension_);
      for (std::size_t p = 0; p < points.size(); ++p) {
        if (p % dimension_ < 3) continue;
        auto& [low, high] = ranges[p % dimension_ - 3];
        low = std::min(low, points[p]), high = std::max(high, points[p]);
      }
    }
  }
  return ranges;
}

}  // namespace ccslice
